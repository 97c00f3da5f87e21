//! From radiance to what a screen shows: exposure, tone mapping, background, sRGB.
//!
//! The same for every renderer, so that comparisons are fair.

use crate::run::Image;
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};

/// How radiance above what a screen can show is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Values above 1 are cut off.
    #[default]
    Clamp,
    /// Khronos PBR Neutral: colours below 0.8 stay, highlights are compressed and desaturated.
    Neutral,
}

/// What stands where no surfel is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// Nothing: the picture keeps its alpha.
    #[default]
    Transparent,
    /// A colour, sRGB-encoded in [0, 1]; neither exposed nor tone-mapped.
    Color([f32; 3]),
}

/// How a picture is developed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Development {
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
pub fn develop(radiance: &Image, how: &Development) -> Image {
    let gain = how.exposure_stops.exp2();
    let mut data = Vec::with_capacity(radiance.data.len());
    for pixel in radiance.data.chunks_exact(4) {
        let alpha = if pixel[3].is_finite() { pixel[3].clamp(0.0, 1.0) } else { 0.0 };
        let rgb = [pixel[0], pixel[1], pixel[2]].map(|value| {
            let exposed = value * gain;
            if exposed.is_finite() { exposed.max(0.0) } else { 0.0 }
        });
        let mapped = match how.tone_map {
            ToneMap::Clamp => rgb.map(|value| value.min(1.0)),
            ToneMap::Neutral => neutral(rgb),
        };
        match how.background {
            Background::Transparent => {
                data.extend(mapped.map(linear_to_srgb));
                data.push(alpha);
            }
            Background::Color(background) => {
                for (value, behind) in mapped.into_iter().zip(background) {
                    let linear = value * alpha + srgb_to_linear(behind) * (1.0 - alpha);
                    data.push(linear_to_srgb(linear));
                }
                data.push(1.0);
            }
        }
    }
    Image { width: radiance.width, height: radiance.height, components: 4, data }
}

/// Khronos PBR Neutral tone mapping of a linear colour.
///
/// Source: Khronos Group 2024, "Khronos PBR Neutral Tone Mapper", with F90 of 0.04, start of
/// compression 0.8 and desaturation 0.15.
fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = rgb.map(|value| value - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|value| value * (new_peak / peak) * (1.0 - gray) + new_peak * gray)
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
    use super::*;

    fn one(pixel: [f32; 4]) -> Image {
        Image { width: 1, height: 1, components: 4, data: pixel.to_vec() }
    }

    #[test]
    fn exposure_is_in_stops() {
        let how = Development { exposure_stops: 1.0, ..Development::default() };
        let developed = develop(&one([0.25, 0.0, 0.0, 1.0]), &how);
        assert!((developed.data[0] - linear_to_srgb(0.5)).abs() < 1e-6);
    }

    #[test]
    fn backgrounds_show_as_given_whatever_the_exposure() {
        let background = Background::Color([0.2, 0.4, 0.6]);
        let how = Development { exposure_stops: 5.0, background, ..Development::default() };
        let developed = develop(&one([0.0; 4]), &how);
        for (value, expected) in developed.data.iter().zip([0.2, 0.4, 0.6, 1.0]) {
            // Decoding and encoding sRGB in f32.
            assert!((value - expected).abs() < 1e-6);
        }
    }

    #[test]
    fn nothing_that_is_not_finite_reaches_the_picture() {
        for tone_map in [ToneMap::Clamp, ToneMap::Neutral] {
            let how = Development { tone_map, ..Development::default() };
            let odd = develop(&one([f32::NAN, f32::INFINITY, -3.0, f32::NAN]), &how);
            assert!(odd.data.iter().all(|v| v.is_finite() && (0.0..=1.0).contains(v)));
            let bright = develop(&one([1e30, 2e5, 3.0, 1.0]), &how);
            assert!(bright.data.iter().all(|v| v.is_finite() && (0.0..=1.0).contains(v)));
        }
    }

    #[test]
    fn rounding_is_to_the_nearest_level() {
        let image = one([0.0, 1.0, 0.5, 0.998]);
        assert_eq!(to_8_bit(&image), [0, 255, 128, 254]);
        assert_eq!(to_16_bit(&image)[2], 32768);
    }
}
