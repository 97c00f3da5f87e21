//! What stands behind a picture.

use serde::{Deserialize, Serialize};
use surfelshop_api::params::srgb_to_linear;

/// What stands where no surfel is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Background {
    /// Nothing: the picture keeps its alpha.
    #[default]
    Transparent,
    /// A colour, sRGB-encoded in [0, 1]; neither exposed nor tone-mapped.
    Color([f32; 3]),
    /// Two colours, sRGB-encoded in [0, 1], and what is between them from the upper to the lower edge of the picture;
    /// neither exposed nor tone-mapped.
    Gradient {
        /// At the upper edge.
        top: [f32; 3],
        /// At the lower edge.
        bottom: [f32; 3],
    },
}

/// Pixels after which the pattern that hides the steps of a gradient repeats, along and across.
pub(super) const DITHER_SIDE: usize = 8;

impl Background {
    /// What is behind a pixel of a picture of `height` rows, sRGB-encoded in [0, 1]; `None` where nothing is.
    ///
    /// Gradients are shifted by up to half an 8-bit level, in an ordered pattern of 8 x 8 pixels: without it their
    /// levels would be seen as bands.
    ///
    /// Source: B. E. Bayer, An optimum method for two-level rendition of continuous-tone pictures, ICC 1973.
    #[must_use]
    pub fn behind(&self, [x, y]: [usize; 2], height: u32) -> Option<[f32; 3]> {
        match self {
            Self::Transparent => None,
            Self::Color(encoded) => Some(*encoded),
            Self::Gradient { top, bottom } => {
                let along = (y as f32 + 0.5) / height.max(1) as f32;
                let shift = (threshold(x, y) - 0.5) / 255.0;
                let channel = |i: usize| top[i] + (bottom[i] - top[i]) * along;
                Some([0, 1, 2].map(|i| (channel(i) + shift).clamp(0.0, 1.0)))
            }
        }
    }

    /// The mean of what is behind a picture, sRGB-encoded in [0, 1]; `None` where nothing is.
    #[must_use]
    pub fn mean(&self) -> Option<[f32; 3]> {
        match self {
            Self::Transparent => None,
            Self::Color(encoded) => Some(*encoded),
            Self::Gradient { top, bottom } => Some([0, 1, 2].map(|i| 0.5 * (top[i] + bottom[i]))),
        }
    }

    /// What is behind the pixels of a row, which repeats; linear.
    pub(super) fn row(&self, y: usize, height: u32) -> [Option<[f32; 3]>; DITHER_SIDE] {
        let first = self.behind([0, y], height).map(|encoded| encoded.map(srgb_to_linear));
        let mut row = [first; DITHER_SIDE];
        if matches!(self, Self::Gradient { .. }) {
            for (x, one) in row.iter_mut().enumerate().skip(1) {
                *one = self.behind([x, y], height).map(|encoded| encoded.map(srgb_to_linear));
            }
        }
        row
    }
}

/// The place of a pixel in the order of the pattern, in (0, 1): bits of `y` and of `x ^ y` in turn, the lowest first.
pub(super) fn threshold(x: usize, y: usize) -> f32 {
    let mut order = 0;
    for bit in 0..3 {
        order = 4 * order + 2 * (((x ^ y) >> bit) & 1) + ((y >> bit) & 1);
    }
    (order as f32 + 0.5) / 64.0
}
