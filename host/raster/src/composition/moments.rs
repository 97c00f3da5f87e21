//! How far the splats of a pixel lie apart.

use crate::lanes::{F, WIDTH};
use fearless_simd::prelude::*;

/// Sums over the splats of a square of pixels.
///
/// The sum over all pairs of products of weights and squares of differences of distances follows from three sums, and
/// not from where distances begin: they are counted from the first splat of each pixel, so that little cancels.
///
/// Source: Huang et al. 2024, "2D Gaussian Splatting", equation 13, and the recursion of their program, whose sum these
/// three give at its end.
#[derive(Clone, Debug, Default)]
pub(super) struct Moments {
    /// The distance of the first splat.
    first: [f32; WIDTH],
    weights: [f32; WIDTH],
    /// Of weights times distances from the first.
    distances: [f32; WIDTH],
    /// Of weights times their squares.
    squares: [f32; WIDTH],
}

/// Adds splats of these weights and distances, where that is asked for.
#[inline(always)]
pub(super) fn add<S: Simd>(simd: S, to: Option<&mut Moments>, weight: F<S>, distance: F<S>) {
    let Some(to) = to else { return };
    let zero = F::splat(simd, 0.0);
    let weights = F::load_array_ref(simd, &to.weights);
    let begins = weights.simd_eq(zero);
    let first = begins.select(distance, F::load_array_ref(simd, &to.first));
    let is_seen = weight.simd_gt(zero);
    let apart = is_seen.select(distance - first, zero);
    let moment = weight * apart;
    first.store_array(&mut to.first);
    (weights + weight).store_array(&mut to.weights);
    (F::load_array_ref(simd, &to.distances) + moment).store_array(&mut to.distances);
    (F::load_array_ref(simd, &to.squares) + moment * apart).store_array(&mut to.squares);
}

impl Moments {
    /// Adds one splat to one pixel.
    pub(super) fn add_to_lane(&mut self, lane: usize, weight: f32, distance: f32) {
        if self.weights[lane] == 0.0 {
            self.first[lane] = distance;
        }
        let apart = distance - self.first[lane];
        self.weights[lane] += weight;
        self.distances[lane] += weight * apart;
        self.squares[lane] += weight * apart * apart;
    }

    /// Divides all weights of a pixel by a number.
    pub(super) fn divide(&mut self, lane: usize, by: f32) {
        self.weights[lane] /= by;
        self.distances[lane] /= by;
        self.squares[lane] /= by;
    }

    /// The sum over pairs of a pixel, in squares of the unit of distances; the largest number where it is larger.
    pub(super) fn distortion(&self, lane: usize) -> f32 {
        let moment = self.distances[lane];
        let sum = self.weights[lane] * self.squares[lane] - moment * moment;
        // Infinite sums may leave no number.
        if sum.is_finite() { sum.max(0.0) } else { f32::MAX }
    }
}
