//! The sun of a probe: its dominant small light, split from the rest.

use super::facts::{Totals, luminance};
use super::picture::Picture;
use super::texels::{Texel, TexelMap};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use surfelshop_api::Sun;
use surfelshop_geometry::harmonics::{self, Coefficients};

/// Half of the largest apparent diameter, radians; in coarse pictures, two texels if that is more.
const LARGEST: f64 = 5.0 * PI / 180.0;

/// How many times brighter than the mean of the sphere the brightest texel has to be.
///
/// A light of less could not reach `LEAST_SHARE`: a disc of `LARGEST` has a five-hundredth of the
/// sphere.
const LEAST_PEAK: f64 = 10.0;

/// How many times brighter than its surroundings a texel of the sun is.
const FAR_ABOVE: f64 = 4.0;

/// Share of the light far above the surroundings that lies within the sun's cap.
const COMPACT: f64 = 0.9;

/// Share of the largest irradiance that the sun has to give.
const LEAST_SHARE: f64 = 0.1;

/// A sun and what is left without it.
pub(super) struct SunSplit {
    pub(super) sun: Sun,
    pub(super) rest: Coefficients,
}

/// Looks for a light that is small, far brighter than what is around it, and counts.
///
/// The sun is what texels within its cap have beyond the mean of a ring around it, so that what is
/// left has the radiance of the ring there.
pub(super) fn find(source: &TexelMap, picture: &Picture, totals: &Totals) -> Option<SunSplit> {
    let mean = luminance(totals.light) / (4.0 * PI);
    let (peak, [x, y]) = totals.brightest;
    if mean <= 0.0 || peak < LEAST_PEAK * mean {
        return None;
    }
    let towards = source.texel(picture, x, y)?.towards;
    let texel = (4.0 * PI / source.n_shown()).sqrt();
    let cap = LARGEST.max(2.0 * texel);
    // The centre may lie a cap away from its brightest texel, and the ring ends three caps away
    // from the centre.
    let near = gathered(source, picture, towards, 4.0 * cap);
    let around = |centre: DVec3| surroundings(&near, centre, [2.0 * cap, 3.0 * cap]);
    let lights = Lights { source, near: &near, level: around(towards) };
    let centre = lights.centre(towards, cap)?;
    let lights = Lights { source, near: &near, level: around(centre) };
    lights.sun(centre, cap, totals)
}

/// Texels within an angle of a direction.
fn gathered(source: &TexelMap, picture: &Picture, centre: DVec3, angle: f64) -> Vec<Texel> {
    let least = angle.min(PI).cos();
    let row = |y: u32| (0..source.width).filter_map(move |x| source.texel(picture, x, y));
    (0..source.height)
        .into_par_iter()
        .flat_map_iter(row)
        .filter(|texel| texel.towards.dot(centre) >= least)
        .collect()
}

/// Mean radiance of a ring; 0 where it has no texels.
fn surroundings(near: &[Texel], centre: DVec3, [from, to]: [f64; 2]) -> [f64; 3] {
    let (mut sum, mut angles) = ([0.0; 3], 0.0);
    for texel in near {
        if (from..to).contains(&angle_between(texel.towards, centre)) {
            angles += texel.angle;
            sum.iter_mut().zip(texel.radiance).for_each(|(sum, c)| *sum += c * texel.angle);
        }
    }
    if angles > 0.0 { sum.map(|c| c / angles) } else { sum }
}

/// Texels near a sun, and the radiance of its surroundings.
struct Lights<'a> {
    source: &'a TexelMap,
    near: &'a [Texel],
    level: [f64; 3],
}

impl Lights<'_> {
    /// Texels far above the surroundings within an angle of a direction, with what they have
    /// beyond them times their solid angle.
    fn within(&self, centre: DVec3, angle: f64) -> impl Iterator<Item = (&Texel, [f64; 3])> {
        let least = FAR_ABOVE * luminance(self.level);
        self.near
            .iter()
            .filter(move |texel| luminance(texel.radiance) > least)
            .filter(move |texel| angle_between(texel.towards, centre) <= angle)
            .map(|texel| {
                let beyond = |i: usize| (texel.radiance[i] - self.level[i]).max(0.0);
                (texel, std::array::from_fn(|i| beyond(i) * texel.angle))
            })
    }

    /// Centre of the light within a cap around a direction.
    fn centre(&self, towards: DVec3, cap: f64) -> Option<DVec3> {
        let sum: DVec3 =
            self.within(towards, cap).map(|(texel, light)| texel.towards * luminance(light)).sum();
        sum.try_normalize()
    }

    fn sun(&self, centre: DVec3, cap: f64, totals: &Totals) -> Option<SunSplit> {
        let mut rest = totals.harmonics;
        let mut irradiance = [0.0; 3];
        let (mut light_within, mut squares) = (0.0, 0.0);
        for (texel, light) in self.within(centre, cap) {
            let cosine = texel.towards.dot(centre).max(0.0);
            irradiance.iter_mut().zip(light).for_each(|(sum, c)| *sum += c * cosine);
            self.source.project(&mut rest, texel, light.map(|c| -c));
            let light = luminance(light);
            light_within += light;
            // Mean square of the angle, in a texel taken for a disc that of half its square.
            let square = angle_between(texel.towards, centre).powi(2);
            squares += light * (square + texel.angle / (2.0 * PI));
        }
        let light_near: f64 =
            self.within(centre, 2.0 * cap).map(|(_, light)| luminance(light)).sum();
        let share = luminance(irradiance) / largest_irradiance(&totals.harmonics, centre);
        if light_within <= 0.0 || light_within < COMPACT * light_near || share < LEAST_SHARE {
            return None;
        }
        let sun = Sun {
            towards: centre,
            radiance: irradiance.map(|c| c / PI),
            // A disc of even radiance has half its squared radius for mean square.
            angular_radius: (2.0 * squares / light_within).sqrt(),
        };
        Some(SunSplit { sun, rest })
    }
}

/// The largest irradiance on any surface, of luminance.
fn largest_irradiance(light: &Coefficients, sun: DVec3) -> f64 {
    /// About 6 degrees apart, over which irradiance changes by a two-hundredth.
    const DIRECTIONS: usize = 1024;
    let surface = harmonics::of_diffuse_surface(light, harmonics::MAX_ORDER, Default::default());
    harmonics::directions(DIRECTIONS)
        .chain([sun])
        .map(|n| PI * luminance(harmonics::evaluate(&surface, n)))
        .fold(f64::MIN_POSITIVE, f64::max)
}

/// Angle between unit directions, radians; exact for small ones.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}
