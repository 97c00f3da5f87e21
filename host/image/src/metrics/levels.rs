//! Pictures that are 8-bit levels already.

use super::displayed::root_mean_square;

/// How two pictures of 8-bit levels differ.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelErrors {
    /// Largest absolute difference of the three channels, in [0, 1], pixel by pixel.
    pub largest: Vec<f32>,
    /// Root of the mean squared difference of all channels, in [0, 1].
    pub rmse: f64,
}

/// Compares two pictures of four 8-bit values a pixel as they are, without the fourth; `None` where
/// their lengths differ or they are empty.
#[must_use]
pub fn compare_levels(test: &[u8], reference: &[u8]) -> Option<LevelErrors> {
    if test.len() != reference.len() || test.len() < 4 {
        return None;
    }
    let apart = |t: &[u8], r: &[u8]| [0, 1, 2].map(|channel| t[channel].abs_diff(r[channel]));
    let pixels = || test.chunks_exact(4).zip(reference.chunks_exact(4));
    // Sums of squares of whole numbers are exact below 2^53.
    let rmse = root_mean_square(pixels().flat_map(|(t, r)| apart(t, r).map(f64::from))) / 255.0;
    let largest = pixels()
        .map(|(t, r)| {
            let [red, green, blue] = apart(t, r);
            f32::from(red.max(green).max(blue)) / 255.0
        })
        .collect();
    Some(LevelErrors { largest, rmse })
}

/// Peak signal-to-noise ratio in decibels for a root mean squared error on a scale of 0 to 1;
/// infinite for 0.
#[must_use]
pub fn psnr(rmse: f64) -> f64 {
    -20.0 * rmse.log10()
}
