//! Surfels at borders of a surface, and those of them that belong together.

use crate::search::Search;
use crate::surfels::Surfels;
use std::f64::consts::TAU;
use std::ops::Range;
use surfelshop_api::prelude::*;

/// Nearest surfels that a border is told by.
const AROUND: usize = 24;

/// Spacings within which they count.
const REACH: f64 = 2.0;

/// An angle without surfels from which on one is at a border: about that at the rim of a hole of two spacings.
const GAP: f64 = 110.0 / 360.0 * TAU;

/// Sine of the angle to the plane from which on a surfel lies above or below.
const ABOVE: f64 = 0.8;

/// Spacings within which surfels at borders are of one border.
const LINK: f64 = 3.0;

/// Which surfels are at a border: those around leave out a part of the circle in their plane.
///
/// Source: Bendels, Schnabel and Klein, "Detecting holes in point set surfaces", WSCG 2006, the
/// criterion of angles.
///
/// # Errors
/// Where the job is to stop.
pub(crate) fn at_borders(
    surfels: &Surfels,
    search: &Search,
    apart: &[f64],
    job: &Job<'_>,
    share: Range<f64>,
) -> Result<Vec<bool>> {
    job.map(surfels.places.len(), share, |i| {
        let (place, normal) = (surfels.places[i], surfels.normals[i]);
        let (u, v) = normal.any_orthonormal_pair();
        let near = search.nearest(place, AROUND + 1, REACH * apart[i]);
        // Surfels of other surfaces count, since what ends at another surface is no border; those above and
        // below are in no direction.
        let offsets = near.iter().map(|found| surfels.places[found.index as usize] - place);
        let mut angles: Vec<f64> = offsets
            .filter(|offset| offset.dot(normal).abs() < ABOVE * offset.length())
            .map(|offset| offset.dot(v).atan2(offset.dot(u)))
            .collect();
        angles.sort_unstable_by(f64::total_cmp);
        let Some((first, last)) = angles.first().zip(angles.last()) else { return true };
        let around = first + TAU - last;
        let gaps = angles.windows(2).map(|pair| pair[1] - pair[0]);
        gaps.fold(around, f64::max) > GAP
    })
}

/// Surfels of each border, in the order of their first ones.
///
/// # Errors
/// Where the job is to stop.
pub(crate) fn borders(
    surfels: &Surfels,
    is_border: &[bool],
    apart: &[f64],
    job: &Job<'_>,
) -> Result<Vec<Vec<usize>>> {
    let members: Vec<usize> = (0..is_border.len()).filter(|&i| is_border[i]).collect();
    let places: Vec<_> = members.iter().map(|&i| surfels.places[i]).collect();
    let search = Search::build(&places, job)?;
    let mut border_of = vec![usize::MAX; members.len()];
    let mut borders: Vec<Vec<usize>> = Vec::new();
    for first in 0..members.len() {
        if border_of[first] != usize::MAX {
            continue;
        }
        job.check()?;
        let number = borders.len();
        border_of[first] = number;
        let mut border = vec![first];
        let mut next = 0;
        while let Some(&own) = border.get(next) {
            next += 1;
            let reach = LINK * apart[members[own]];
            search.within(places[own], reach, |found| {
                let other = found.index as usize;
                let turned = surfels.normals[members[own]].dot(surfels.normals[members[other]]);
                if border_of[other] == usize::MAX && turned > 0.0 {
                    border_of[other] = number;
                    border.push(other);
                }
            });
        }
        let mut border: Vec<usize> = border.into_iter().map(|i| members[i]).collect();
        border.sort_unstable();
        borders.push(border);
    }
    Ok(borders)
}
