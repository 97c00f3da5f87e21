//! Disc radii that leave no holes.

mod standing;

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
    let n = neighbours.n_distinct();
    let fitting = part(progress, 0.0..0.7);
    let cells = map(n, &fitting, |place| cover(neighbours, normals, place, &[]))?;
    let on_surface = standing::on_surface(&cells);
    let coarser = Coarser(standing::coarser_sides(neighbours.distinct(), &cells, &on_surface));
    let widening = part(progress, 0.7..0.9);
    let covering = map(n, &widening, |place| match coarser.of(place) {
        [] => cells[place].radius,
        beyond => cover(neighbours, normals, place, beyond).radius,
    })?;
    let usual = usual(&covering, &on_surface);
    let comparing = part(progress, 0.9..1.0);
    let radii = map(n, &comparing, |place| {
        let median = |places: &mut dyn Iterator<Item = u32>| {
            median(places.filter(|&p| on_surface[p as usize]).map(|p| covering[p as usize]))
        };
        let near = median(&mut cells[place].nearest());
        let beyond = median(&mut coarser.of(place).iter().map(|&(_, from)| from));
        let usual = near.or(usual).into_iter().chain(beyond).reduce(f64::max);
        usual.map_or(covering[place], |usual| covering[place].min(OUTLIER * usual))
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

/// The median of the covering radii on surfaces, in the unit box.
fn usual(covering: &[f64], on_surface: &[bool]) -> Option<f64> {
    median(covering.iter().zip(on_surface).filter(|(_, on)| **on).map(|(radius, _)| *radius))
}

/// The radius of a point that has no neighbours: visible at unit scale, and at least four rounding
/// steps of the coordinate, below which a disc is not resolved.
fn lone_radius(reach: f64) -> f32 {
    in_range(f64::from(LONE_RADIUS).max(4.0 * f64::from(f32::EPSILON) * reach))
}

const NOBODY: u32 = u32::MAX;

/// A point's covering radius and what it was found from, in the unit box.
struct Covering {
    /// 0 where the point is alone.
    radius: f64,
    /// Distance of the farthest neighbour that the cell was cut from.
    known: f64,
    nearest: [u32; COMPARED],
}

impl Covering {
    /// The nearest points, nearest first.
    fn nearest(&self) -> impl Iterator<Item = u32> {
        self.nearest.iter().copied().filter(|&other| other != NOBODY)
    }
}

/// Links as [`standing::coarser_sides`] finds them.
struct Coarser(Vec<(u32, u32)>);

impl Coarser {
    /// The links of one point.
    fn of(&self, place: usize) -> &[(u32, u32)] {
        let first = self.0.partition_point(|&(to, _)| (to as usize) < place);
        let after = self.0[first..].partition_point(|&(to, _)| to as usize == place);
        &self.0[first..first + after]
    }
}

/// The median; of an even number the upper one of the two in the middle.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Covers a point's cell, which is cut by its nearest points and by some that lie beyond these.
fn cover(
    neighbours: &Neighbours,
    normals: &[Vec3],
    place: usize,
    beyond: &[(u32, u32)],
) -> Covering {
    let points = neighbours.distinct();
    let mut near = neighbours.around(place, CELL_NEIGHBOURS);
    let distance = |&(_, from): &(u32, u32)| (from, points[from as usize].distance(points[place]));
    let known = near.len();
    near.extend(beyond.iter().map(distance));
    near[known..].sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let mut nearest = [NOBODY; COMPARED];
    for (slot, &(other, _)) in nearest.iter_mut().zip(&near) {
        *slot = other;
    }
    let (Some(&(_, closest)), Some(&(_, farthest))) = (near.first(), near.last()) else {
        return Covering { radius: 0.0, known: 0.0, nearest };
    };
    let cell = cell(neighbours, normals, place, &near, farthest);
    let radius = COVER * cell.radius().unwrap_or(closest).min(farthest);
    Covering { radius, known: farthest, nearest }
}

/// The cell of a point among others, which are given with their distances, nearest first.
fn cell(
    neighbours: &Neighbours,
    normals: &[Vec3],
    place: usize,
    near: &[(u32, f64)],
    limit: f64,
) -> Cell {
    let normal_of =
        |place: usize| normals.get(neighbours.first()[place] as usize).copied().unwrap_or(Vec3::Z);
    let normal = normal_of(place);
    let (u, v) = tangents(normal.as_dvec3());
    let points = neighbours.distinct();
    let mut cell = Cell::new(limit);
    for &(other, distance) in near {
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
    cell
}

/// Two unit vectors that span the plane perpendicular to a normal; any plane where it is invalid.
fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    normal.any_orthonormal_pair()
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod variation;
