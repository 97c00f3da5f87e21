//! How the mouse moves a camera.
//!
//! Everything is in world space and f64. Positions in the picture are fractions of its height, y
//! downwards, from its middle.

use glam::{DQuat, DVec2, DVec3};
use surfelshop_api::{Camera, Projection};

/// Orbiting stays this angle away from the poles, radians: at a pole the picture would spin.
const POLE: f64 = 0.01;

/// The vertical field of view where a projection becomes perspective, radians.
pub(crate) const USUAL_FIELD_OF_VIEW: f64 = 35.0 * std::f64::consts::PI / 180.0;

/// The distance to the target, which scales flying and zooming.
fn reach(camera: &Camera) -> f64 {
    camera.eye.distance(camera.target)
}

/// Right, up and backward of the camera in world space.
fn axes(camera: &Camera) -> [DVec3; 3] {
    let world_from_view = camera.view_from_world().transpose();
    [world_from_view.x_axis, world_from_view.y_axis, world_from_view.z_axis]
}

/// The visible height at the target, scene units.
pub(crate) fn height_at_target(camera: &Camera) -> f64 {
    match camera.projection {
        Projection::Orthographic { height } => height,
        Projection::Perspective { fov_y } => 2.0 * reach(camera) * (0.5 * fov_y).tan(),
    }
}

/// The rotation for a drag, by which visible things follow the pointer: about the up direction, then
/// about the camera's right, and never over a pole.
fn turn(camera: &Camera, drag: DVec2) -> DQuat {
    let up = camera.up.normalize_or(DVec3::Y);
    let [right, _, backward] = axes(camera);
    let from_pole = backward.angle_between(up);
    let lowest = POLE - from_pole;
    let highest = std::f64::consts::PI - POLE - from_pole;
    // Dragging downwards shows more of the top: the camera moves towards the up pole.
    let pitch = (-drag.y).max(lowest.min(0.0)).min(highest.max(0.0));
    DQuat::from_axis_angle(up, -drag.x) * DQuat::from_axis_angle(right, pitch)
}

/// Moves the eye around the target; `drag` in radians.
pub(crate) fn orbit(camera: &mut Camera, drag: DVec2) {
    let turn = turn(camera, drag);
    camera.eye = camera.target + turn * (camera.eye - camera.target);
}

/// Moves the eye around the target about the camera's own axes, over the poles, too; `drag` in radians.
pub(crate) fn tumble(camera: &mut Camera, drag: DVec2) {
    let [right, up, _] = axes(camera);
    let turn = DQuat::from_axis_angle(up, -drag.x) * DQuat::from_axis_angle(right, -drag.y);
    camera.eye = camera.target + turn * (camera.eye - camera.target);
    camera.up = turn * up;
}

/// Looks around: moves the target around the eye; `drag` in radians.
pub(crate) fn look(camera: &mut Camera, drag: DVec2) {
    let turn = turn(camera, -drag);
    camera.target = camera.eye + turn * (camera.target - camera.eye);
}

/// Moves the camera sideways, so that things at the target's distance follow the pointer; `drag` in
/// picture heights.
pub(crate) fn pan(camera: &mut Camera, drag: DVec2) {
    let [right, up, _] = axes(camera);
    let offset = (up * drag.y - right * drag.x) * height_at_target(camera);
    camera.eye += offset;
    camera.target += offset;
}

/// Multiplies distances by `factor` (below 1 is nearer); `anchor` keeps its position in the picture.
pub(crate) fn zoom(camera: &mut Camera, factor: f64, anchor: DVec3) {
    if !(factor.is_finite() && factor > 0.0) {
        return;
    }
    match &mut camera.projection {
        Projection::Perspective { .. } => {
            camera.eye = anchor + (camera.eye - anchor) * factor;
            camera.target = anchor + (camera.target - anchor) * factor;
        }
        Projection::Orthographic { height } => {
            *height *= factor;
            let [right, up, _] = axes(camera);
            let away = anchor - camera.target;
            let offset = (right * right.dot(away) + up * up.dot(away)) * (1.0 - factor);
            camera.eye += offset;
            camera.target += offset;
        }
    }
}

/// Moves eye and target along the camera's own axes; `step` is right, up and forward, in distances
/// to the target.
pub(crate) fn fly(camera: &mut Camera, step: DVec3) {
    walk(camera, step * reach(camera));
}

/// The same; `step` is in scene units.
pub(crate) fn walk(camera: &mut Camera, step: DVec3) {
    let [right, up, backward] = axes(camera);
    let offset = right * step.x + up * step.y - backward * step.z;
    camera.eye += offset;
    camera.target += offset;
}

/// The point at a depth along the viewing axis and a position in the picture.
pub(crate) fn point_at(camera: &Camera, position: DVec2, depth: f64) -> DVec3 {
    let [right, up, backward] = axes(camera);
    let height = match camera.projection {
        Projection::Orthographic { height } => height,
        Projection::Perspective { fov_y } => 2.0 * depth * (0.5 * fov_y).tan(),
    };
    camera.eye - backward * depth + (right * position.x - up * position.y) * height
}

/// Changes the projection; things at the target keep their size.
pub(crate) fn toggle_projection(camera: &mut Camera, fov_y: f64) {
    let height = height_at_target(camera);
    match camera.projection {
        Projection::Perspective { .. } => {
            camera.projection = Projection::Orthographic { height };
        }
        Projection::Orthographic { .. } => {
            let distance = 0.5 * height / (0.5 * fov_y).tan();
            camera.eye = camera.target - camera.forward() * distance;
            camera.projection = Projection::Perspective { fov_y };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> Camera {
        let (eye, target) = (DVec3::new(3.0, 2.0, 5.0), DVec3::new(1.0, 0.5, 0.0));
        Camera { eye, target, up: DVec3::Y, projection }
    }

    const BOTH: [Projection; 2] =
        [Projection::Perspective { fov_y: 0.8 }, Projection::Orthographic { height: 3.0 }];

    /// Where a point appears, in picture heights from the middle, y downwards.
    fn on_screen(camera: &Camera, point: DVec3) -> DVec2 {
        let [right, up, backward] = axes(camera);
        let offset = point - camera.eye;
        let depth = -offset.dot(backward);
        let height = match camera.projection {
            Projection::Orthographic { height } => height,
            Projection::Perspective { fov_y } => 2.0 * depth * (0.5 * fov_y).tan(),
        };
        DVec2::new(offset.dot(right), -offset.dot(up)) / height
    }

    #[test]
    fn orbiting_keeps_target_and_distance_and_never_passes_a_pole() {
        for projection in BOTH {
            let mut camera = camera(projection);
            let before = camera;
            for i in 0..200 {
                orbit(&mut camera, DVec2::new(0.1, if i < 100 { 0.1 } else { -0.2 }));
                assert_eq!(camera.target, before.target);
                assert!((reach(&camera) - reach(&before)).abs() < 1e-9);
                let angle = (camera.eye - camera.target).angle_between(DVec3::Y);
                assert!(angle > 0.5 * POLE && angle < std::f64::consts::PI - 0.5 * POLE);
            }
        }
    }

    #[test]
    fn tumbling_passes_the_poles_and_comes_round() {
        for projection in BOTH {
            let mut camera = camera(projection);
            let before = camera;
            let mut below = false;
            for _ in 0..100 {
                tumble(&mut camera, DVec2::new(0.0, std::f64::consts::TAU / 100.0));
                assert!((reach(&camera) - reach(&before)).abs() < 1e-9);
                below |= axes(&camera)[1].dot(DVec3::Y) < -0.5;
            }
            assert!(below, "it went upside down");
            assert!(camera.eye.distance(before.eye) < 1e-9);
            assert!(axes(&camera)[1].distance(axes(&before)[1]) < 1e-9);
        }
    }

    #[test]
    fn what_is_in_front_follows_a_drag() {
        let mut camera = camera(BOTH[0]);
        let front = camera.target + axes(&camera)[2];
        orbit(&mut camera, DVec2::new(0.3, 0.0));
        assert!(on_screen(&camera, front).x > 0.05);
        let front = camera.target + axes(&camera)[2];
        orbit(&mut camera, DVec2::new(0.0, 0.3));
        assert!(on_screen(&camera, front).y > 0.05);
    }

    #[test]
    fn panning_moves_the_target_plane_with_the_pointer() {
        for projection in BOTH {
            let mut camera = camera(projection);
            let point = camera.target;
            pan(&mut camera, DVec2::new(0.2, -0.1));
            let now = on_screen(&camera, point);
            assert!((now - DVec2::new(0.2, -0.1)).length() < 1e-12, "{now}");
        }
    }

    #[test]
    fn zooming_keeps_the_point_under_the_pointer() {
        for projection in BOTH {
            let mut camera = camera(projection);
            let position = DVec2::new(0.3, -0.25);
            let anchor = point_at(&camera, position, 4.0);
            assert!((on_screen(&camera, anchor) - position).length() < 1e-12);
            let height = height_at_target(&camera);
            for factor in [0.5, 1.7, 0.1] {
                zoom(&mut camera, factor, anchor);
                assert!((on_screen(&camera, anchor) - position).length() < 1e-9);
            }
            assert!((height_at_target(&camera) / height - 0.085).abs() < 1e-9);
            let before = camera;
            zoom(&mut camera, 0.0, anchor);
            zoom(&mut camera, f64::NAN, anchor);
            assert_eq!(camera, before);
        }
    }

    #[test]
    fn changing_the_projection_keeps_the_size_of_the_target() {
        let mut camera = camera(BOTH[0]);
        let height = height_at_target(&camera);
        toggle_projection(&mut camera, 0.8);
        assert!((height_at_target(&camera) - height).abs() < 1e-12);
        toggle_projection(&mut camera, 0.8);
        assert!((height_at_target(&camera) - height).abs() < 1e-9);
    }
}
