//! Cameras of animations: a turn around the target, or a path through several cameras.

use glam::{DQuat, DVec3};
use surfelshop_api::{Camera, Projection};

/// Cameras evenly around the target; the last one is a step before the first.
pub(crate) fn turntable(camera: Camera, n_frames: usize) -> Vec<Camera> {
    let up = camera.up.normalize_or(DVec3::Y);
    let turned = |i: usize| {
        let turn = DQuat::from_axis_angle(up, std::f64::consts::TAU * i as f64 / n_frames as f64);
        Camera { eye: camera.target + turn * (camera.eye - camera.target), ..camera }
    };
    (0..n_frames).map(turned).collect()
}

/// Cameras along a smooth curve through the key cameras, which are reached at equal intervals.
///
/// Source: Catmull & Rom 1974, the uniform spline; ends are repeated.
pub(crate) fn path_of(keys: &[Camera], n_frames: usize) -> Vec<Camera> {
    let n_parts = keys.len() - 1;
    let at = |i: isize| &keys[i.clamp(0, n_parts as isize) as usize];
    let frame = |i: usize| {
        let place = n_parts as f64 * i as f64 / (n_frames - 1) as f64;
        let part = (place.floor() as usize).min(n_parts - 1);
        let t = place - part as f64;
        let key = |k: isize| at(part as isize + k);
        let spline = |value: fn(&Camera) -> DVec3| {
            let [a, b, c, d] = [-1, 0, 1, 2].map(|k| value(key(k)));
            let (t2, t3) = (t * t, t * t * t);
            0.5 * (2.0 * b
                + (c - a) * t
                + (2.0 * a - 5.0 * b + 4.0 * c - d) * t2
                + (3.0 * b - a - 3.0 * c + d) * t3)
        };
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let projection = match (key(0).projection, key(1).projection) {
            (Projection::Perspective { fov_y: a }, Projection::Perspective { fov_y: b }) => {
                Projection::Perspective { fov_y: mix(a, b) }
            }
            (Projection::Orthographic { height: a }, Projection::Orthographic { height: b }) => {
                Projection::Orthographic { height: mix(a, b) }
            }
            (projection, _) => projection,
        };
        Camera {
            eye: spline(|camera| camera.eye),
            target: spline(|camera| camera.target),
            up: spline(|camera| camera.up),
            projection,
        }
    };
    (0..n_frames).map(frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(eye: DVec3) -> Camera {
        let projection = Projection::Perspective { fov_y: 0.6 };
        Camera { eye, target: DVec3::new(1.0, 0.0, 0.0), up: DVec3::Y, projection }
    }

    #[test]
    fn a_turn_goes_once_around_and_keeps_its_distance() {
        let around = turntable(camera(DVec3::new(1.0, 2.0, 4.0)), 8);
        assert_eq!(around.len(), 8);
        for pair in around.windows(2) {
            let step = pair[0].eye.distance(pair[1].eye);
            assert!((step - 8.0 * (std::f64::consts::PI / 8.0).sin()).abs() < 1e-9);
            assert!((pair[0].eye.distance(pair[0].target) - 20f64.sqrt()).abs() < 1e-9);
        }
        let half = around[4].eye;
        assert!((half - DVec3::new(1.0, 2.0, -4.0)).length() < 1e-9, "{half}");
    }

    #[test]
    fn a_path_passes_its_cameras_at_equal_intervals() {
        let keys = [DVec3::Z, DVec3::X * 3.0, DVec3::new(2.0, 5.0, 1.0)].map(camera);
        let path = path_of(&keys, 21);
        for (frame, key) in [(0, 0), (10, 1), (20, 2)] {
            assert!((path[frame].eye - keys[key].eye).length() < 1e-12);
        }
        let longest = path.windows(2).map(|pair| pair[0].eye.distance(pair[1].eye));
        assert!(longest.fold(0.0, f64::max) < 1.0);
    }
}
