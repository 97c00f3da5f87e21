//! Where points and lines of the scene are in a picture.
//!
//! Positions in the picture are fractions of its height, y downwards, from its middle.

use glam::{DVec2, DVec3};
use surfelshop_api::{Camera, Projection};

/// A line is clipped nearer than this fraction of its farther end's distance.
const NEAREST: f64 = 1e-3;

/// A projected point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenPoint {
    /// Where it is in the picture.
    pub position: DVec2,
    /// Distance along the viewing axis, scene units.
    pub depth: f64,
}

/// Projects a point, also beyond the picture's edges; `None` behind the camera.
pub fn project(camera: &Camera, place: DVec3) -> Option<ScreenPoint> {
    let offset = camera.view_from_world() * (place - camera.eye);
    let depth = -offset.z;
    let height = match camera.projection {
        Projection::Orthographic { height } => height,
        Projection::Perspective { fov_y } => 2.0 * depth * (0.5 * fov_y).tan(),
    };
    let position = DVec2::new(offset.x, -offset.y) / height;
    (depth > 0.0 && position.is_finite()).then_some(ScreenPoint { position, depth })
}

/// Projects the ends of a line, without its part behind the camera.
pub fn project_line(camera: &Camera, ends: [DVec3; 2]) -> Option<[DVec2; 2]> {
    let depth = |place: DVec3| (place - camera.eye).dot(camera.forward());
    let depths = ends.map(depth);
    let nearest = NEAREST * depths[0].max(depths[1]);
    let cut = |i: usize| {
        let (this, other) = (depths[i], depths[1 - i]);
        let share = ((nearest - this) / (other - this)).clamp(0.0, 1.0);
        if this < nearest { ends[i].lerp(ends[1 - i], share) } else { ends[i] }
    };
    Some([project(camera, cut(0))?.position, project(camera, cut(1))?.position])
}
