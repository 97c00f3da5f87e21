//! Probes that need no file.

use super::facts::luminance;
use super::texels::TexelMap;
use super::{Mapping, Picture, Probe};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Texels of a built-in along a row; half of it are rows.
const WIDTH: u32 = 512;

impl Probe {
    /// A room for pictures of products: three soft boxes before dim walls, all neutral, of mean
    /// radiance 0.5.
    ///
    /// The key light is at the front left above the camera, the fill light at the right, and the
    /// third above and behind what is seen.
    #[must_use]
    pub fn studio() -> Self {
        let boxes = [
            SoftBox::new(DVec3::new(-0.75, 0.75, 0.85), [0.42, 0.55], 6.0),
            SoftBox::new(DVec3::new(1.0, 0.3, 0.45), [0.30, 0.65], 2.2),
            SoftBox::new(DVec3::new(0.15, 0.9, -0.7), [0.85, 0.22], 4.5),
        ];
        let room = |d: DVec3| {
            // Floor, walls and ceiling, each a little brighter than the one below.
            let walls = 0.07 + 0.12 * smooth(0.5 + 0.5 * d.y);
            walls + boxes.iter().map(|light| light.radiance(d)).sum::<f64>()
        };
        let mut picture = painted(|d| [room(d); 3]);
        let factor = 0.5 / (luminance(integral(&picture, |_| 1.0)) / (4.0 * PI));
        picture.rgb.as_flattened_mut().iter_mut().for_each(|c| *c *= factor as f32);
        built_in("studio", picture)
    }

    /// A clear sky with its sun at the front left, 40 degrees high, over ground of albedo 0.2.
    ///
    /// The sun's irradiance is 2.5 pi on a surface that faces it, that of the sky on the ground
    /// about a fifth of that, so that what is a third as bright as white comes out well at 0 stops.
    /// Its disc is 0.8 degrees in radius, three times the real one's, so that its texels show it.
    #[must_use]
    pub fn sky() -> Self {
        let sun = DVec3::new(-0.55, 0.0, 0.65).normalize_or_zero() * 40f64.to_radians().cos()
            + DVec3::Y * 40f64.to_radians().sin();
        let mut sky = painted(|d| if d.y > 0.0 { clear_sky(d, sun) } else { [0.0; 3] });
        let factor = SKY / (luminance(irradiance(&sky, DVec3::Y)) / PI);
        sky.rgb.as_flattened_mut().iter_mut().for_each(|c| *c *= factor as f32);
        add_sun(&mut sky, sun);
        let ground = irradiance(&sky, DVec3::Y).map(|e| (GROUND * e / PI) as f32);
        // The horizon is between two rows.
        let half = sky.rgb.len() / 2;
        sky.rgb[half..].fill(ground);
        built_in("sky", sky)
    }

    /// The same radiance from all directions, linear Rec. 709; what is not finite or negative
    /// becomes 0 and is counted.
    #[must_use]
    pub fn constant(radiance: [f32; 3]) -> Self {
        let (width, height) = (64, 32);
        let rgb = vec![radiance; (width * height) as usize];
        built_in("constant", Picture { width, height, rgb })
    }
}

fn built_in(name: &str, picture: Picture) -> Probe {
    Probe::of(name.to_owned(), picture, Mapping::LatLong, false)
}

/// A picture in latitude and longitude of radiance by unit direction.
fn painted(radiance: impl Fn(DVec3) -> [f64; 3] + Sync) -> Picture {
    let (width, height) = (WIDTH, WIDTH / 2);
    let row = |y: u32| {
        let radiance = &radiance;
        (0..width).map(move |x| radiance(direction(x, y)).map(|c| c as f32))
    };
    let rgb = (0..height).into_par_iter().flat_map_iter(row).collect();
    Picture { width, height, rgb }
}

/// Direction of the centre of a texel.
fn direction(x: u32, y: u32) -> DVec3 {
    let u = (f64::from(x) + 0.5) / f64::from(WIDTH);
    let v = (f64::from(y) + 0.5) / f64::from(WIDTH / 2);
    Mapping::LatLong.direction(u, v).unwrap_or(DVec3::NEG_Z)
}

/// The integral of radiance over all directions, each with a weight.
fn integral(picture: &Picture, weight: impl Fn(DVec3) -> f64) -> [f64; 3] {
    let source = TexelMap::new(Mapping::LatLong, picture.width, picture.height);
    let mut sum = [0.0; 3];
    for y in 0..picture.height {
        for x in 0..picture.width {
            if let Some(texel) = source.texel(picture, x, y) {
                let weight = weight(texel.towards) * texel.angle;
                sum.iter_mut().zip(texel.radiance).for_each(|(sum, c)| *sum += c * weight);
            }
        }
    }
    sum
}

/// Irradiance on a surface of unit normal.
fn irradiance(picture: &Picture, normal: DVec3) -> [f64; 3] {
    integral(picture, |d| d.dot(normal).max(0.0))
}

/// Rises from 0 to 1 over [0, 1], level at both ends.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A rectangular light that is brightest in its middle and fades at its edges.
struct SoftBox {
    /// Unit direction of its centre, and of its right and upper sides.
    centre: DVec3,
    right: DVec3,
    up: DVec3,
    /// Half width and height, as tangents of the angles from the centre.
    half: [f64; 2],
    /// Radiance of its middle.
    middle: f64,
}

impl SoftBox {
    fn new(towards: DVec3, half: [f64; 2], middle: f64) -> Self {
        let centre = towards.normalize_or_zero();
        let right = centre.cross(DVec3::Y).normalize_or_zero();
        Self { centre, right, up: right.cross(centre), half, middle }
    }

    fn radiance(&self, d: DVec3) -> f64 {
        /// Share of the half width over which the light fades.
        const EDGE: f64 = 0.35;
        let depth = d.dot(self.centre);
        if depth <= 0.0 {
            return 0.0;
        }
        let across = d.dot(self.right) / depth / self.half[0];
        let upwards = d.dot(self.up) / depth / self.half[1];
        let edge = |place: f64| smooth((1.0 - place.abs()) / EDGE);
        // The light behind the cloth.
        let hot = 1.0 - 0.25 * (across * across + upwards * upwards).min(2.0);
        self.middle * edge(across) * edge(upwards) * hot
    }
}

/// Irradiance over pi of the sky on the ground, and of the sun on a surface that faces it.
const SKY: f64 = 0.5;
const SUN: f64 = 2.5;

/// Colour of the sun, of luminance near 1: white that lost some of its blue on the way.
const SUN_COLOR: [f64; 3] = [1.06, 0.99, 0.87];

/// Radius of the sun's disc, radians.
const SUN_RADIUS: f64 = 0.8 * PI / 180.0;

/// Albedo of the ground.
const GROUND: f64 = 0.2;

/// Radiance of a clear sky above the horizon, without the sun, in a unit of its own.
///
/// Source: CIE S 011/E:2003, "Spatial Distribution of Daylight: CIE Standard General Sky", type 12
/// for the luminance. The colours, from a pale horizon to a blue zenith, are chosen by eye.
fn clear_sky(d: DVec3, sun: DVec3) -> [f64; 3] {
    let (height, angle) = (d.y.max(1e-3), d.dot(sun).clamp(-1.0, 1.0).acos());
    let gradation = 1.0 - (-0.32 / height).exp();
    let half_pi = 0.5 * PI;
    let indicatrix =
        1.0 + 10.0 * ((-3.0 * angle).exp() - (-3.0 * half_pi).exp()) + 0.45 * angle.cos().powi(2);
    let blue = smooth(height.powf(0.4));
    let (horizon, zenith) = ([0.95, 1.0, 1.13], [0.55, 1.03, 2.05]);
    std::array::from_fn(|i| gradation * indicatrix * (horizon[i] + (zenith[i] - horizon[i]) * blue))
}

/// Adds the sun's disc, each texel by the share of it that lies within.
fn add_sun(picture: &mut Picture, sun: DVec3) {
    /// Samples along each side of a texel.
    const SAMPLES: u32 = 8;
    let least = SUN_RADIUS.cos();
    let n = f64::from(SAMPLES);
    let covered = |x: u32, y: u32| {
        let place = |i: u32, k: u32| f64::from(i) + (f64::from(k) + 0.5) / n;
        let hit = |(a, b): (u32, u32)| {
            let u = place(x, a) / f64::from(WIDTH);
            let v = place(y, b) / f64::from(WIDTH / 2);
            Mapping::LatLong.direction(u, v).is_some_and(|d| d.dot(sun) >= least)
        };
        let all = (0..SAMPLES).flat_map(|b| (0..SAMPLES).map(move |a| (a, b)));
        all.filter(|&sample| hit(sample)).count() as f64 / (n * n)
    };
    // A texel's diagonal more than the disc.
    let near = (SUN_RADIUS + 2.0 * PI / f64::from(WIDTH) * std::f64::consts::SQRT_2).cos();
    let mut disc = Picture {
        rgb: vec![[0.0; 3]; picture.rgb.len()],
        width: picture.width,
        height: picture.height,
    };
    for y in 0..picture.height {
        for x in 0..picture.width {
            if direction(x, y).dot(sun) >= near {
                disc.rgb[(y * WIDTH + x) as usize] = [covered(x, y) as f32; 3];
            }
        }
    }
    let factor = SUN * PI / irradiance(&disc, sun)[1];
    for (texel, disc) in picture.rgb.iter_mut().zip(&disc.rgb) {
        for (c, color) in texel.iter_mut().zip(SUN_COLOR) {
            *c += (f64::from(disc[0]) * factor * color) as f32;
        }
    }
}
