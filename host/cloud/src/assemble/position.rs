//! Coordinates: dropping what is not finite, and the choice of the origin.

use crate::buffer::Buffer;
use crate::error::ReadFault;
use crate::summary::Summary;
use crate::table::Table;
use glam::{DVec3, Vec3};
use surfelshop_geometry::Bounds;

pub(super) struct Placed {
    pub(super) origin: DVec3,
    pub(super) positions: Vec<Vec3>,
}

/// Coordinates beyond this are dropped like infinite ones: a quarter of f32's range, so that
/// differences and diagonals of what is kept are finite in f32.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 4.0;

/// Takes the coordinates out of the table and drops rows whose coordinates are not finite.
pub(super) fn take(table: &mut Table, summary: &mut Summary) -> Result<Placed, ReadFault> {
    let coordinates = table.take(["x", "y", "z"]).ok_or_else(|| ReadFault::NoCoordinates {
        element: table.element.clone(),
        found: crate::error::listed(table.columns.iter().map(|(name, _)| name.as_str())),
    })?;
    let mut points = points(&coordinates);
    drop(coordinates);
    let usable = |point: &DVec3| point.is_finite() && point.abs().max_element() <= MAX_COORDINATE;
    if !points.iter().all(usable) {
        let mask: Vec<bool> = points.iter().map(usable).collect();
        summary.n_dropped = mask.iter().filter(|keep| !**keep).count() as u64;
        points.retain(usable);
        table.keep(&mask);
    }
    let origin = origin(table, &points);
    let positions = points.iter().map(|&point| (point - origin).as_vec3()).collect();
    Ok(Placed { origin, positions })
}

fn points(coordinates: &[Buffer; 3]) -> Vec<DVec3> {
    let [x, y, z] = coordinates.each_ref().map(Buffer::iter_f64);
    x.zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z)).collect()
}

/// Whether f32 offsets from `origin` hold all points without loss.
fn is_exact(points: &[DVec3], origin: DVec3) -> bool {
    points.iter().all(|&point| origin + (point - origin).as_vec3().as_dvec3() == point)
}

/// Distance from zero, in extents of the cloud, up to which positions are relative to zero. At this
/// distance a camera that is rounded to f32 beside the cloud moves by 2^8 * 2^-24 of the extent,
/// which is far below a pixel; farther away it would visibly jump.
const FAR: f64 = 256.0;

/// The origin: that of the cloud the file was written from where it loses nothing, zero where f32
/// holds the coordinates as they are and the cloud is not far away, else the middle of the bounds.
fn origin(table: &Table, points: &[DVec3]) -> DVec3 {
    let noted = table.notes("origin").find_map(|words| {
        let [x, y, z] = words.try_into().ok()?;
        let origin = DVec3::new(x.parse().ok()?, y.parse().ok()?, z.parse().ok()?);
        (origin.is_finite() && is_exact(points, origin)).then_some(origin)
    });
    if let Some(origin) = noted {
        return origin;
    }
    let Some(bounds) = Bounds::of(points.iter().copied()) else { return DVec3::ZERO };
    // Whole numbers are easier to read, and half a unit is little for a cloud of two.
    let centre = bounds.centre();
    let middle = if bounds.extent() >= 2.0 { centre.round() } else { centre };
    let is_far = bounds.extent() > 0.0 && bounds.reach() > FAR * bounds.extent();
    if is_exact(points, DVec3::ZERO) && !(is_far && is_exact(points, middle)) {
        return DVec3::ZERO;
    }
    middle
}

/// Share of the median radius by which rounding may move a surfel without a visible step.
const VISIBLE_SHARE: f64 = 0.01;

/// Warns where the cloud spans so much that f32 positions are coarse for its surfels.
pub(super) fn warn_if_coarse(positions: &[Vec3], radii: &[f32], summary: &mut Summary) {
    let reach = Bounds::of_positions(positions).map_or(0.0, |bounds| bounds.reach());
    let mut sorted = radii.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return;
    }
    let (_, &mut median, _) = sorted.select_nth_unstable_by(middle, f32::total_cmp);
    // Distance between neighbouring f32 at the farthest coordinate.
    let step = f64::from((reach as f32).next_up()) - f64::from(reach as f32);
    if step > VISIBLE_SHARE * f64::from(median) {
        summary.warnings.push(format!(
            "the cloud spans too far for single precision: positions at its border are \
             {step:.2e} apart, the median radius is {median:.2e}; split it into parts"
        ));
    }
}
