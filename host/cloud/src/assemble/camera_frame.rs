//! Clouds in the coordinates of a depth camera: x to the right, y down, z ahead, as depth cameras write them. They stand
//! on their heads where nobody knows.

use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::source::{CameraFrame, Source};
use glam::{DVec3, Vec3};
use surfelshop_api::format::Pose;

/// Points that are looked at: few, so that a load that just fits into memory still does.
const LOOKED_AT: usize = 1 << 12;

/// The largest tangent of an angle off the axis: 60 degrees, more than depth cameras see.
const WIDEST: f64 = 1.75;

/// The least width of what is seen, as a tangent: a depth camera sees 0.8 and more, an object before it less. What is far
/// off is narrower, and was not seen from zero.
const NARROWEST: f64 = 0.3;

/// The least ratio of far to near: a depth camera sees what is near and what is behind it.
const DEEPEST: f64 = 1.25;

/// The share of points that may lie anywhere: a camera that was led around a desk saw 0.06 of it beyond its first picture.
const OUTSIDE: f64 = 0.08;

/// Cells across a picture in which points are told that lie behind each other.
const CELLS: usize = 64;

/// Ratio of far to near in a cell above which points lie behind each other, and the share of cells in which they may: a
/// picture of a desk has such cells at edges (0.17 of them, measured), a thing that was seen all around in most (a ball: 0.66).
const BEHIND: f64 = 1.1;
const EDGES: f64 = 0.35;

/// How a cloud lies before a depth camera at zero that looks along z; `None` where the file says which axis is up, where
/// a pose moved the cloud, where it lies otherwise, and without memory to tell. O(1): of large clouds some points are looked at.
#[must_use]
pub fn camera_frame(cloud: &Cloud, source: &Source) -> Option<CameraFrame> {
    before_camera(cloud.origin(), cloud.positions(), source)
}

/// The same of places from an origin.
pub(super) fn before_camera(
    origin: DVec3,
    places: &[Vec3],
    source: &Source,
) -> Option<CameraFrame> {
    let is_elsewhere = source.scans.iter().any(|scan| {
        scan.pose != Pose::default() || scan.scanner.is_some_and(|place| place != DVec3::ZERO)
    });
    if source.said_up().is_some() || is_elsewhere || places.is_empty() {
        return None;
    }
    let step = places.len().div_ceil(LOOKED_AT).max(1);
    let places = places.iter().step_by(step).map(|place| origin + place.as_dvec3());
    let mut seen = room_for(places.len())?;
    seen.extend(places);
    let n = seen.len();
    seen.retain(|place| place.z > 0.0 && place.truncate().abs().max_element() <= WIDEST * place.z);
    if ((n - seen.len()) as f64) > OUTSIDE * n as f64 {
        return None;
    }
    let ends = |of: fn(&DVec3) -> f64| {
        let mut all = room_for(seen.len())?;
        all.extend(seen.iter().map(of));
        all.sort_unstable_by(f64::total_cmp);
        let end = |share: f64| all.get((share * (all.len() - 1) as f64) as usize).copied();
        end(0.02).zip(end(0.98))
    };
    let (near, far) = ends(|place| place.z)?;
    let across = ends(|place| place.x / place.z)?;
    let along = ends(|place| place.y / place.z)?;
    if far < DEEPEST * near || (across.1 - across.0).max(along.1 - along.0) < NARROWEST {
        return None;
    }
    // Rows of an organised cloud say it where the camera was turned on its side.
    let of_rows = source.grid_up.map(Axis::nearest).filter(|axis| axis.index() != 2);
    let up = of_rows.unwrap_or(Axis::MinusY);
    let is_one_view = source.grid.is_some() || is_one_view(&seen, [across, along])?;
    Some(CameraFrame { up, is_one_view })
}

/// Whether next to no points lie behind others, as seen from zero.
fn is_one_view(seen: &[DVec3], spans: [(f64, f64); 2]) -> Option<bool> {
    let mut cells = room_for(CELLS * CELLS)?;
    cells.resize(CELLS * CELLS, (f64::INFINITY, 0.0_f64, 0_u32));
    let cell = |value: f64, (low, high): (f64, f64)| {
        let along = (value - low) / (high - low).max(f64::MIN_POSITIVE) * CELLS as f64;
        (along.max(0.0) as usize).min(CELLS - 1)
    };
    for place in seen {
        let [x, y] = [cell(place.x / place.z, spans[0]), cell(place.y / place.z, spans[1])];
        let (near, far, n) = &mut cells[y * CELLS + x];
        (*near, *far, *n) = (near.min(place.z), far.max(place.z), *n + 1);
    }
    let several = cells.iter().filter(|(_, _, n)| *n > 1);
    let behind = several.clone().filter(|(near, far, _)| *far > BEHIND * near).count();
    Some(behind as f64 <= EDGES * several.count() as f64)
}

/// Memory for so many; without it nothing is told.
fn room_for<T>(n: usize) -> Option<Vec<T>> {
    let mut room = Vec::new();
    room.try_reserve_exact(n).ok()?;
    Some(room)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::buffer::Buffer;
    use crate::cloud::column::Column;
    use crate::cloud::source::Scan;
    use surfelshop_api::format::UpAxis;

    /// A floor and a wall as a depth camera at zero has them: y points down.
    fn room() -> Vec<DVec3> {
        let grid = |i: i32| (f64::from(i % 40) - 20.0, f64::from(i / 40));
        let floor = (0..1600).map(grid).map(|(x, y)| DVec3::new(x * 0.05, 1.0, 1.2 + 0.05 * y));
        let wall = (0..1600).map(grid).map(|(x, y)| DVec3::new(x * 0.1, 1.0 - 0.05 * y, 3.2));
        floor.chain(wall).collect()
    }

    fn guess(places: impl IntoIterator<Item = DVec3>, source: &Source) -> Option<Axis> {
        frame(places, source).map(|frame| frame.up)
    }

    fn frame(places: impl IntoIterator<Item = DVec3>, source: &Source) -> Option<CameraFrame> {
        let places = places.into_iter().flat_map(|place| place.as_vec3().to_array());
        let places: Vec<f32> = places.collect();
        let n = places.len() / 3;
        let columns = vec![
            Column::new("position", 3, Buffer::F32(places)),
            Column::new("normal", 3, Buffer::F32([0.0, 0.0, 1.0].repeat(n))),
            Column::new("radius", 1, Buffer::F32(vec![0.05; n])),
        ];
        camera_frame(&Cloud::new(DVec3::ZERO, columns).unwrap(), source)
    }

    #[test]
    fn what_a_depth_camera_took_has_minus_y_upwards_and_nothing_else_has() {
        let nothing_said = Source::default();
        assert_eq!(guess(room(), &nothing_said), Some(Axis::MinusY));
        let strays = [DVec3::NEG_Z; 200];
        assert_eq!(guess(room().into_iter().chain(strays), &nothing_said), Some(Axis::MinusY));
        // Around zero, behind the camera, flat and far off, narrow and far off.
        assert_eq!(guess(room().into_iter().map(|p| p - DVec3::Z * 2.0), &nothing_said), None);
        assert_eq!(guess(room().into_iter().map(|p| -p), &nothing_said), None);
        let land = |p: DVec3| DVec3::new(p.x * 50.0, p.z * 30.0, 400.0 + p.y * 10.0);
        assert_eq!(guess(room().into_iter().map(land), &nothing_said), None);
        assert_eq!(guess(room().into_iter().map(|p| p + DVec3::Z * 40.0), &nothing_said), None);
        assert_eq!(guess([], &nothing_said), None);
    }

    #[test]
    fn a_thing_that_was_seen_all_around_is_no_picture_of_one_camera() {
        let nothing_said = Source::default();
        assert!(frame(room(), &nothing_said).unwrap().is_one_view);
        // A ball before the camera, its far side too.
        let ball = (0..8000).map(|i| {
            let (z, turn) = (f64::from(i) / 4000.0 - 1.0, f64::from(i) * 2.399_963);
            let [x, y] = [turn.cos(), turn.sin()].map(|along| along * (1.0 - z * z).sqrt());
            DVec3::new(x, y, 2.5 + z)
        });
        assert!(!frame(ball, &nothing_said).unwrap().is_one_view);
    }

    #[test]
    fn files_that_say_how_they_stand_are_left_and_rows_say_more() {
        let said = Source { up: UpAxis::Z, ..Source::default() };
        assert_eq!(guess(room(), &said), None);
        let pose = Pose { translation: DVec3::X, ..Pose::default() };
        let scan = Scan { name: String::new(), pose, scanner: None };
        assert_eq!(guess(room(), &Source { scans: vec![scan], ..Source::default() }), None);
        for (rows, expected) in [(DVec3::X, Axis::PlusX), (DVec3::Z, Axis::MinusY)] {
            let source = Source { grid_up: Some(rows), ..Source::default() };
            assert_eq!(guess(room(), &source), Some(expected));
        }
    }
}
