//! What a surface under a light probe looks like, summed over every texel of the probe in f64: slow
//! and without any of the renderer's approximations.

mod lab;

pub use lab::{Errors, Lab, Pixel, pixels};

use glam::DVec3;
use surfelshop_api::{Environment, EnvironmentView};
use surfelshop_cloud::environment_map::{Picture, Probe, solid_angles};

/// Rows of parts of texels: half a degree each, where a lobe of roughness 0.3 is five wide.
const FEWEST_ROWS: u32 = 360;

/// Light from all the directions that a probe's picture shows.
pub struct NaturalLight {
    /// Directions, probe space, and radiance times solid angle.
    texels: Vec<(DVec3, [f64; 3])>,
}

impl NaturalLight {
    /// The light of a probe's picture, each texel as points in the middle of its parts: so many that
    /// they lie closer than a lobe of roughness 0.3 is wide.
    #[must_use]
    pub fn of(probe: &Probe) -> Self {
        let Picture { width, height, rgb } = &probe.picture;
        let parts = FEWEST_ROWS.div_ceil(*height).max(1);
        let (w, h) = (width * parts, height * parts);
        let angles = solid_angles(probe.mapping, w, h);
        let part = |i: usize| {
            let (x, y) = (i as u32 % w, i as u32 / w);
            let at = |k: u32, n: u32| (f64::from(k) + 0.5) / f64::from(n);
            let towards = probe.mapping.direction(at(x, w), at(y, h))?;
            let texel = rgb[(y / parts * width + x / parts) as usize];
            Some((towards, texel.map(|value| f64::from(value) * angles[i])))
        };
        Self { texels: (0..angles.len()).filter_map(part).collect() }
    }

    /// What a white diffuse surface radiates.
    #[must_use]
    pub fn white_diffuse(&self, normal: DVec3) -> [f64; 3] {
        self.sum(|towards| normal.dot(towards).max(0.0) / std::f64::consts::PI)
    }

    /// What a surface of GGX microfacets reflects once: reflectance `f0` at a right angle, with
    /// Schlick's Fresnel term and masking by Heitz 2014, equation 99.
    #[must_use]
    pub fn ggx(&self, normal: DVec3, to_eye: DVec3, roughness: f64, f0: f64) -> [f64; 3] {
        self.sum(|towards| ggx_times_cosine(normal, to_eye, towards, roughness, f0))
    }

    fn sum(&self, weight: impl Fn(DVec3) -> f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (towards, light) in &self.texels {
            let weight = weight(*towards);
            sum.iter_mut().zip(light).for_each(|(sum, light)| *sum += weight * light);
        }
        sum
    }
}

/// Reflectance per solid angle times the cosine to the light.
#[must_use]
pub fn ggx_times_cosine(
    normal: DVec3,
    to_eye: DVec3,
    towards: DVec3,
    roughness: f64,
    f0: f64,
) -> f64 {
    let (l, v) = (normal.dot(towards), normal.dot(to_eye));
    if l <= 0.0 || v <= 0.0 {
        return 0.0;
    }
    let a2 = roughness.powi(4);
    let half = (towards + to_eye).normalize_or(normal);
    let h = normal.dot(half);
    let d = a2 / (std::f64::consts::PI * (h * h * (a2 - 1.0) + 1.0).powi(2));
    let smith = |cosine: f64| (a2 + (1.0 - a2) * cosine * cosine).sqrt();
    let visible = 0.5 / (l * smith(v) + v * smith(l));
    let fresnel = f0 + (1.0 - f0) * (1.0 - half.dot(to_eye)).powi(5);
    d * visible * fresnel * l
}

/// A probe as it was taken, around a scene.
#[must_use]
pub fn around(probe: &Probe) -> Environment {
    Environment { facts: probe.facts.clone(), probe_from_world: glam::DMat3::IDENTITY, gain: 1.0 }
}

/// An environment and its probe's texels, as an engine takes them.
#[must_use]
pub fn view_of<'a>(environment: &'a Environment, probe: &'a Probe) -> EnvironmentView<'a> {
    EnvironmentView { environment, texels: &probe.texels }
}

/// A lone sun of a radiance over a dark sky, as a picture of latitude and longitude: one texel.
#[must_use]
pub fn lone_sun(radiance: f32) -> Picture {
    let (width, height) = (128, 64);
    let mut rgb = vec![[0.0; 3]; width * height];
    rgb[14 * width + 50] = [radiance; 3];
    Picture { width: width as u32, height: height as u32, rgb }
}
