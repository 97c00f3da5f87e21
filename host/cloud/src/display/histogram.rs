//! How numbers of an attribute are spread over a range.

use super::cache;
use super::error::DisplayError;
use super::scalar::Scalar;
use super::settings::{Attribute, Scale};
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use std::sync::Arc;

/// Bins of a histogram.
pub const HISTOGRAM_BINS: usize = 256;

/// How many numbers lie in each of equal parts of a range.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Ends of the range.
    pub range: [f64; 2],
    /// How the parts are spread over it.
    pub scale: Scale,
    /// Numbers in each part, from low to high; those at the upper end are in the last.
    pub bins: Vec<u64>,
    /// Numbers below the range.
    pub n_below: u64,
    /// Numbers above it.
    pub n_above: u64,
}

/// How many numbers of an attribute of these clouds lie where.
///
/// # Errors
/// Where a column has fewer components.
pub fn histogram(
    clouds: &[&Cloud],
    attribute: &Attribute,
    up: Axis,
    range: [f64; 2],
    scale: Scale,
) -> Result<Histogram, DisplayError> {
    let (bins, n_below, n_above) = (vec![0; HISTOGRAM_BINS], 0, 0);
    let mut all = Histogram { range, scale, bins, n_below, n_above };
    for cloud in clouds {
        if let Some(scalar) = Scalar::of(cloud, attribute, up)? {
            let own = cache::histogram((scalar.key(), range.map(f64::to_bits), scale), || {
                Arc::new(counted(&scalar, range, scale))
            });
            for (sum, n) in all.bins.iter_mut().zip(&own.bins) {
                *sum += n;
            }
            (all.n_below, all.n_above) = (all.n_below + own.n_below, all.n_above + own.n_above);
        }
    }
    Ok(all)
}

fn counted(scalar: &Scalar<'_>, range: [f64; 2], scale: Scale) -> Histogram {
    // Behind the bins, what lies below and above.
    let add = |sum: &mut Vec<u64>, numbers: &[f64]| {
        for &number in numbers.iter().filter(|number| !number.is_nan()) {
            let place = match scale.share(number, range) {
                share if share < 0.0 => HISTOGRAM_BINS,
                share if share > 1.0 => HISTOGRAM_BINS + 1,
                share => ((share * HISTOGRAM_BINS as f64) as usize).min(HISTOGRAM_BINS - 1),
            };
            sum[place] += 1;
        }
    };
    let merge = |mut a: Vec<u64>, b: Vec<u64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let mut bins = scalar.fold(|| vec![0; HISTOGRAM_BINS + 2], add, merge);
    let n_above = bins.pop().unwrap_or_default();
    let n_below = bins.pop().unwrap_or_default();
    Histogram { range, scale, bins, n_below, n_above }
}

impl Scale {
    /// Where a number lies between two others, 0 at the lower and 1 at the upper; beyond [0, 1] outside of
    /// them, and in the middle where both are one. NaN stays.
    #[must_use]
    pub fn share(self, number: f64, [low, high]: [f64; 2]) -> f64 {
        let (number, low, high) = match self {
            Self::Linear => (number, low, high),
            // What is not above 0 lies below all that is.
            Self::Logarithmic if number <= 0.0 => return f64::NEG_INFINITY,
            Self::Logarithmic => (number.ln(), low.ln(), high.ln()),
        };
        // Halves, whose difference is a number.
        let size = 0.5 * high - 0.5 * low;
        match size > 0.0 {
            true => (0.5 * number - 0.5 * low) / size,
            false if number.is_nan() => number,
            false => 0.5 + (number - low).clamp(-1.0, 1.0),
        }
    }

    /// The inverse of [`Scale::share`].
    #[must_use]
    pub fn at_share(self, share: f64, [low, high]: [f64; 2]) -> f64 {
        let between = |low: f64, high: f64| low * (1.0 - share) + high * share;
        match self {
            Self::Linear => between(low, high),
            Self::Logarithmic => between(low.ln(), high.ln()).exp(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::floats;
    use super::*;

    #[test]
    fn histograms_have_every_number_in_its_bin() {
        let mut numbers: Vec<f64> = (0..512).map(|i| f64::from(i) / 2.0).collect();
        numbers.extend([-1.0, 256.0, 300.0, f64::NAN, f64::NEG_INFINITY]);
        let cloud = floats(&numbers);
        let attribute = Attribute::column("a");
        let linear =
            |range| histogram(&[&cloud], &attribute, Axis::PlusY, range, Scale::Linear).unwrap();
        let found = linear([0.0, 256.0]);
        assert_eq!(found.bins[..255], [2; 255]);
        assert_eq!((found.bins[255], found.n_below, found.n_above), (3, 2, 1));
        assert_eq!(linear([0.0, 256.0]), found);
        let range = [1.0, 65536.0];
        let log = histogram(&[&cloud], &attribute, Axis::PlusY, range, Scale::Logarithmic).unwrap();
        // 16 octaves of 16 bins: from 128 to 256 there are 256 halves.
        assert_eq!(log.bins[7 * 16..8 * 16].iter().sum::<u64>(), 256);
        assert_eq!(log.n_below, 4, "0, 0.5, -1 and minus infinity");
    }

    #[test]
    fn shares_and_numbers_are_inverse() {
        for scale in Scale::ALL {
            let range = [0.5, 40.0];
            for expected in [0.0, 0.25, 1.0] {
                let found = scale.share(scale.at_share(expected, range), range);
                assert!((found - expected).abs() < 1e-12);
            }
        }
        assert_eq!(Scale::Linear.share(1e308, [-1e308, 1e308]), 1.0);
        assert_eq!(Scale::Linear.share(7.0, [7.0, 7.0]), 0.5);
        assert!(Scale::Logarithmic.share(f64::NAN, [0.0, 1.0]).is_nan());
        assert_eq!(Scale::Logarithmic.share(-1.0, [1.0, 2.0]), f64::NEG_INFINITY);
    }
}
