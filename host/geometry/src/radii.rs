//! Disc radii that leave no holes.

use crate::cell::Cell;
use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, map, part, tell};
use glam::{DVec2, DVec3, Vec3};

/// Neighbours that bound a point's cell. In a random sampling a corner of a cell lies farther away
/// than the 20th neighbour with probability e^-20, so that practically every corner is found.
const CELL_NEIGHBOURS: usize = 20;

/// Factor on the radius of a cell. On a sphere the disc at angle p has to reach to the tangent of
/// p / 2 where half the chord to the neighbour is its sine; the ratio is 1.14 for neighbours one
/// radian apart and less for all finer samplings.
const COVER: f64 = 1.15;

/// A disc larger than this many times the median of its nearest is that of an outlier, whose cell
/// spans the gap to the rest of the cloud rather than a piece of surface.
const OUTLIER: f64 = 3.0;

/// Nearest points whose radii an outlier is compared with.
const COMPARED: usize = 8;

/// Cosine between normals below which a neighbour lies on the back of a thin sheet; sharp edges
/// reach zero, acute ones somewhat less.
const BACK_SIDE: f32 = -0.5;

/// The radius of a lone point where its coordinates are small: there is nothing to compare it with,
/// and a hundredth of a unit is seen by a camera that frames one unit.
pub const LONE_RADIUS: f32 = 0.01;

/// Estimates radii at which the discs of a sampled surface overlap without holes.
///
/// A set of discs covers a plane where each reaches all of its point's Voronoi cell. So the cell is
/// built in the tangent plane from the nearest points, laid out at their distances in space, and
/// the radius is that of its farthest corner, times 1.15 for curvature. Points on the back of a
/// thin sheet, told by their normals, do not count; the open side of a cell at a border neither.
/// Radii are kept below three times the median of their nearest, since the cell of an outlier
/// spans empty space.
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
    estimate_with(&Neighbours::new(positions), normals, progress)
}

/// [`estimate`] for a search structure that exists already.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn estimate_with(
    neighbours: &Neighbours,
    normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let fitting = part(progress, 0.0..0.8);
    let cells = map(neighbours.n_distinct(), &fitting, |place| cover(neighbours, normals, place))?;
    let comparing = part(progress, 0.8..1.0);
    let radii = map(cells.len(), &comparing, |place| {
        let (radius, near) = &cells[place];
        let mut others = [0.0; COMPARED];
        let mut count = 0;
        for &other in near.iter().filter(|&&other| other != NOBODY) {
            others[count] = cells[other as usize].0;
            count += 1;
        }
        let others = &mut others[..count];
        others.sort_unstable_by(f64::total_cmp);
        others.get(count / 2).map_or(*radius, |median| radius.min(OUTLIER * median))
    })?;
    let lone = lone_radius(neighbours.bounds().reach());
    let diagonal = neighbours.bounds().diagonal();
    let result = (0..neighbours.len())
        .map(|index| {
            neighbours.place_of(index).map_or(lone, |place| {
                let radius = radii[place] * neighbours.scale();
                if radius > 0.0 { in_range(radius.min(diagonal)) } else { lone }
            })
        })
        .collect();
    tell(progress, 1.0)?;
    Ok(result)
}

/// The nearest f32 that is positive, finite and not subnormal, since graphics hardware flushes
/// subnormal numbers to zero.
fn in_range(radius: f64) -> f32 {
    radius.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32
}

/// The radius of a point that has no neighbours: visible at unit scale, and at least four rounding
/// steps of the coordinate, below which a disc is not resolved.
fn lone_radius(reach: f64) -> f32 {
    in_range(f64::from(LONE_RADIUS).max(4.0 * f64::from(f32::EPSILON) * reach))
}

const NOBODY: u32 = u32::MAX;

/// The covering radius of a point in the unit box, 0 where it is alone, and its nearest points.
fn cover(neighbours: &Neighbours, normals: &[Vec3], place: usize) -> (f64, [u32; COMPARED]) {
    let near = neighbours.around(place, CELL_NEIGHBOURS);
    let mut nearest = [NOBODY; COMPARED];
    for (slot, &(other, _)) in nearest.iter_mut().zip(&near) {
        *slot = other;
    }
    let (Some(&(_, closest)), Some(&(_, farthest))) = (near.first(), near.last()) else {
        return (0.0, nearest);
    };
    let normal_of =
        |place: usize| normals.get(neighbours.first()[place] as usize).copied().unwrap_or(Vec3::Z);
    let normal = normal_of(place);
    let (u, v) = tangents(normal.as_dvec3());
    let points = neighbours.distinct();
    let mut cell = Cell::new(farthest);
    for &(other, distance) in &near {
        // The bisector to this and all that are farther lies beyond the cell.
        if distance >= 2.0 * cell.reach() {
            break;
        }
        if normal_of(other as usize).dot(normal) < BACK_SIDE {
            continue;
        }
        let offset = points[other as usize] - points[place];
        let direction = DVec2::new(offset.dot(u), offset.dot(v));
        // A point straight above has no direction in the plane and bounds nothing there.
        if let Some(direction) = direction.try_normalize() {
            cell.cut(direction * distance);
        }
    }
    let radius = cell.radius().unwrap_or(closest).min(farthest);
    (COVER * radius, nearest)
}

/// Two unit vectors that span the plane perpendicular to a normal; any plane where it is invalid.
fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    normal.any_orthonormal_pair()
}

#[cfg(test)]
mod tests;
