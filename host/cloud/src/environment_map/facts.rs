//! Facts of a probe that renderers get: spherical harmonics, mean, sun.

use super::mapping::Mapping;
use super::octahedral;
use super::picture::Picture;
use super::sun;
use super::texels::TexelMap;
use rayon::prelude::*;
use siphasher::sip128::{Hasher128 as _, SipHasher13};
use std::f64::consts::PI;
use std::hash::Hasher as _;
use surfelshop_api::EnvironmentFacts;
use surfelshop_geometry::harmonics::{Coefficients, MAX_COEFFICIENTS};

/// Rows summed by one task: fixed, so that sums come out the same on any number of threads.
const ROWS: u32 = 16;

/// Sums over the texels of a picture.
#[derive(Clone)]
pub(super) struct Totals {
    /// Spherical harmonics.
    pub(super) harmonics: Coefficients,
    /// Radiance times solid angle.
    pub(super) light: [f64; 3],
    /// Largest radiance of any channel.
    pub(super) most: f64,
    /// The texel of largest luminance: that, and its place.
    pub(super) brightest: (f64, [u32; 2]),
}

impl Totals {
    const ZERO: Self = Self {
        harmonics: [[0.0; 3]; MAX_COEFFICIENTS],
        light: [0.0; 3],
        most: 0.0,
        brightest: (0.0, [0; 2]),
    };

    fn of_rows(source: &TexelMap, picture: &Picture, rows: std::ops::Range<u32>) -> Self {
        let mut totals = Self::ZERO;
        for y in rows {
            for x in 0..source.width {
                let Some(texel) = source.texel(picture, x, y) else { continue };
                let light = texel.radiance.map(|c| c * texel.angle);
                source.project(&mut totals.harmonics, &texel, light);
                totals.light.iter_mut().zip(light).for_each(|(sum, c)| *sum += c);
                totals.most = texel.radiance.into_iter().fold(totals.most, f64::max);
                let luminance = luminance(texel.radiance);
                if luminance > totals.brightest.0 {
                    totals.brightest = (luminance, [x, y]);
                }
            }
        }
        totals
    }

    fn add(&mut self, other: &Self) {
        for (sum, c) in self.harmonics.iter_mut().zip(&other.harmonics) {
            sum.iter_mut().zip(c).for_each(|(sum, c)| *sum += c);
        }
        self.light.iter_mut().zip(other.light).for_each(|(sum, c)| *sum += c);
        self.most = self.most.max(other.most);
        if other.brightest.0 > self.brightest.0 {
            self.brightest = other.brightest;
        }
    }
}

/// Luminance of linear Rec. 709.
///
/// Source: ITU-R BT.709-6, section 3.2.
pub(super) fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Facts and octahedral map of a picture that is repaired.
pub(super) fn of(source: &TexelMap, picture: &Picture) -> (EnvironmentFacts, Vec<[f32; 3]>) {
    let totals = totals(source, picture);
    let sun = sun::find(source, picture, &totals);
    let side = octahedral::side(source);
    let texels = octahedral::map(source, picture, side);
    let facts = EnvironmentFacts {
        key: key(source.mapping, picture),
        side,
        harmonics: totals.harmonics.to_vec(),
        sun: sun.as_ref().map(|found| found.sun),
        harmonics_without_sun: sun.map_or(totals.harmonics, |found| found.rest).to_vec(),
        mean_radiance: totals.light.map(|c| c / (4.0 * PI)),
        max_radiance: totals.most,
    };
    (facts, texels)
}

fn totals(source: &TexelMap, picture: &Picture) -> Totals {
    let chunks: Vec<Totals> = (0..source.height.div_ceil(ROWS))
        .into_par_iter()
        .map(|chunk| {
            let first = chunk * ROWS;
            Totals::of_rows(source, picture, first..(first + ROWS).min(source.height))
        })
        .collect();
    let mut totals = Totals::ZERO;
    chunks.iter().for_each(|chunk| totals.add(chunk));
    totals
}

/// Raised whenever the facts or the map of an equal picture change: what was stored with another
/// one is out of date.
pub const VERSION: u32 = 2;

/// A name for the light: equal for equal texels in an equal mapping. It guards against mistakes, not
/// against forgery.
fn key(mapping: Mapping, picture: &Picture) -> String {
    let mut hasher = SipHasher13::new();
    hasher.write(mapping.name().as_bytes());
    hasher.write_u32(picture.width);
    hasher.write_u32(picture.height);
    hasher.write(bytemuck::cast_slice(&picture.rgb));
    format!("probe-{VERSION}-{:032x}", hasher.finish128().as_u128())
}
