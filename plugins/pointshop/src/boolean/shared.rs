//! What two solids share: surfels that both have, and faces where their surfaces coincide.

use crate::boolean::seam::{CREASE, Face, ON, SAME_PLACE, Solid};
use crate::search::Found;
use std::ops::Range;
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;

/// Whether a surfel is one of the other solid's too: `None` where it is not, else whether both face
/// the same way.
pub(crate) type Twin = Option<bool>;

/// Ratio of radii up to which surfels in one place are the same: 4 of a cloud thinned to a sixteenth.
/// Beyond it a wide disc covers much surface of which the narrow one says nothing.
const OTHER_RADIUS: f64 = 4.0;

/// Twins around a surfel from which on the surface there is taken as shared: three make a plane.
const ENOUGH_TWINS: usize = 3;

/// Two fitted faces coincide where they are apart by less than this share of the spacing or radius,
/// the larger one. Two samplings of an ellipsoid or a torus whose bends have 4 surfels across their
/// radius agree to 0.05 at 19 of 20 surfels and to 0.1 at all but a few, and surfaces that are 0.3
/// spacings apart have to be told apart.
const SAME_FACE: f64 = 0.1;

/// For each surfel of a solid, whether the other has it too.
///
/// # Errors
/// Where the job is to stop.
pub(crate) fn twins(
    own: &Solid,
    other: &Solid,
    job: &Job<'_>,
    share: Range<f64>,
) -> Result<Vec<Twin>> {
    job.map(own.surfels.places.len(), share, |i| twin(own, i, other))
}

/// Where the other solid has a surfel in the same place, up to rounding, along the same plane and
/// about as large; one that faces the same way counts first.
fn twin(own: &Solid, i: usize, other: &Solid) -> Twin {
    let (place, normal, radius) = (own.surfels.places[i], own.surfels.normals[i], own.radius(i));
    let mut found = None;
    // Of radius 0 are those that are in exactly one place.
    other.search.within(place, SAME_PLACE * radius, |near| {
        let j = near.index as usize;
        let (least, most) = (radius.min(other.radius(j)), radius.max(other.radius(j)));
        let n = other.surfels.normals[j];
        let off = near.squared.sqrt() + least * normal.cross(n).length();
        if off <= SAME_PLACE * least && most <= OTHER_RADIUS * least {
            found = Some(normal.dot(n) > 0.0 || found == Some(true));
        }
    });
    found
}

/// Whether all surfels of the other solid within a distance, of those found around a place, are
/// twins; then a surfel without one, of a thinned cloud say, is in the shared surface too. The
/// answer is whether it faces the same way.
pub(crate) fn among_twins(
    other: &Solid,
    twins: &[Twin],
    (place, normal, radius): (DVec3, DVec3, f64),
    around: &[Found],
    distance: f64,
) -> Twin {
    let mut near = around.iter().take_while(|found| found.squared <= distance * distance);
    let n_near = near.clone().count();
    if n_near < ENOUGH_TWINS || !near.all(|found| twins[found.index as usize].is_some()) {
        return None;
    }
    // Another layer beside it is none of it.
    let cosine = |found: &Found| {
        let i = found.index as usize;
        let off = normal.dot(other.surfels.places[i] - place).abs();
        Some(normal.dot(other.surfels.normals[i]))
            .filter(|cosine| cosine.abs() > CREASE && off < ON * radius)
    };
    around[..n_near].iter().find_map(cosine).map(|cosine| cosine > 0.0)
}

/// Whether a face of one solid coincides with one of `others`, and whether both face the same way.
pub(crate) fn shared(face: &Face, others: &[Face], width: f64) -> Option<bool> {
    let off = |other: &Face| {
        let (a, b) = (face.sphere.foot(face.middle)?, other.sphere.foot(face.middle)?);
        // Both feet are along normals that are all but the same, so that their distance is that of
        // the faces.
        let off = a.place.distance(b.place) + width * a.normal.cross(b.normal).length();
        Some((off, a.normal.dot(b.normal) > 0.0))
    };
    let nearest = others.iter().filter_map(off).min_by(|(a, _), (b, _)| a.total_cmp(b));
    nearest.filter(|(off, _)| *off < SAME_FACE * width).map(|(_, same_way)| same_way)
}
