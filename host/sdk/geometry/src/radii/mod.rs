//! Disc radii that leave no holes.

mod covering;
mod limits;

use crate::neighbours::{Neighbours, SEARCH_SHARE};
use crate::progress::{Cancelled, Progress, part};
pub(crate) use covering::COVER;
use covering::Surface;
use glam::Vec3;

/// The radius of a lone point where its coordinates are small: there is nothing to compare it with,
/// and a hundredth of a unit is seen by a camera that frames one unit.
pub const LONE_RADIUS: f32 = 0.01;

/// Estimates radii at which the discs of a sampled surface overlap without holes.
///
/// A set of discs covers a plane where each reaches all of its point's Voronoi cell. So the cell is
/// built in the tangent plane from the nearest points, laid out at their distances in space, and
/// the radius is that of its farthest corner, times 1.15 for curvature. Points on the back of a
/// thin sheet, told by their normals, do not count; the open side of a cell at a border neither.
/// To be neighbours in a surface is mutual, to be nearest is not: where a coarse part borders on a
/// fine one, cells are built also from points that count theirs among their own nearest.
///
/// Cells that span empty space are limited: a disc reaches no farther than those around it bear it out. A point
/// of a surface keeps below three times the median of its nearest, and below one and a half times at a border; or of
/// those that count it among theirs from farther away, where that is more. At the border of random points these have large
/// discs themselves. Measured: to leave them out, or all but much coarser ones, opens holes in sparse sheets and rooms.
/// A group of up to 20 points that no surface counts among its nearest
/// floats: there are too few to tell a surface from stray points, so each gets no more than the
/// median of the nearest that belong to surfaces, or of all of these where there is none near.
/// Both compare with what is around, and grouping goes by ranks of distances, so that there is no
/// limit to how much coarser one surface may be than another; tenfold is tested.
///
/// Where `planarity` (one per position, as normals are estimated with; none where all are of surfaces) is less
/// than [`PLANAR`] there is no surface to cover: the radius is half the mean distance of the four nearest, so that
/// splats just touch, and up to one and a half times that distance just below the threshold, where it may be a
/// rough surface. Where it is less than 0.75 nothing is larger than three times the median of those around.
///
/// `normals` are unit vectors, one per position; where they are missing +z is taken. Coincident
/// positions get equal radii. A cloud of one distinct position gets [`LONE_RADIUS`], or four rounding
/// steps of its largest coordinate where that is more; positions that are not finite get the same.
/// All radii are positive, finite and, lone ones apart, at most the diagonal of the bounds.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn estimate(
    positions: &[Vec3],
    normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let neighbours = Neighbours::build(positions, &part(progress, 0.0..SEARCH_SHARE))?;
    estimate_with(&neighbours, normals, &[], &part(progress, SEARCH_SHARE..1.0))
}

/// [`estimate`] for a search structure that exists already.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn estimate_with(
    neighbours: &Neighbours,
    normals: &[Vec3],
    planarity: &[f32],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let surface = Surface::of(neighbours, normals, planarity, &part(progress, 0.0..0.02))?;
    let mut cells = surface.cover_all(&part(progress, 0.02..0.8))?;
    limits::limit(&surface, &mut cells, &part(progress, 0.8..0.96))?;
    limits::limit_rough(&surface, &mut cells, &part(progress, 0.96..0.99))?;
    let lone = lone_radius(neighbours.bounds().reach());
    let diagonal = neighbours.bounds().diagonal();
    drop(surface);
    neighbours.by_index(lone, &part(progress, 0.99..1.0), |place| {
        let radius = f64::from(cells[place].radius()) * neighbours.scale();
        if radius > 0.0 { in_range(radius.min(diagonal)) } else { lone }
    })
}

/// Planarity from which on a point is of a surface, where nobody says otherwise: at less, points spread across
/// their plane by more than half of what they do along it. Measured on scans: of the trees of an airborne one
/// nearly all are below, of its ground, a room, an outcrop and clean meshes at most 0.5 %.
pub const PLANAR: f32 = 0.5;

/// The median; of an even number the upper one of the two in the middle.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The nearest f32 that is positive, finite and not subnormal, since graphics hardware flushes
/// subnormal numbers to zero.
pub(crate) fn in_range(radius: f64) -> f32 {
    radius.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32
}

/// The radius of a point that has no neighbours: visible at unit scale, and at least four rounding
/// steps of the coordinate, below which a disc is not resolved.
fn lone_radius(reach: f64) -> f32 {
    in_range(f64::from(LONE_RADIUS).max(4.0 * f64::from(f32::EPSILON) * reach))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod variation;
