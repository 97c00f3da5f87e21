//! Coordinates: dropping what is not finite, and the choice of the origin.

use super::vectors::whole_vectors;
use crate::cloud::buffer::Buffer;
use crate::error::ReadFault;
use crate::summary::Summary;
use crate::table::Table;
use glam::{DVec3, Vec3};
use surfelshop_geometry::Bounds;

pub(super) struct Positions {
    pub(super) origin: DVec3,
    pub(super) positions: Vec<Vec3>,
    /// Those of `positions`; `None` where there are none.
    pub(super) bounds: Option<Bounds>,
}

/// Coordinates beyond this are dropped like infinite ones: a quarter of f32's range, so that
/// differences and diagonals of what is kept are finite in f32.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 4.0;

/// Takes the coordinates out of the table and drops rows whose coordinates are not finite.
pub(super) fn take(table: &mut Table, summary: &mut Summary) -> Result<Positions, ReadFault> {
    let names = ["x", "y", "z"];
    // The usual files have floats side by side, which are the positions already.
    if let Some(Buffer::F32(_)) = table.woven(&names)
        && let Some(Buffer::F32(coordinates)) = table.take_woven(&names)
    {
        let usable = |coordinate: f32| f64::from(coordinate.abs()) <= MAX_COORDINATE;
        let coordinates = keep_usable(coordinates, table, summary, usable, f32::is_finite);
        let positions: Vec<Vec3> = whole_vectors(coordinates);
        let (origin, bounds) = origin(table, positions.len(), |i| positions[i].as_dvec3());
        if origin == DVec3::ZERO {
            return Ok(Positions { origin, positions, bounds });
        }
        return Ok(placed(origin, positions.iter().map(|p| p.as_dvec3())));
    }
    let coordinates = match table.take_woven(&names) {
        Some(Buffer::F64(coordinates)) => coordinates,
        Some(other) => other.iter_f64().collect(),
        None => {
            let parts = table.take(names).ok_or_else(|| ReadFault::NoCoordinates {
                element: table.element.clone(),
                found: crate::error::listed(table.names()),
            })?;
            let [x, y, z] = parts.each_ref().map(Buffer::iter_f64);
            x.zip(y).zip(z).flat_map(|((x, y), z)| [x, y, z]).collect()
        }
    };
    let usable = |coordinate: f64| coordinate.abs() <= MAX_COORDINATE;
    let coordinates = keep_usable(coordinates, table, summary, usable, f64::is_finite);
    let points: Vec<DVec3> = whole_vectors(coordinates);
    let (origin, _) = origin(table, points.len(), |i| points[i]);
    Ok(placed(origin, points.iter().copied()))
}

/// Drops the rows that have a coordinate that is not usable.
fn keep_usable<T: Copy>(
    mut coordinates: Vec<T>,
    table: &mut Table,
    summary: &mut Summary,
    usable: impl Fn(T) -> bool,
    finite: impl Fn(T) -> bool,
) -> Vec<T> {
    // Blocks without a way out of the loop are tested several numbers at a time.
    let all = |block: &[T]| block.iter().fold(true, |all, &number| all & usable(number));
    if coordinates.chunks(4096).all(all) {
        return coordinates;
    }
    let (points, _) = coordinates.as_chunks::<3>();
    let mask: Vec<bool> = points.iter().map(|point| all(point)).collect();
    summary.n_dropped = mask.iter().filter(|keep| !**keep).count() as u64;
    let is_finite = |point: &&[T; 3]| point.iter().all(|&number| finite(number));
    let n_finite = points.iter().filter(is_finite).count() as u64;
    summary.n_too_large = n_finite - (points.len() as u64 - summary.n_dropped);
    table.keep(&mask);
    let mut place = 0;
    coordinates.retain(|_| {
        place += 1;
        mask[(place - 1) / 3]
    });
    coordinates
}

/// Points as offsets from an origin.
pub(super) fn placed(origin: DVec3, points: impl Iterator<Item = DVec3>) -> Positions {
    let positions: Vec<Vec3> = points.map(|point| (point - origin).as_vec3()).collect();
    let bounds = Bounds::of_positions(&positions);
    Positions { origin, positions, bounds }
}

/// Whether f32 offsets from `origin` hold all points without loss.
fn is_exact(mut points: impl Iterator<Item = DVec3>, origin: DVec3) -> bool {
    points.all(|point| origin + (point - origin).as_vec3().as_dvec3() == point)
}

/// Distance from zero, in extents of the cloud, up to which positions are relative to zero. At this
/// distance a camera that is rounded to f32 beside the cloud moves by 2^8 * 2^-24 of the extent,
/// which is far below a pixel; farther away it would visibly jump.
const FAR: f64 = 256.0;

/// The middle of points that strays do not move.
pub(super) fn middle(points: &[DVec3]) -> Option<DVec3> {
    let bounds = Bounds::of(points.iter().copied())?;
    Some(bounds.without_strays(points.len(), |i| points[i]).centre())
}

/// The origin: that of the cloud the file was written from where it loses nothing, zero where f32
/// holds the coordinates as they are and the cloud is not far away, else the middle of the bounds
/// without strays. Also the bounds of the points.
fn origin(table: &Table, count: usize, at: impl Fn(usize) -> DVec3) -> (DVec3, Option<Bounds>) {
    let points = || (0..count).map(&at);
    let bounds = Bounds::of(points());
    let noted = table.notes("origin").find_map(|words| {
        let [x, y, z] = words.try_into().ok()?;
        let origin = DVec3::new(x.parse().ok()?, y.parse().ok()?, z.parse().ok()?);
        (origin.is_finite() && is_exact(points(), origin)).then_some(origin)
    });
    if let Some(origin) = noted {
        return (origin, bounds);
    }
    let Some(all) = bounds else { return (DVec3::ZERO, None) };
    let core = all.without_strays(count, &at);
    // Whole numbers are easier to read, and half a unit is little for a cloud of two.
    let centre = core.centre();
    let middle = if core.extent() >= 2.0 { centre.round() } else { centre };
    let is_far = core.extent() > 0.0 && core.reach() > FAR * core.extent();
    let in_core = || points().filter(|point| core.holds(*point));
    let stays = is_exact(points(), DVec3::ZERO) && !(is_far && is_exact(in_core(), middle));
    (if stays { DVec3::ZERO } else { middle }, bounds)
}

/// Share of the median radius by which rounding may move a surfel without a visible step.
const VISIBLE_SHARE: f64 = 0.01;

/// Warns of strays that views of all leave out, and where the cloud without them spans so much that f32 positions are
/// coarse for its surfels.
pub(super) fn warn_if_coarse(placed: &Positions, radii: &[f32], summary: &mut Summary) {
    let Some(all) = placed.bounds else { return };
    let (count, at) = (placed.positions.len(), |i: usize| placed.positions[i].as_dvec3());
    let core = all.without_strays(count, at);
    if core != all {
        let lie = match (0..count).filter(|&i| !core.holds(at(i))).count() {
            1 => "1 point lies".to_owned(),
            n_strays => format!("{n_strays} points lie"),
        };
        summary.warnings.push(format!(
            "{lie} far apart from the others, which are {:.4} units across; views of all leave them out, and the tool \
             `outliers` removes those that stand alone",
            core.diagonal()
        ));
    }
    let reach = core.reach();
    // Distance between neighbouring f32 at the farthest coordinate.
    let step = f64::from((reach as f32).next_up()) - f64::from(reach as f32);
    let is_visible = |radius: f32| step > VISIBLE_SHARE * f64::from(radius);
    // Whether this holds of the median shows without sorting.
    let n_visible: usize = radii.iter().map(|&radius| usize::from(is_visible(radius))).sum();
    let middle = radii.len() / 2;
    if n_visible > middle {
        let mut sorted = radii.to_vec();
        let (_, &mut median, _) = sorted.select_nth_unstable_by(middle, f32::total_cmp);
        summary.warnings.push(format!(
            "the cloud spans too far for single precision: positions at its border are \
             {step:.2e} apart, the median radius is {median:.2e}; split it into parts"
        ));
    }
}
