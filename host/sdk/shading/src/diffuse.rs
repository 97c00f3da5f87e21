//! Diffuse light of an environment map: radiance of a white surface as polynomials of its normal.

use surfelshop_api::glam::{DVec3, Vec4};
use surfelshop_api::{EnvironmentFacts, Uniform};
use surfelshop_geometry::harmonics::{
    Coefficients, MAX_COEFFICIENTS, of_diffuse_surface, windows_against_ringing,
};

/// What the coefficients depend on beside the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HarmonicsOptions {
    pub(crate) order: usize,
    /// Whether a dominant small light is taken out and treated as one.
    pub(crate) sun: bool,
    /// Whether ringing below zero is damped away.
    pub(crate) window: bool,
}

/// Light on a white diffuse surface.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Diffuse {
    /// Harmonics of its radiance by normal.
    pub(crate) surface: Coefficients,
    /// Direction and radiance of the small light.
    pub(crate) sun: Option<(DVec3, [f64; 3])>,
}

impl Diffuse {
    pub(crate) fn new(facts: &EnvironmentFacts, choice: HarmonicsOptions) -> Self {
        let sun = facts.sun.filter(|_| choice.sun);
        let light = coefficients(match sun {
            Some(_) => &facts.harmonics_without_sun,
            None => &facts.harmonics,
        });
        let windows = match choice.window {
            true => windows_against_ringing(&light, choice.order),
            false => Default::default(),
        };
        Self {
            surface: of_diffuse_surface(&light, choice.order, windows),
            sun: sun.map(|sun| (sun.towards, sun.radiance)),
        }
    }

    /// The bytes of the shader's `Diffuse`, scaled by a gain.
    pub(crate) fn uniform(&self, gain: f64) -> Uniform {
        let c = |i: usize, channel: usize| self.surface[i][channel] * gain;
        let v = |x: f64, y: f64, z: f64, w: f64| Vec4::new(x as f32, y as f32, z as f32, w as f32);
        let linear = |k: usize| {
            let constant = 0.282_094_791_8 * c(0, k) - 0.315_391_565_3 * c(6, k);
            let first = 0.488_602_511_9;
            v(first * c(3, k), first * c(1, k), first * c(2, k), constant)
        };
        let quadratic = |k: usize| {
            let (mixed, zonal) = (1.092_548_430_6, 3.0 * 0.315_391_565_3);
            v(mixed * c(4, k), mixed * c(5, k), zonal * c(6, k), mixed * c(7, k))
        };
        let rgb =
            |i: usize, factor: f64| v(factor * c(i, 0), factor * c(i, 1), factor * c(i, 2), 0.0);
        let low = [linear(0), linear(1), linear(2), quadratic(0), quadratic(1), quadratic(2)];
        let band_4: Vec<Vec4> = (16..25).map(|i| rgb(i, 1.0)).collect();
        let (towards, radiance) = self.sun.unwrap_or((DVec3::Y, [0.0; 3]));
        Uniform::new()
            .vec4_array(&low)
            .vec4(rgb(8, 0.546_274_215_3))
            .vec4_array(&band_4)
            .vec4(v(towards.x, towards.y, towards.z, 0.0))
            .vec4(v(radiance[0] * gain, radiance[1] * gain, radiance[2] * gain, 0.0))
    }
}

/// Coefficients as they came; missing ones are 0.
fn coefficients(given: &[[f64; 3]]) -> Coefficients {
    let mut all = [[0.0; 3]; MAX_COEFFICIENTS];
    all.iter_mut().zip(given).for_each(|(to, from)| *to = *from);
    all
}
