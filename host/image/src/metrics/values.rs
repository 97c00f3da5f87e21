//! Errors of values of points, such as columns that tools make.

use super::MetricsError;
use serde::{Deserialize, Serialize};

/// Share of the values, those of the largest errors, that [`ValueErrors::rmse_without_worst`] leaves
/// out: few points lie where two methods must disagree, such as inside each other.
const WORST: f64 = 0.01;

/// How values compare with a reference, one by one; in the values' own unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ValueErrors {
    /// How many values were compared.
    pub n_values: u64,
    /// Root of the mean squared error, less what the reference's noise adds; 0 where that is below.
    pub rmse: f64,
    /// The same without the 1 % of the largest errors, noise included.
    pub rmse_without_worst: f64,
    /// Mean of value less reference.
    pub bias: f64,
    /// What 99 % of the absolute errors do not exceed.
    pub p99: f64,
    /// The largest absolute error.
    pub max_absolute: f64,
    /// Root of the reference's own mean squared error.
    pub noise: f64,
}

impl ValueErrors {
    /// The errors by their names.
    #[must_use]
    pub fn named(&self) -> [(&'static str, f64); 5] {
        [
            ("rmse", self.rmse),
            ("rmse_without_worst", self.rmse_without_worst),
            ("bias", self.bias),
            ("p99", self.p99),
            ("max_absolute", self.max_absolute),
        ]
    }
}

/// Compares values one by one with a reference, whose own mean squared error is `noise_mse`, 0 where
/// it is exact.
///
/// # Errors
/// Where there are none, where there are not as many of both, or where one is not finite.
pub fn compare_values(
    values: &[f64],
    reference: &[f64],
    noise_mse: f64,
) -> Result<ValueErrors, MetricsError> {
    if values.len() != reference.len() {
        return Err(MetricsError::Counts { test: values.len(), reference: reference.len() });
    }
    for (whose, all) in [("values of the reference", reference), ("values", values)] {
        let n_not_finite = all.iter().filter(|value| !value.is_finite()).count() as u64;
        if n_not_finite > 0 || all.is_empty() {
            return Err(MetricsError::Values { whose, n: all.len(), n_not_finite });
        }
    }
    let mut apart: Vec<f64> = values.iter().zip(reference).map(|(v, r)| (v - r).abs()).collect();
    let n = apart.len();
    let mean_square = |all: &[f64]| all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64;
    let bias = values.iter().zip(reference).map(|(v, r)| v - r).sum::<f64>() / n as f64;
    apart.sort_by(f64::total_cmp);
    let n_kept = (n - (n as f64 * WORST) as usize).max(1);
    let last = apart.len() - 1;
    let p99 = ((n as f64 * 0.99).ceil() as usize).clamp(1, n) - 1;
    Ok(ValueErrors {
        n_values: n as u64,
        rmse: (mean_square(&apart) - noise_mse).max(0.0).sqrt(),
        rmse_without_worst: mean_square(&apart[..n_kept]).sqrt(),
        bias,
        p99: apart[p99],
        max_absolute: apart[last],
        noise: noise_mse.max(0.0).sqrt(),
    })
}
