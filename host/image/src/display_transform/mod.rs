//! From radiance to what a screen shows: exposure, tone mapping, background, sRGB.
//!
//! The same for every renderer, so that comparisons are fair.

mod background;
mod tone_map;

pub use background::Background;
pub use tone_map::ToneMap;

use crate::Image;
use background::DITHER_SIDE;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use surfelshop_api::params::linear_to_srgb;
use tone_map::neutral;

/// How a picture is developed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DisplayTransform {
    /// Factor on radiance in stops.
    pub exposure_stops: f32,
    /// How highlights are brought down.
    pub tone_map: ToneMap,
    /// What stands where no surfel is.
    pub background: Background,
}

/// Develops a picture of linear radiance and coverage (four components) into sRGB-encoded values
/// in [0, 1] with straight alpha, four components. Values that are not finite become black.
#[must_use]
pub fn develop(radiance: &Image, how: &DisplayTransform) -> Image {
    let gain = how.exposure_stops.exp2();
    let mut data = Vec::with_capacity(radiance.data.len());
    for (y, pixels) in rows(radiance).enumerate() {
        let behind = how.background.row(y, radiance.height);
        for (x, pixel) in pixels.chunks_exact(4).enumerate() {
            let (mapped, alpha) = exposed(pixel, gain, how.tone_map);
            match behind[x % DITHER_SIDE] {
                None => {
                    data.extend(mapped.map(linear_to_srgb));
                    data.push(alpha);
                }
                Some(behind) => {
                    for (value, behind) in mapped.into_iter().zip(behind) {
                        data.push(linear_to_srgb(value * alpha + behind * (1.0 - alpha)));
                    }
                    data.push(1.0);
                }
            }
        }
    }
    Image { width: radiance.width, height: radiance.height, components: 4, data }
}

/// The rows of a picture of four components.
fn rows(image: &Image) -> impl Iterator<Item = &[f32]> {
    image.data.chunks(row_length(image))
}

/// Values in a row of a picture of four components; never 0.
fn row_length(image: &Image) -> usize {
    4 * (image.width as usize).max(1)
}

/// A pixel's colour after exposure and tone mapping, linear in [0, 1], and its coverage.
fn exposed(pixel: &[f32], gain: f32, tone_map: ToneMap) -> ([f32; 3], f32) {
    let alpha = if pixel[3].is_finite() { pixel[3].clamp(0.0, 1.0) } else { 0.0 };
    let rgb = [pixel[0], pixel[1], pixel[2]].map(|value| {
        let exposed = value * gain;
        if exposed.is_finite() { exposed.max(0.0) } else { 0.0 }
    });
    let mapped = match tone_map {
        ToneMap::Clamp => rgb.map(|value| value.min(1.0)),
        ToneMap::Neutral => neutral(rgb),
    };
    (mapped, alpha)
}

/// [`develop`] and [`to_8_bit`] in one step, many times faster: what a window shows while something
/// moves. The levels are the same.
///
/// A picture of other than four components gives none.
#[must_use]
pub fn develop_to_8_bit(radiance: &Image, how: &DisplayTransform) -> Vec<u8> {
    if radiance.components != 4 {
        return Vec::new();
    }
    static ENCODER: LazyLock<Encoder> = LazyLock::new(Encoder::new);
    let encoder = &*ENCODER;
    let gain = how.exposure_stops.exp2();
    let develop = |pixel: &[f32], behind: Option<[f32; 3]>| -> [u8; 4] {
        let (mapped, alpha) = exposed(pixel, gain, how.tone_map);
        let mut level = [0; 4];
        for channel in 0..3 {
            let linear = match behind {
                Some(behind) => mapped[channel] * alpha + behind[channel] * (1.0 - alpha),
                None => mapped[channel],
            };
            level[channel] = encoder.level(linear);
        }
        level[3] = if behind.is_some() { 255 } else { (alpha * 255.0 + 0.5) as u8 };
        level
    };
    let n = row_length(radiance);
    let mut levels = vec![0; radiance.data.len()];
    let rows = levels.par_chunks_mut(n).zip(radiance.data.par_chunks(n)).enumerate();
    rows.with_min_len((1 << 14) / n + 1).for_each(|(y, (levels, values))| {
        let behind = how.background.row(y, radiance.height);
        // Much of a picture is nothing.
        let of_nothing = behind.map(|behind| develop(&[0.0; 4], behind));
        let pixels = levels.chunks_exact_mut(4).zip(values.chunks_exact(4));
        for (x, (level, pixel)) in pixels.enumerate() {
            let is_nothing = pixel.iter().all(|value| value.to_bits() == 0);
            let at = x % DITHER_SIDE;
            let found = if is_nothing { of_nothing[at] } else { develop(pixel, behind[at]) };
            level.copy_from_slice(&found);
        }
    });
    levels
}

/// Linear values to 8-bit sRGB by looking them up.
struct Encoder {
    /// The smallest value of each level; that of level 0 is 0, and none has level 256.
    least: [f32; 257],
    /// The level of the smallest value in each of [`CELLS`] parts of [0, 1].
    first: Vec<u8>,
}

/// Parts of [0, 1], so narrow that none holds three levels: the narrowest is 1 / 3295 wide.
const CELLS: usize = 1 << 12;

impl Encoder {
    fn new() -> Self {
        let level = |value: f32| (linear_to_srgb(value).clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let mut least = [0.0f32; 257];
        least[256] = f32::INFINITY;
        for (wanted, least) in least.iter_mut().enumerate().take(256).skip(1) {
            // Positive floats are ordered as their bits are.
            let (mut below, mut reached) = (0u32, 1.0f32.to_bits());
            while reached - below > 1 {
                let middle = below + (reached - below) / 2;
                if usize::from(level(f32::from_bits(middle))) >= wanted {
                    reached = middle;
                } else {
                    below = middle;
                }
            }
            *least = f32::from_bits(reached);
        }
        let first = (0..=CELLS).map(|cell| level(cell as f32 / CELLS as f32)).collect();
        Self { least, first }
    }

    fn level(&self, linear: f32) -> u8 {
        let value = linear.clamp(0.0, 1.0);
        let first = self.first[(value * CELLS as f32) as usize];
        // No cell holds three levels, and which of two it is nobody can guess: no branch.
        first + u8::from(value >= self.least[usize::from(first) + 1])
    }
}

/// The picture as 8-bit values, rounded to the nearest.
#[must_use]
pub fn to_8_bit(image: &Image) -> Vec<u8> {
    image.data.iter().map(|value| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8).collect()
}

/// The picture as 16-bit values, rounded to the nearest.
#[must_use]
pub fn to_16_bit(image: &Image) -> Vec<u16> {
    image.data.iter().map(|value| (value.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16).collect()
}

#[cfg(test)]
mod tests {
    use super::background::threshold;
    use super::*;

    fn one(pixel: [f32; 4]) -> Image {
        Image { width: 1, height: 1, components: 4, data: pixel.to_vec() }
    }

    #[test]
    fn exposure_is_in_stops() {
        let how = DisplayTransform { exposure_stops: 1.0, ..DisplayTransform::default() };
        let developed = develop(&one([0.25, 0.0, 0.0, 1.0]), &how);
        assert!((developed.data[0] - linear_to_srgb(0.5)).abs() < 1e-6);
    }

    #[test]
    fn backgrounds_show_as_given_whatever_the_exposure() {
        let background = Background::Color([0.2, 0.4, 0.6]);
        let how =
            DisplayTransform { exposure_stops: 5.0, background, ..DisplayTransform::default() };
        let developed = develop(&one([0.0; 4]), &how);
        for (value, expected) in developed.data.iter().zip([0.2, 0.4, 0.6, 1.0]) {
            // Decoding and encoding sRGB in f32.
            assert!((value - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn gradients_go_from_edge_to_edge_without_bands() {
        // Eight levels over 512 rows: as steps they would be bands of 64 rows.
        let level = |level: f32| [level / 255.0; 3];
        let background = Background::Gradient { top: level(100.0), bottom: level(108.0) };
        let how = DisplayTransform { background, ..DisplayTransform::default() };
        let (width, height) = (64, 512);
        let data = vec![0.0; 4 * width * height];
        let image = Image { width: width as u32, height: height as u32, components: 4, data };
        let levels = develop_to_8_bit(&image, &how);
        // A constant is met to half of a 64th by every 8 x 8 pixels. What changes by an eighth of a level meanwhile
        // is at most half of that off, and rounding in f32 is far below.
        let most = 0.5 / 64.0 + 0.5 / 8.0 + 1e-3;
        for (block, rows) in levels.chunks_exact(4 * width * 8).enumerate() {
            let sum: u64 = rows.iter().step_by(4).map(|&level| u64::from(level)).sum();
            let mean = sum as f64 / (width * 8) as f64;
            let expected = 100.0 + 8.0 * (block as f64 + 0.5) / (height / 8) as f64;
            assert!((mean - expected).abs() <= most, "rows {block}: {mean}, expected {expected}");
        }
        // The pattern has each of its 64 places once.
        let places = (0..64).map(|i| (64.0 * threshold(i % 8, i / 8)) as usize);
        assert_eq!(places.collect::<std::collections::BTreeSet<_>>().len(), 64);
    }

    #[test]
    fn nothing_that_is_not_finite_reaches_the_picture() {
        for tone_map in [ToneMap::Clamp, ToneMap::Neutral] {
            let how = DisplayTransform { tone_map, ..DisplayTransform::default() };
            let odd = develop(&one([f32::NAN, f32::INFINITY, -3.0, f32::NAN]), &how);
            assert!(odd.data.iter().all(|v| v.is_finite() && (0.0..=1.0).contains(v)));
            let bright = develop(&one([1e30, 2e5, 3.0, 1.0]), &how);
            assert!(bright.data.iter().all(|v| v.is_finite() && (0.0..=1.0).contains(v)));
        }
    }

    #[test]
    fn the_fast_way_gives_the_same_levels() {
        let encoder = Encoder::new();
        let mut values = vec![0.0, 1.0, f32::NAN, f32::INFINITY, -1.0, 1e-40, 0.5];
        for least in encoder.least {
            let bits = least.to_bits();
            values.extend([bits.saturating_sub(1), bits, bits + 1].map(f32::from_bits));
        }
        values.extend((0..20_000).map(|i| (i as f32 * 0.618_034).fract() * 1.5));
        let data = values.iter().flat_map(|&v| [v, 0.3 * v, 1.0 - v, v.fract()]).collect();
        let (width, height) = (values.len() as u32 / 13, 13);
        let mut image = Image { width, height, components: 4, data };
        image.data.truncate(4 * (width * height) as usize);
        let gradient = Background::Gradient { top: [0.2, 0.7, 1.0], bottom: [0.1, 0.0, 0.3] };
        let backgrounds = [Background::Transparent, Background::Color([0.2, 0.7, 1.0]), gradient];
        for tone_map in [ToneMap::Clamp, ToneMap::Neutral] {
            for background in backgrounds {
                for exposure_stops in [0.0, -1.3] {
                    let how = DisplayTransform { exposure_stops, tone_map, background };
                    assert!(to_8_bit(&develop(&image, &how)) == develop_to_8_bit(&image, &how));
                }
            }
        }
    }

    #[test]
    fn rounding_is_to_the_nearest_level() {
        let image = one([0.0, 1.0, 0.5, 0.998]);
        assert_eq!(to_8_bit(&image), [0, 255, 128, 254]);
        assert_eq!(to_16_bit(&image)[2], 32768);
    }
}
