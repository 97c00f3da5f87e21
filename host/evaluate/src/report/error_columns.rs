//! The errors in a report's tables: name, meaning, and `less`, `more` or neither, whichever is better.

use crate::compare::METRICS;

/// Metrics of a comparison that stand in the tables.
const SHOWN: [&str; 6] = ["rmse", "rel_mse", "psnr", "ssim", "flip.mean", "coverage_difference"];

/// An error.
pub(super) type ErrorColumn = (&'static str, &'static str, &'static str);

/// Those of pictures.
pub(super) fn of_pictures() -> Vec<ErrorColumn> {
    METRICS.into_iter().filter(|(name, ..)| SHOWN.contains(name)).collect()
}

/// Those of columns that tools make.
pub(super) fn of_tools() -> Vec<ErrorColumn> {
    vec![
        ("rmse", "root of the mean squared error", "less"),
        ("rmse_without_worst", "the same without the 1 % of the largest errors", "less"),
        ("bias", "mean of value less reference", ""),
        ("p99", "what 99 % of the absolute errors do not exceed", "less"),
        ("max_absolute", "the largest absolute error", "less"),
    ]
}
