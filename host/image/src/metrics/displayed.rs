//! Pictures as a screen shows them.

use crate::Image;
use crate::display_transform::{Background, DisplayTransform, develop};

/// What a screen shows of a picture: sRGB-encoded values in [0, 1] over a background, black where
/// none is given, so that coverage counts; the fourth value is 1.
pub(super) fn shown(picture: &Image, development: &DisplayTransform) -> Image {
    let background = match development.background {
        Background::Transparent => Background::Color([0.0; 3]),
        given => given,
    };
    develop(picture, &DisplayTransform { background, ..*development })
}

/// Peak signal-to-noise ratio of two displayed pictures in decibels; `None` for equal ones.
pub(super) fn psnr(test: &Image, reference: &Image) -> Option<f64> {
    let pixels = test.data.chunks_exact(4).zip(reference.data.chunks_exact(4));
    let offsets = pixels
        .flat_map(|(t, r)| [0, 1, 2].map(|channel| f64::from(t[channel]) - f64::from(r[channel])));
    let rmse = root_mean_square(offsets);
    (rmse > 0.0).then(|| super::psnr(rmse))
}

/// Root of the mean square; 0 of nothing.
pub(super) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0u64), |(sum, n), value| (sum + value * value, n + 1));
    (sum / count.max(1) as f64).sqrt()
}
