//! A camera on its way to another place.

use glam::{DQuat, DVec3};
use surfelshop_api::{Camera, Projection};

/// How long a move takes.
pub(super) const SECONDS: f64 = 0.3;

/// A move of a pane's camera.
pub(crate) struct Flight {
    pub(super) pane: u32,
    pub(super) from: Camera,
    pub(super) to: Camera,
    /// Where it was put last: elsewhere the user has it.
    pub(super) last: Camera,
    /// The time of the toolkit when it began.
    pub(super) began: Option<f64>,
}

/// A camera on the way, `share` from 0 to 1: it turns about the up direction where both have the same.
pub(super) fn between(from: &Camera, to: &Camera, share: f64) -> Camera {
    // Slow at both ends.
    let share = share * share * (3.0 - 2.0 * share);
    let target = from.target.lerp(to.target, share);
    let reach = between_lengths(from.eye.distance(from.target), to.eye.distance(to.target), share);
    let directions = [from, to].map(|camera| (camera.eye - camera.target).normalize_or(DVec3::Z));
    let up = to.up.normalize_or(DVec3::Y);
    let same_up = from.up.normalize_or(DVec3::Y).distance(up) < 1e-9;
    let direction = match same_up {
        true => turned(directions, up, share),
        false => {
            let whole = DQuat::from_rotation_arc(directions[0], directions[1]);
            DQuat::IDENTITY.slerp(whole, share) * directions[0]
        }
    };
    let up = if same_up { to.up } else { from.up.lerp(to.up, share).try_normalize().unwrap_or(up) };
    let projection = match (from.projection, to.projection) {
        (Projection::Perspective { fov_y: a }, Projection::Perspective { fov_y: b }) => {
            Projection::Perspective { fov_y: a + (b - a) * share }
        }
        (Projection::Orthographic { height: a }, Projection::Orthographic { height: b }) => {
            Projection::Orthographic { height: between_lengths(a, b, share) }
        }
        (_, projection) => projection,
    };
    Camera { eye: target + direction * reach, target, up, projection }
}

fn between_lengths(from: f64, to: f64, share: f64) -> f64 {
    if from > 0.0 && to > 0.0 { from * (to / from).powf(share) } else { to }
}

/// Between two directions, by azimuth about `up` and height, the shorter way round.
fn turned(directions: [DVec3; 2], up: DVec3, share: f64) -> DVec3 {
    let side = up.any_orthonormal_vector();
    let other = up.cross(side);
    let azimuths = directions.map(|d| d.dot(other).atan2(d.dot(side)));
    let heights = directions.map(|d| d.dot(up).clamp(-1.0, 1.0).asin());
    let whole = azimuths[1] - azimuths[0];
    let whole = whole - std::f64::consts::TAU * (whole / std::f64::consts::TAU).round();
    let (azimuth, height) =
        (azimuths[0] + whole * share, heights[0] + (heights[1] - heights[0]) * share);
    let flat = side * azimuth.cos() + other * azimuth.sin();
    flat * height.cos() + up * height.sin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::StandardView;
    use surfelshop_session::options::UpAxis;

    fn camera(eye: DVec3) -> Camera {
        let projection = Projection::Perspective { fov_y: 0.6 };
        Camera { eye, target: DVec3::new(1.0, 2.0, 3.0), up: DVec3::Y, projection }
    }

    #[test]
    fn a_move_begins_and_ends_where_it_should_and_keeps_its_distance() {
        let from = camera(DVec3::new(5.0, 3.0, -4.0));
        for view in StandardView::SIDES {
            let to = view.camera(&from, UpAxis::Y);
            let reach = from.eye.distance(from.target);
            for step in 0..=20 {
                let on_the_way = between(&from, &to, f64::from(step) / 20.0);
                assert!((on_the_way.eye.distance(on_the_way.target) / reach - 1.0).abs() < 1e-9);
                assert!(on_the_way.view_from_world().is_finite());
            }
            assert!(between(&from, &to, 0.0).eye.distance(from.eye) < 1e-9);
            assert!(between(&from, &to, 1.0).eye.distance(to.eye) < 1e-9);
        }
    }

    #[test]
    fn a_move_between_two_up_directions_stays_finite() {
        let from = camera(DVec3::new(5.0, 3.0, -4.0));
        for up in [DVec3::NEG_Y, DVec3::Z, DVec3::ZERO] {
            let eye = 2.0 * from.target - from.eye;
            let to =
                Camera { up, eye, projection: Projection::Orthographic { height: 2.0 }, ..from };
            for step in 0..=20 {
                let on_the_way = between(&from, &to, f64::from(step) / 20.0);
                assert!(on_the_way.eye.is_finite() && on_the_way.up.is_finite());
            }
        }
    }
}
