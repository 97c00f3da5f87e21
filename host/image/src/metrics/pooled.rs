//! The errors of several pictures in one.

use super::{Errors, Flip, Squared};

impl Errors {
    /// Errors over all pixels of several pictures of one size; `None` of none.
    ///
    /// Squared errors are averaged as estimated and cut off at 0 afterwards, and [`Self::psnr`] is that
    /// of the mean squared error; the other numbers are means over the pictures, but largest values
    /// are the largest of any. Means of percentiles are not percentiles of all pixels. What one of the
    /// pictures has none of is not known of all.
    #[must_use]
    pub fn pooled(all: &[&Self]) -> Option<Self> {
        let (n, first) = (all.len() as f64, all.first()?);
        let mean = |of: &dyn Fn(&Self) -> f64| all.iter().map(|errors| of(errors)).sum::<f64>() / n;
        let largest =
            |of: &dyn Fn(&Self) -> f64| all.iter().map(|errors| of(errors)).fold(0.0, f64::max);
        let squared = |of: &dyn Fn(&Self) -> Squared| Squared {
            mse: mean(&|errors| of(errors).mse),
            rel_mse: mean(&|errors| of(errors).rel_mse),
            rel_mse_without_outliers: mean(&|errors| of(errors).rel_mse_without_outliers),
        };
        let estimate = squared(&|errors| errors.estimate);
        // Equal pictures have no PSNR and no error.
        let shown = mean(&|errors| errors.psnr.map_or(0.0, |psnr| 10f64.powf(-0.1 * psnr)));
        let has_ssim = all.iter().all(|errors| errors.ssim.is_some());
        Some(Self {
            rmse: estimate.mse.max(0.0).sqrt(),
            rel_mse: estimate.rel_mse.max(0.0),
            rel_mse_without_outliers: estimate.rel_mse_without_outliers.max(0.0),
            n_outliers: all.iter().map(|errors| errors.n_outliers).sum(),
            measured: squared(&|errors| errors.measured),
            estimate,
            reference_noise: squared(&|errors| errors.reference_noise),
            max_absolute: largest(&|errors| errors.max_absolute),
            psnr: match all.len() {
                1 => first.psnr,
                _ => (shown > 0.0).then(|| -10.0 * shown.log10()),
            },
            ssim: has_ssim.then(|| mean(&|errors| errors.ssim.unwrap_or_default())),
            flip: Flip {
                mean: mean(&|errors| errors.flip.mean),
                p50: mean(&|errors| errors.flip.p50),
                p95: mean(&|errors| errors.flip.p95),
                p99: mean(&|errors| errors.flip.p99),
                max: largest(&|errors| errors.flip.max),
            },
            coverage_difference: mean(&|errors| errors.coverage_difference),
        })
    }
}
