//! Requests as messages.

use super::fault::Fault;
use surfelshop_api::FrameRequest;
use surfelshop_api::frame::{InMotion, OnDevice};
use surfelshop_api::manifest::ABI_MAJOR;

/// A request for a frame as it is written: one map of all fields.
#[derive(serde::Serialize)]
pub(super) struct FrameCall<'a> {
    #[serde(flatten)]
    request: &'a FrameRequest,
    #[serde(flatten)]
    moves: InMotion,
    #[serde(flatten)]
    on_device: &'a OnDevice,
}

impl<'a> FrameCall<'a> {
    /// A request while one surfel of `stride` is drawn and some bytes are on the device already.
    pub(super) fn new(request: &'a FrameRequest, stride: u32, on_device: &'a OnDevice) -> Self {
        Self { request, moves: InMotion { stride }, on_device }
    }
}

/// Whether a plugin of an older minor version can read a request.
pub(super) fn check_known(minor: u16, request: &FrameRequest) -> Result<(), Fault> {
    let placed = request.scene.lights.iter().filter(|light| light.position().is_some()).count();
    if minor >= 1 || placed == 0 {
        return Ok(());
    }
    Err(Fault::Error(format!(
        "it speaks ABI {ABI_MAJOR}.{minor}, which knows no point lights and spots, of which the \
         scene has {placed}; build it again, or leave them out"
    )))
}

pub(super) fn encode(value: &impl serde::Serialize) -> Result<Vec<u8>, Fault> {
    rmp_serde::to_vec_named(value)
        .map_err(|error| Fault::Error(format!("the request could not be encoded: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::glam::{DVec3, Vec3};
    use surfelshop_api::manifest::ABI_MINOR;
    use surfelshop_api::params::Values;
    use surfelshop_api::{Camera, Light, Projection, Scene, View};

    #[test]
    fn a_plugin_older_than_lights_with_a_place_is_told_so() {
        let projection = Projection::Orthographic { height: 1.0 };
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        let mut request = FrameRequest {
            view: View { camera, size_px: [1; 2], near: 0.1, far: 9.0 },
            scene: Scene::default(),
            cloud: Default::default(),
            frame_index: 0,
            values: Values::new(),
            environment: None,
        };
        assert_eq!(check_known(0, &request), Ok(()));
        request.scene.lights.push(Light::Point { position: DVec3::X, intensity: Vec3::ONE });
        assert_eq!(check_known(ABI_MINOR, &request), Ok(()));
        let line = check_known(0, &request).unwrap_err().to_string();
        let expected = "it speaks ABI 3.0, which knows no point lights and spots, of which the \
                        scene has 1; build it again, or leave them out";
        assert!(line.contains(expected), "{line}");
    }
}
