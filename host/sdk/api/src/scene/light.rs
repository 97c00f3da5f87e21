//! The lights of a scene, and what of them arrives where.

use crate::scene::camera::View;
use crate::scene::cloud_facts::CloudFacts;
use crate::scene::object::ObjectFrame;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A light of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// Light from infinitely far away.
    Directional {
        /// Direction towards the light, need not be unit length; in world space, or in view
        /// space where `follows_camera` is set.
        towards: DVec3,
        /// Irradiance on a surface facing the light divided by pi, linear Rec. 709: a white
        /// diffuse surface facing the light has this radiance.
        radiance: Vec3,
        /// Whether `towards` turns with the camera (a headlight).
        follows_camera: bool,
    },
    /// Light from one place, alike in all directions. ABI 3.1.
    Point {
        /// Where it is: world space, scene units. One that is not finite gives no light.
        position: DVec3,
        /// Radiant intensity divided by pi, in scene units squared, linear Rec. 709, each 0 or
        /// more: a white diffuse surface facing the light at a distance d has the radiance
        /// `intensity / d^2`, as one facing a directional light has its `radiance`. What is no number
        /// or below 0 counts as 0. Nearer than a ten-thousandth of the scene's largest extent a light
        /// gets no brighter, and intensity beyond 1e22 times that extent's square does not count: both
        /// keep radiance finite.
        intensity: Vec3,
    },
    /// Light from one place within a cone. ABI 3.1.
    Spot {
        /// Where it is: world space, scene units. One that is not finite gives no light.
        position: DVec3,
        /// A point on the cone's axis: world space, scene units; where it is `position` itself or
        /// not finite, the light shines along -y.
        target: DVec3,
        /// As of [`Light::Point`], on the axis.
        intensity: Vec3,
        /// Between the axis and the cone's edge: radians, from 0 (no light) to pi (all around);
        /// beyond them it counts as the nearer of both, and as 0 where it is no number.
        angle: f64,
        /// Share of `angle`, from the edge inwards, over which the light rises from 0 to its
        /// `intensity`: from 0 (a sharp edge) to 1 (up to the axis). It rises as the smooth step
        /// `t^2 (3 - 2 t)` of the cosine of the angle to the axis. Beyond 0 to 1 it counts as the
        /// nearer of both, and as 0 where it is no number.
        softness: f32,
    },
}

impl Light {
    /// Where it is, for lights that are somewhere: world space, scene units.
    #[must_use]
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Directional { .. } => None,
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
        }
    }

    /// Whether it turns with the camera: there to see by, and left out in natural light.
    #[must_use]
    pub fn follows_camera(&self) -> bool {
        matches!(self, Self::Directional { follows_camera: true, .. })
    }
}

/// What of a light arrives at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// Unit vector towards the light, world space; zero at the light's own place.
    pub towards: DVec3,
    /// What a white diffuse surface facing the light radiates there, linear Rec. 709, unshadowed;
    /// finite.
    pub radiance: DVec3,
    /// How far away the light begins, scene units: what lies farther casts no shadow. Infinite for
    /// directional lights.
    pub distance: f64,
}

/// A light in the numbers that it is computed with: directions of unit length, every number finite
/// and in its range whatever the [`Light`] says. The host makes the WGSL module
/// `surfelshop::light` of it, and renderers that compute on the CPU ask it for
/// [`arriving`](Self::arriving).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Where it is, world space, scene units; `None` where it is infinitely far away.
    pub position: Option<DVec3>,
    /// Unit, world space: towards the light; of a spot, against the direction that it shines in.
    pub towards: DVec3,
    /// Radiance of a directional light, intensity of one that is somewhere.
    pub intensity: DVec3,
    /// The light is a ball of this radius: what is nearer is lit as at this distance, and nothing
    /// within casts a shadow. Scene units, above 0.
    pub nearest: f64,
    /// Twice one minus the cosine of the angle between axis and edge, which small angles leave
    /// precise; beyond 4 where there is no edge.
    pub edge: f64,
    /// One over how much of that lies between the edge and full light.
    pub sharpness: f64,
}

/// A light's own radius, as a share of the scene's largest extent: there the square of the distance
/// would go on to infinity, which no lamp's light does. A ten-thousandth is smaller than the surfels
/// of most clouds, so that it does not show, and a thousand times what f32 resolves.
const NEAREST: f64 = 1e-4;

/// Radiance at that distance is at most this: products with materials and sums over lights stay
/// below the end of f32, 3.4e38.
const BRIGHTEST: f64 = 1e30;

/// Sharper edges than this are steps in f32.
const SHARPEST: f64 = 1e30;

/// A number from 0 to a largest one; what is no number counts as 0.
fn at_most(most: f64, number: f64) -> f64 {
    if number.is_nan() { 0.0 } else { number.clamp(0.0, most) }
}

impl Lamp {
    /// A light of the scene, seen by a camera.
    #[must_use]
    pub fn new(light: &Light, view: &View, facts: &CloudFacts) -> Self {
        let extent = facts.objects.iter().map(|object| object.size).fold(0.0, f64::max);
        let extent = ObjectFrame::around(facts.bounds_min, facts.bounds_max, extent).size;
        let lamp = Self {
            position: light.position(),
            towards: DVec3::Y,
            intensity: DVec3::ZERO,
            nearest: NEAREST * extent,
            edge: 5.0,
            sharpness: 1.0,
        };
        match *light {
            Light::Directional { towards, radiance, follows_camera } => {
                let world_from_view = view.camera.view_from_world().transpose();
                let world = if follows_camera { world_from_view * towards } else { towards };
                let towards = world.try_normalize().unwrap_or(DVec3::Y);
                Self { towards, intensity: radiance.as_dvec3(), ..lamp }
            }
            Light::Point { intensity, .. } => lamp.shining(intensity),
            Light::Spot { position, target, intensity, angle, softness } => {
                let towards = (position - target).try_normalize().unwrap_or(DVec3::Y);
                let angle = at_most(std::f64::consts::PI, angle);
                let full = angle * (1.0 - at_most(1.0, f64::from(softness)));
                let chord = |angle: f64| 4.0 * (0.5 * angle).sin().powi(2);
                if full >= std::f64::consts::PI {
                    return lamp.shining(intensity);
                }
                let edge = chord(angle);
                let sharpness = (1.0 / (edge - chord(full))).min(SHARPEST);
                Self { towards, edge, sharpness, ..lamp }.shining(intensity)
            }
        }
    }

    /// The same with an intensity that leaves everything finite.
    fn shining(self, intensity: Vec3) -> Self {
        let Some(position) = self.position.filter(|position| position.is_finite()) else {
            return Self { position: Some(DVec3::ZERO), intensity: DVec3::ZERO, ..self };
        };
        let channels = intensity.as_dvec3().to_array();
        let intensity = DVec3::from(channels.map(|channel| at_most(f64::from(f32::MAX), channel)));
        let most = BRIGHTEST * self.nearest * self.nearest;
        let kept = (most / intensity.max_element().max(f64::MIN_POSITIVE)).min(1.0);
        Self { position: Some(position), intensity: intensity * kept, ..self }
    }

    /// What of the light arrives at a place of world space, unshadowed. Twin of `arriving` of
    /// `surfelshop::light`.
    #[must_use]
    pub fn arriving(&self, place: DVec3) -> Arriving {
        let Some(position) = self.position else {
            let (towards, radiance) = (self.towards, self.intensity);
            return Arriving { towards, radiance, distance: f64::INFINITY };
        };
        let offset = position - place;
        let distance = offset.length();
        let towards = offset.try_normalize().unwrap_or(DVec3::ZERO);
        let chord = (towards - self.towards).length_squared();
        let t = ((self.edge - chord) * self.sharpness).clamp(0.0, 1.0);
        let share = t * t * (3.0 - 2.0 * t) / distance.max(self.nearest).powi(2);
        // A place beyond all numbers is dark.
        let share = if share.is_finite() { share } else { 0.0 };
        Arriving {
            towards,
            radiance: self.intensity * share,
            distance: (distance - self.nearest).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests;
