pub(crate) mod camera;
pub(crate) mod cloud_facts;
pub(crate) mod environment;
pub(crate) mod light;
pub(crate) mod object;
pub(crate) mod occlusion;
pub(crate) mod phong;

use crate::scene::light::Light;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// How surfels become a surface; a setting of the scene, so that renderers are compared fairly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SurfaceSettings {
    /// Surfels whose distance along the view ray exceeds the nearest one's by at most this many
    /// of their own radii are blended with it. Units of the surfel's radius, from 0 to 16.
    ///
    /// One radius covers neighbours on a smooth surface down to grazing views: with spacing h,
    /// radius 1.5 h and curvature k their discs are k r^2 / (2 cos) apart, below r while
    /// cos > k r / 2.
    pub depth_tolerance: f32,
    /// Whether surfels seen from behind are drawn, with their normal turned to the eye.
    pub two_sided: bool,
    /// Factor on every surfel's radius, above 0.
    pub radius_scale: f32,
    /// Radius of the screen-space low-pass in pixels, from 0 (none) to 4: surfels are widened on
    /// the screen by a Gaussian that ends there, so that those below a pixel neither vanish nor
    /// alias. No pixel further than this from a surfel is covered.
    pub low_pass: f32,
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        Self { depth_tolerance: 1.0, two_sided: true, radius_scale: 1.0, low_pass: 1.0 }
    }
}

/// What belongs to the scene and not to any renderer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// The lights, at most [`Scene::MAX_LIGHTS`] reach shaders.
    pub lights: Vec<Light>,
    /// Factor on radiance before tone mapping, in stops (powers of two). The host applies it.
    pub exposure_stops: f32,
    /// How surfels become a surface.
    pub surface: SurfaceSettings,
}

impl Scene {
    /// How many lights the shader module `surfelshop::light` holds.
    pub const MAX_LIGHTS: usize = 8;
}

impl Default for Scene {
    /// One white headlight, up and to the left of the camera.
    fn default() -> Self {
        Self {
            lights: vec![Light::Directional {
                towards: DVec3::new(-0.4, 0.55, 0.75),
                radiance: Vec3::ONE,
                follows_camera: true,
            }],
            exposure_stops: 0.0,
            surface: SurfaceSettings::default(),
        }
    }
}
