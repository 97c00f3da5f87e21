//! What arrives of a light in f64, straight from what `Light` says: angles instead of the squared
//! distances that the host and its shaders compute with.

use glam::DVec3;
use surfelshop_api::{Light, View};

/// Unit vector from a place of world space towards a light, zero at the light, and what a white
/// diffuse surface facing the light radiates there, unshadowed. Right outside of the ball that a
/// light with a place is to the host, a ten-thousandth of the scene's largest extent.
#[must_use]
pub fn arriving(light: &Light, view: &View, place: DVec3) -> (DVec3, DVec3) {
    match *light {
        Light::Directional { towards, radiance, follows_camera } => {
            let world_from_view = view.camera.view_from_world().transpose();
            let towards = if follows_camera { world_from_view * towards } else { towards };
            (towards.normalize_or_zero(), radiance.as_dvec3())
        }
        Light::Point { position, intensity } => {
            let offset = position - place;
            (offset.normalize_or_zero(), intensity.as_dvec3() / offset.length_squared())
        }
        Light::Spot { position, target, intensity, angle, softness } => {
            let offset = position - place;
            let from_axis = (-offset).angle_between(target - position);
            let (edge, full) = (angle.cos(), (angle * (1.0 - f64::from(softness))).cos());
            let share = if from_axis >= angle {
                0.0
            } else if from_axis.cos() >= full {
                1.0
            } else {
                let t = (from_axis.cos() - edge) / (full - edge);
                t * t * (3.0 - 2.0 * t)
            };
            let radiance = intensity.as_dvec3() * (share / offset.length_squared());
            (offset.normalize_or_zero(), radiance)
        }
    }
}
