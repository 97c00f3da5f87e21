//! Errors of radiance, before any development.

use super::{Reference, Squared};
use crate::Image;
use rayon::prelude::*;
use std::ops::AddAssign;

/// Pixels that are summed by one thread: so many that results do not depend on the number of threads.
const CHUNK: usize = 1 << 14;

/// A test beside its reference.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a> {
    test: &'a [f32],
    reference: &'a [f32],
    variance: Option<&'a [f32]>,
    epsilon: f64,
}

/// Errors of a picture.
pub(super) struct LinearErrors {
    /// As measured, less what the reference's noise adds, and the reference's own.
    pub(super) measured: Squared,
    pub(super) estimate: Squared,
    pub(super) noise: Squared,
    pub(super) max_absolute: f64,
    pub(super) n_outliers: u64,
}

/// Squared errors summed over pixels and channels: as measured, less what the reference's noise
/// adds, and the reference's own.
#[derive(Clone, Copy, Default)]
struct Sums {
    squared: [f64; 3],
    relative: [f64; 3],
    max_absolute: f64,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        for which in 0..3 {
            self.squared[which] += other.squared[which];
            self.relative[which] += other.relative[which];
        }
        self.max_absolute = self.max_absolute.max(other.max_absolute);
    }
}

/// Radiance times coverage, which is straight and cut to [0, 1] as in development.
fn premultiplied(pixel: &[f32]) -> [f64; 3] {
    let coverage = f64::from(pixel[3].clamp(0.0, 1.0));
    [0, 1, 2].map(|channel| f64::from(pixel[channel]) * coverage)
}

impl<'a> Pair<'a> {
    pub(super) fn new(test: &'a Image, reference: &Reference<'a>, epsilon: f64) -> Self {
        Self {
            test: &test.data,
            reference: &reference.picture.data,
            variance: reference.variance.map(|variance| variance.data.as_slice()),
            epsilon,
        }
    }

    fn n_pixels(&self) -> usize {
        self.test.len() / 4
    }

    fn pixel(&self, at: usize) -> Sums {
        let values = 4 * at..4 * at + 4;
        let test = premultiplied(&self.test[values.clone()]);
        let reference = premultiplied(&self.reference[values.clone()]);
        let variance = self.variance.map_or(&[0.0; 4][..], |variance| &variance[values]);
        let mut sums = Sums::default();
        for channel in 0..3 {
            let apart = test[channel] - reference[channel];
            let squared = apart * apart;
            let noise = f64::from(variance[channel]);
            let scale = 1.0 / (reference[channel] * reference[channel] + self.epsilon);
            // What noise adds to a function of r on average is half its variance times the second
            // derivative, here of (t - r)² / (r² + epsilon).
            let slope = reference[channel] * scale;
            let bend = 1.0 + 4.0 * apart * slope + squared * (4.0 * slope * slope - scale);
            sums += Sums {
                squared: [squared, squared - noise, noise],
                relative: [squared * scale, (squared - noise * bend) * scale, noise * scale],
                max_absolute: apart.abs(),
            };
        }
        sums
    }

    /// Relative squared error of every pixel averaged over channels, the reference's noise included; NaN
    /// where the test is not finite.
    pub(super) fn relative(&self) -> Vec<f64> {
        let of = |at| {
            let finite = self.test[4 * at..4 * at + 4].iter().all(|value| value.is_finite());
            if finite { self.pixel(at).relative[0] / 3.0 } else { f64::NAN }
        };
        (0..self.n_pixels()).into_par_iter().map(of).collect()
    }

    /// The errors, given those of every pixel.
    pub(super) fn errors(&self, relative: Vec<f64>, outlier_share: f64) -> LinearErrors {
        let n_pixels = self.n_pixels();
        let n_outliers = (n_pixels as f64 * outlier_share) as usize;
        let all = self.sum(|_| true);
        let kept = if n_outliers == 0 {
            all
        } else {
            let (least, place) = cut(&relative, n_outliers);
            self.sum(|at| relative[at].total_cmp(&least).then(at.cmp(&place)).is_lt())
        };
        let n_values = (3 * n_pixels) as f64;
        let n_kept = (3 * (n_pixels - n_outliers)) as f64;
        let [measured, estimate, noise] = [0, 1, 2].map(|which| Squared {
            mse: all.squared[which] / n_values,
            rel_mse: all.relative[which] / n_values,
            rel_mse_without_outliers: kept.relative[which] / n_kept,
        });
        let max_absolute = all.max_absolute;
        LinearErrors { measured, estimate, noise, max_absolute, n_outliers: n_outliers as u64 }
    }

    fn sum(&self, keep: impl Fn(usize) -> bool + Sync) -> Sums {
        let n_pixels = self.n_pixels();
        let chunk = |number: usize| {
            let mut sums = Sums::default();
            for at in number * CHUNK..((number + 1) * CHUNK).min(n_pixels) {
                if keep(at) {
                    sums += self.pixel(at);
                }
            }
            sums
        };
        let parts: Vec<Sums> = (0..n_pixels.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
        let mut total = Sums::default();
        for part in parts {
            total += part;
        }
        total
    }
}

/// The least of the `n_outliers` largest values, with its place: of equal ones the later counts as
/// larger, so that exactly so many are left out.
fn cut(relative: &[f64], n_outliers: usize) -> (f64, usize) {
    let mut places: Vec<usize> = (0..relative.len()).collect();
    let by_value = |a: &usize, b: &usize| relative[*a].total_cmp(&relative[*b]).then(a.cmp(b));
    let at = relative.len() - n_outliers;
    let (_, place, _) = places.select_nth_unstable_by(at, by_value);
    (relative[*place], *place)
}

/// Relative squared errors as a picture of one value a pixel; NaN where they are not finite.
pub(super) fn map(relative: &[f64], like: &Image) -> Image {
    let most = f64::from(f32::MAX);
    let value = |v: &f64| if v.is_finite() { v.min(most) as f32 } else { f32::NAN };
    let data = relative.iter().map(value).collect();
    Image { width: like.width, height: like.height, components: 1, data }
}
