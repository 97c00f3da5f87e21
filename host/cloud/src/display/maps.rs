//! Colour maps: what becomes of a number between the ends of a range.

use super::tables::{TURBO, VIRIDIS};
use std::sync::OnceLock;
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};

/// Colours of a map.
pub const MAP_SIZE: usize = 256;

/// A colour map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ColorMap {
    /// Perceptually even, dark blue to yellow.
    #[default]
    Viridis,
    /// The rainbow: more different colours than any other, at the price of evenness.
    Turbo,
    /// Black to white, evenly in sRGB.
    Grey,
    /// Blue to red through light grey, for what lies on two sides of a middle.
    Diverging,
}

impl ColorMap {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Viridis, Self::Turbo, Self::Grey, Self::Diverging];

    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Turbo => "turbo",
            Self::Grey => "grey",
            Self::Diverging => "diverging",
        }
    }

    /// The colours from low to high, sRGB-encoded.
    #[must_use]
    pub fn colors(self) -> &'static [[u8; 3]; MAP_SIZE] {
        static ALL: OnceLock<[[[u8; 3]; MAP_SIZE]; 4]> = OnceLock::new();
        let [viridis, turbo, grey, diverging] = ALL.get_or_init(|| {
            let grey = std::array::from_fn(|i| [i as u8; 3]);
            [VIRIDIS.map(bytes), TURBO.map(bytes), grey, diverging_colors()]
        });
        match self {
            Self::Viridis => viridis,
            Self::Turbo => turbo,
            Self::Grey => grey,
            Self::Diverging => diverging,
        }
    }

    /// The colour of a share of the way from low to high; shares beyond [0, 1] have the colour of the end,
    /// and NaN that of the lower one.
    #[must_use]
    pub fn color(self, share: f64) -> [u8; 3] {
        // The cast takes NaN to 0.
        self.colors()[(share.clamp(0.0, 1.0) * (MAP_SIZE - 1) as f64 + 0.5) as usize]
    }
}

fn bytes(packed: u32) -> [u8; 3] {
    let [_, red, green, blue] = packed.to_be_bytes();
    [red, green, blue]
}

/// The ends of the diverging map, sRGB-encoded.
const DIVERGING: [[u8; 3]; 2] = [[59, 76, 192], [180, 4, 38]];

/// The diverging map: from each end to a white in the middle, along a straight line in the polar form of
/// CIE L*a*b*, with a hue that turns towards the middle as far as evenness asks.
///
/// Source: Moreland 2009, "Diverging Color Maps for Scientific Visualization", section 5, with the ends that
/// it recommends.
fn diverging_colors() -> [[u8; 3]; MAP_SIZE] {
    /// Least length of the middle's vector.
    const WHITE: f64 = 88.0;
    let [low, high] = DIVERGING.map(|end| polar(lab(end)));
    let middle = low[0].max(high[0]).max(WHITE);
    std::array::from_fn(|i| {
        let share = i as f64 / (MAP_SIZE - 1) as f64;
        let (end, towards_end) =
            if share < 0.5 { (low, 1.0 - 2.0 * share) } else { (high, 2.0 * share - 1.0) };
        let white = [middle, 0.0, turned(end, middle)];
        let mixed = std::array::from_fn(|k| white[k] + (end[k] - white[k]) * towards_end);
        srgb(cartesian(mixed))
    })
}

/// The hue of an unsaturated colour of a length, on an even way from a saturated one.
fn turned([length, saturation, hue]: [f64; 3], unsaturated: f64) -> f64 {
    if length >= unsaturated {
        return hue;
    }
    let spin = saturation * (unsaturated * unsaturated - length * length).sqrt()
        / (length * saturation.sin());
    // Away from purple.
    if hue > -std::f64::consts::FRAC_PI_3 { hue + spin } else { hue - spin }
}

fn polar([l, a, b]: [f64; 3]) -> [f64; 3] {
    let length = (l * l + a * a + b * b).sqrt();
    [length, (l / length).acos(), b.atan2(a)]
}

fn cartesian([length, saturation, hue]: [f64; 3]) -> [f64; 3] {
    let across = length * saturation.sin();
    [length * saturation.cos(), across * hue.cos(), across * hue.sin()]
}

/// D65, CIE XYZ.
const WHITE_POINT: [f64; 3] = [0.9505, 1.0, 1.089];

/// Rows of the matrix from linear sRGB to CIE XYZ.
///
/// Source: IEC 61966-2-1.
const XYZ: [[f64; 3]; 3] =
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];

/// Rows of its inverse.
const RGB: [[f64; 3]; 3] =
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];

fn times(matrix: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// CIE L*a*b* of an sRGB-encoded colour.
fn lab(encoded: [u8; 3]) -> [f64; 3] {
    let linear = encoded.map(|code| f64::from(srgb_to_linear(f32::from(code) / 255.0)));
    let xyz = times(XYZ, linear);
    let root = |i: usize| {
        let ratio = xyz[i] / WHITE_POINT[i];
        if ratio > 0.008856 { ratio.cbrt() } else { 7.787 * ratio + 16.0 / 116.0 }
    };
    [116.0 * root(1) - 16.0, 500.0 * (root(0) - root(1)), 200.0 * (root(1) - root(2))]
}

fn srgb([l, a, b]: [f64; 3]) -> [u8; 3] {
    let y = (l + 16.0) / 116.0;
    let cube = |root: f64| {
        let cube = root * root * root;
        if cube > 0.008856 { cube } else { (root - 16.0 / 116.0) / 7.787 }
    };
    let roots = [y + a / 500.0, y, y - b / 200.0];
    let linear = times(RGB, std::array::from_fn(|i| cube(roots[i]) * WHITE_POINT[i]));
    linear.map(|channel| encoded(channel as f32))
}

/// The code of a linear channel, which may lie beyond [0, 1].
pub(super) fn encoded(linear: f32) -> u8 {
    (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lightness(map: ColorMap) -> Vec<f64> {
        map.colors().iter().map(|color| lab(*color)[0]).collect()
    }

    #[test]
    fn ends_and_middles_are_those_that_were_published() {
        for (map, expected) in [
            (ColorMap::Viridis, [[68, 1, 84], [33, 145, 140], [253, 231, 37]]),
            (ColorMap::Turbo, [[48, 18, 59], [164, 252, 60], [122, 4, 3]]),
            (ColorMap::Grey, [[0; 3], [128; 3], [255; 3]]),
            (ColorMap::Diverging, [[59, 76, 192], [221, 220, 220], [180, 4, 38]]),
        ] {
            let found = [0.0, 0.5, 1.0].map(|share| map.color(share));
            for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
                // The diverging map is computed, and its paper gives the middle as 221, 221, 221.
                let bound = if map == ColorMap::Diverging { 1 } else { 0 };
                assert!(found.abs_diff(*expected) <= bound, "{map:?}: {found} {expected}");
            }
        }
    }

    #[test]
    fn viridis_and_grey_get_lighter_all_the_way_and_viridis_evenly() {
        for map in [ColorMap::Viridis, ColorMap::Grey] {
            // Codes of 8 bits are rounded, by a tenth of a unit of lightness each at most.
            let steps: Vec<f64> = lightness(map).windows(2).map(|pair| pair[1] - pair[0]).collect();
            assert!(steps.iter().all(|step| *step > -0.1), "{map:?}: {steps:?}");
        }
        let viridis = lightness(ColorMap::Viridis);
        let (first, last) = (viridis[0], viridis[255]);
        for (i, found) in viridis.iter().enumerate() {
            let even = first + (last - first) * i as f64 / 255.0;
            assert!((found - even).abs() < 2.0, "{i}: {found} for {even}");
        }
    }

    #[test]
    fn the_diverging_map_is_lightest_in_its_middle() {
        let all = lightness(ColorMap::Diverging);
        assert!(all[..128].windows(2).all(|pair| pair[1] > pair[0] - 0.1));
        assert!(all[128..].windows(2).all(|pair| pair[1] < pair[0] + 0.1));
    }

    #[test]
    fn shares_beyond_the_ends_have_their_colours() {
        for map in ColorMap::ALL {
            assert_eq!(map.color(-3.0), map.colors()[0]);
            assert_eq!(map.color(f64::INFINITY), map.colors()[255]);
            assert_eq!(map.color(f64::NAN), map.colors()[0]);
        }
    }
}
