//! The part of a surface around some places, and how its surfels lie to each other.

use crate::search::Search;
use crate::surfels::{Surfels, median};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use surfelshop_api::glam::{DVec2, DVec3};
use surfelshop_api::prelude::*;

/// Neighbours that a surfel is linked with: the first ring and some of the second, so that a link goes in each
/// direction.
const LINKED: usize = 10;

/// Cosine of the angle between normals up to which surfels are linked.
const FACING: f64 = 0.3;

/// Links are at most so many times as long as that to the third neighbour: across a gap there is none.
const LONGEST: f64 = 3.0;

/// Links count as at least this share of the middle one: two surfels at nearly one place would hold each other so firmly that
/// nothing moves them.
const LEAST: f64 = 0.2;

/// The most surfels of a patch: some 500 bytes each.
const MOST: usize = 3_000_000;

/// Surfels between two questions whether to stop.
const QUESTION: usize = 4096;

/// A link from one surfel to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    /// The other one, by its place in the patch.
    pub(crate) to: u32,
    /// Where it lies in the tangent plane of the first, as far away as over the surface.
    pub(crate) offset: DVec2,
    /// 1 over the square of the distance, but for the shortest: of any length the same strain counts the same.
    pub(crate) weight: f64,
}

/// A patch of a surface.
pub(crate) struct Patch {
    /// Which surfels of the cloud, in order of their numbers.
    pub(crate) surfels: Vec<u32>,
    /// The axes of each tangent plane; with the normal they are right-handed.
    pub(crate) axes: Vec<[DVec3; 2]>,
    /// Where the links of each end.
    ends: Vec<usize>,
    links: Vec<Link>,
}

impl Patch {
    /// The mean length of links; 0 where there are none.
    pub(crate) fn mean_length(&self) -> f64 {
        let sum: f64 = self.links.iter().map(|link| link.offset.length()).sum();
        sum / self.links.len().max(1) as f64
    }

    /// The links of a surfel.
    pub(crate) fn links(&self, i: usize) -> &[Link] {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.links[start..self.ends[i]]
    }

    /// The patch of all surfels whose distance over the surface from one of `seeds`, surfels of the cloud, is at most
    /// `reach`.
    ///
    /// # Errors
    /// Where the job is to stop, and where there are more than [`MOST`].
    pub(crate) fn around(
        surfels: &Surfels,
        search: &Search,
        seeds: &[u32],
        reach: f64,
        job: &Job<'_>,
    ) -> Result<Self> {
        let neighbours = |i: u32| neighbours(surfels, search, i as usize);
        let mut found: std::collections::HashMap<u32, f64> =
            seeds.iter().map(|&seed| (seed, 0.0)).collect();
        let mut open: BinaryHeap<(Reverse<u64>, u32)> =
            seeds.iter().map(|&seed| (Reverse(0f64.to_bits()), seed)).collect();
        let mut n_visited = 0usize;
        while let Some((Reverse(bits), i)) = open.pop() {
            // Bits of numbers that are not negative are in their order.
            let distance = f64::from_bits(bits);
            if found.get(&i).is_some_and(|&known| known < distance) {
                continue;
            }
            n_visited += 1;
            if n_visited.is_multiple_of(QUESTION) {
                job.check()?;
            }
            if found.len() > MOST {
                return Err(Error::new(format!(
                    "expected a picture over at most {MOST} surfels, found more within {reach:.3e} of the \
                     places; set a smaller `reach`"
                )));
            }
            for j in neighbours(i) {
                let apart = surfels.places[i as usize].distance(surfels.places[j as usize]);
                let whole = distance + apart;
                if whole <= reach && found.get(&j).is_none_or(|&known| whole < known) {
                    found.insert(j, whole);
                    open.push((Reverse(whole.to_bits()), j));
                }
            }
        }
        let mut chosen: Vec<u32> = found.into_keys().collect();
        chosen.sort_unstable();
        Self::of(surfels, search, chosen, job, 0.1..0.2)
    }

    /// The patch of these surfels, in order of their numbers.
    ///
    /// # Errors
    /// Where the job is to stop.
    pub(crate) fn of(
        surfels: &Surfels,
        search: &Search,
        chosen: Vec<u32>,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<Self> {
        let near = job.map(chosen.len(), share, |i| {
            let near = neighbours(surfels, search, chosen[i] as usize).into_iter();
            near.filter_map(|j| Some(chosen.binary_search(&j).ok()? as u32)).collect::<Vec<u32>>()
        })?;
        // To be near is not mutual; a link is.
        let mut mutual: Vec<Vec<u32>> = vec![Vec::new(); chosen.len()];
        for (i, near) in near.iter().enumerate() {
            for &j in near {
                mutual[i].push(j);
                mutual[j as usize].push(i as u32);
            }
        }
        drop(near);
        job.check()?;
        let axes: Vec<[DVec3; 2]> = chosen
            .iter()
            .map(|&i| {
                let normal = surfels.normals[i as usize];
                let right = normal.any_orthonormal_vector();
                [right, normal.cross(right)]
            })
            .collect();
        let n_links = mutual.iter().map(Vec::len).sum();
        let (mut ends, mut links) = (Vec::with_capacity(chosen.len()), Vec::with_capacity(n_links));
        for (i, near) in mutual.iter_mut().enumerate() {
            near.sort_unstable();
            near.dedup();
            if i.is_multiple_of(QUESTION) {
                job.check()?;
            }
            let own = chosen[i] as usize;
            let offset = |&j: &u32| offset(surfels, own, chosen[j as usize] as usize, axes[i]);
            let offsets: Vec<DVec2> = near.iter().map(offset).collect();
            let middle = median(offsets.iter().map(|offset| offset.length())).unwrap_or(0.0);
            let least = (LEAST * middle).powi(2);
            links.extend(near.iter().zip(offsets).filter_map(|(&to, offset)| {
                let weight = 1.0 / offset.length_squared().max(least);
                (weight.is_finite() && weight > 0.0).then_some(Link { to, offset, weight })
            }));
            *near = Vec::new();
            ends.push(links.len());
        }
        Ok(Self { surfels: chosen, axes, ends, links })
    }
}

/// The surfels that a surfel is linked with.
fn neighbours(surfels: &Surfels, search: &Search, i: usize) -> Vec<u32> {
    let near = search.nearest(surfels.places[i], LINKED + 1, f64::INFINITY);
    let normal = surfels.normals[i];
    let own = near.iter().filter(|found| found.index as usize != i && found.squared > 0.0);
    let most = own.clone().nth(2).map_or(f64::INFINITY, |third| LONGEST.powi(2) * third.squared);
    own.filter(|found| found.squared <= most)
        .map(|found| found.index)
        .filter(|&j| surfels.normals[j as usize].dot(normal) > FACING)
        .collect()
}

/// Where a surfel lies in the tangent plane of another one: in the direction in which it is seen, and as far as the arc
/// is long that has both normals at its ends.
fn offset(surfels: &Surfels, from: usize, to: usize, axes: [DVec3; 2]) -> DVec2 {
    let chord = surfels.places[to] - surfels.places[from];
    let flat = DVec2::new(chord.dot(axes[0]), chord.dot(axes[1]));
    let half = 0.5 * surfels.normals[from].angle_between(surfels.normals[to]);
    let arc = if half > 1e-6 { half / half.sin() } else { 1.0 };
    flat.normalize_or_zero() * chord.length() * arc
}
