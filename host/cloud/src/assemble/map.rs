//! Clouds in the coordinates of a map: east, north and height. They lie on their sides where nobody knows.

use crate::cloud::Cloud;
use crate::cloud::source::Source;
use glam::{DVec3, Vec3};

/// East and north are counted from the borders of zones, hundreds of kilometres away, in metres or feet; less than this
/// far in both a cloud may be anything.
const LEAST: f64 = 1e4;

/// So many times as far as the cloud is wide it lies from zero in both.
const FAR: f64 = 5.0;

/// No place on Earth is higher, metres; in feet next to none.
const HIGHEST: f64 = 9000.0;

/// Points that are looked at.
const LOOKED_AT: usize = 1 << 12;

/// The share of points at either end of an axis that may lie anywhere.
const OUTSIDE: f64 = 0.02;

/// Whether x and y are places on a map and z is a height above it, where the file does not say which axis is up. O(1):
/// of large clouds some points are looked at. `false` without memory to tell.
#[must_use]
pub fn lies_on_map(cloud: &Cloud, source: &Source) -> bool {
    is_on_map(cloud.origin(), cloud.positions(), source)
}

/// The same of places from an origin.
pub(super) fn is_on_map(origin: DVec3, places: &[Vec3], source: &Source) -> bool {
    if source.said_up().is_some() {
        return false;
    }
    let step = places.len().div_ceil(LOOKED_AT).max(1);
    let ends = |axis: usize| {
        let mut all: Vec<f64> = Vec::new();
        all.try_reserve(places.len().div_ceil(step)).ok()?;
        all.extend(places.iter().step_by(step).map(|place| origin[axis] + f64::from(place[axis])));
        all.sort_unstable_by(f64::total_cmp);
        let end =
            |share: f64| all.get((share * all.len().saturating_sub(1) as f64) as usize).copied();
        end(OUTSIDE)
            .zip(end(1.0 - OUTSIDE))
            .filter(|(low, high)| low.is_finite() && high.is_finite())
    };
    let (Some(x), Some(y), Some(z)) = (ends(0), ends(1), ends(2)) else { return false };
    let width = [x, y, z].iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    let is_far = |(low, high): (f64, f64)| {
        // From zero to the nearer side; 0 or less where zero lies between them.
        let off = low.max(-high);
        off >= LEAST && off >= FAR * width
    };
    is_far(x) && is_far(y) && z.0 >= -HIGHEST && z.1 <= HIGHEST
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::format::UpAxis;

    fn told(origin: [f64; 3], size: f32, source: &Source) -> bool {
        let share = |i: usize, n: usize| (i % n) as f32 / n as f32;
        let place = |i| Vec3::new(share(i, 71), share(i, 67), 0.05 * share(i, 7)) * size;
        let places: Vec<Vec3> = (0..5000).map(place).collect();
        is_on_map(DVec3::from(origin), &places, source)
    }

    /// Invariant: clouds in coordinates of a map stand upright, by where they lie, unless the file says how they stand
    #[test]
    fn coordinates_of_maps_are_told_by_where_they_lie() {
        let silent = Source::default();
        for origin in [
            [596_648.0, 243_620.0, 73.5],
            [493_995.0, 4_877_429.0, 124.0],
            [-1.2e6, 636_002.0, -3.0],
        ] {
            assert!(told(origin, 100.0, &silent), "{origin:?}");
            let says = Source { up: UpAxis::Y, ..Source::default() };
            assert!(!told(origin, 100.0, &says), "what the file says counts");
        }
        assert!(told([400_000.0, 400_000.0, 0.0], 70_000.0, &silent));
        for (what, origin, size) in [
            ("at zero", [0.0; 3], 1.0),
            ("around zero", [-5e5, -5e5, 0.0], 1e6),
            ("near zero", [9_000.0, -9_000.0, 0.0], 10.0),
            ("away along x", [500_000.0, 3.0, 0.0], 10.0),
            ("away along y", [3.0, 500_000.0, 0.0], 10.0),
            ("too high", [500_000.0, 400_000.0, 9_001.0], 10.0),
            ("too low", [500_000.0, 400_000.0, -9_100.0], 10.0),
            ("as wide as away", [400_000.0, 400_000.0, 0.0], 90_000.0),
            ("without a number", [f64::NAN; 3], 1.0),
        ] {
            assert!(!told(origin, size, &silent), "{what}");
        }
        assert!(!is_on_map(DVec3::splat(1e6), &[], &silent));
    }

    #[test]
    fn stray_points_do_not_count() {
        let origin = DVec3::new(596_648.0, 243_620.0, 73.5);
        let strays = [-origin.as_vec3(), Vec3::new(0.0, 0.0, 3e4)];
        let places: Vec<Vec3> =
            (0..3000).map(|i| if i % 100 == 7 { strays[i / 100 % 2] } else { Vec3::ONE }).collect();
        assert!(is_on_map(origin, &places, &Source::default()));
    }
}
