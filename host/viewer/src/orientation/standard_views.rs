//! Views from the sides of the scene.

use glam::DVec3;
use surfelshop_api::Camera;
use surfelshop_session::options::UpAxis;

/// Views along the up axis stay this far off it, radians: at a pole nothing would point up in the picture. Of a scene
/// as large as the picture it moves nothing by a pixel.
const OFF_POLE: f64 = 1e-4;

/// A side of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StandardView {
    Front,
    Back,
    Right,
    Left,
    Top,
    Bottom,
    ThreeQuarter,
}

impl StandardView {
    /// All that look along an axis.
    pub(super) const SIDES: [Self; 6] =
        [Self::Front, Self::Back, Self::Right, Self::Left, Self::Top, Self::Bottom];

    /// From the scene to the camera, unit length.
    pub(super) fn towards_camera(self, up: UpAxis) -> DVec3 {
        let direction = match self {
            Self::Front => DVec3::Z,
            Self::Back => DVec3::NEG_Z,
            Self::Right => DVec3::X,
            Self::Left => DVec3::NEG_X,
            Self::Top => DVec3::new(0.0, 1.0, OFF_POLE),
            Self::Bottom => DVec3::new(0.0, -1.0, OFF_POLE),
            Self::ThreeQuarter => DVec3::new(0.47, 0.342, 0.814),
        };
        up.axis().from_y_up(direction).normalize_or(DVec3::Z)
    }

    /// The name of the side.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Right => "right",
            Self::Left => "left",
            Self::Top => "top",
            Self::Bottom => "below",
            Self::ThreeQuarter => "three-quarter",
        }
    }

    /// The camera on this side, at the same distance from what the former looks at.
    pub(super) fn camera(self, former: &Camera, up: UpAxis) -> Camera {
        let reach = former.eye.distance(former.target);
        let eye = former.target + self.towards_camera(up) * reach;
        Camera { eye, up: up.axis().direction(), ..*former }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::Projection;
    use surfelshop_cloud::scene::Axis;

    #[test]
    fn sides_are_those_of_the_command_line() {
        use surfelshop_session::options::LensArguments;
        use surfelshop_session::options::camera::{self, CameraSpec, Extent};
        let former = Camera {
            eye: DVec3::new(5.0, 6.0, 7.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Orthographic { height: 3.0 },
        };
        for up in Axis::ALL.map(UpAxis::from) {
            for view in StandardView::SIDES.into_iter().chain([StandardView::ThreeQuarter]) {
                let name = if view == StandardView::Bottom { "bottom" } else { view.name() };
                let camera = CameraSpec::parse(name).unwrap();
                let lens = LensArguments { camera, up, fov: None, orthographic: true, zoom: 1.0 };
                let expected = camera::view(&lens, &Extent::new(DVec3::ZERO, 1.0), [64, 64]).camera;
                let found = view.camera(&former, up);
                let apart = found.forward().distance(expected.forward());
                assert!(apart < 2.0 * OFF_POLE, "{view:?}: {apart}");
                // What is right in one picture is right in the other.
                let [a, b] = [found, expected].map(|camera| camera.view_from_world().transpose());
                assert!(a.x_axis.distance(b.x_axis) < 1e-3, "{view:?}: {a} {b}");
                assert!((found.eye.length() - former.eye.length()).abs() < 1e-9);
                assert_eq!(found.projection, former.projection);
            }
        }
    }
}
