//! How a square of pixels meets a footprint.

use super::footprint::LOW_PASS;
use super::grid::{ACROSS, Lanes, SIDE};
use super::sorting::Visible;
use crate::lanes::{F, M, power_of_2, smaller};
use fearless_simd::prelude::*;

/// No splat hides more than this.
///
/// Source: Kerbl et al. 2023, appendix C.
const MOST_OPACITY: f32 = 0.99;

/// Where a tile lies, and how it is looked at.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// Its first pixel.
    pub(super) corner: [usize; 2],
    pub(super) near: f32,
    pub(super) orthographic: bool,
}

/// Columns and rows of the pixels of a square.
const COLUMNS: Lanes =
    [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const ROWS: Lanes =
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];

/// A footprint as pixels of a tile meet it.
pub(super) struct Lines<S: Simd> {
    shape: [f32; 4],
    /// Distances, and what they are divided by.
    distance: [f32; 3],
    divisor: [f32; 3],
    opacity: f32,
    cutoff: F<S>,
    near: F<S>,
    /// Pixels of the first square from the centre.
    x: F<S>,
    y: F<S>,
}

/// What of a splat a square of pixels meets.
pub(super) struct Hit<S: Simd> {
    pub(super) inside: M<S>,
    /// Twice the exponent.
    pub(super) r2: F<S>,
    pub(super) distance: F<S>,
}

impl<S: Simd> Lines<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, splat: &Visible, place: &Place) -> Self {
        let footprint = &splat.footprint;
        let [x, y] = [0, 1].map(|i| place.corner[i] as f32 + 0.5 - footprint.center[i]);
        let distance = footprint.distance;
        Self {
            shape: footprint.shape,
            distance,
            divisor: if place.orthographic { [0.0, 0.0, 1.0] } else { distance },
            opacity: footprint.opacity.min(1.0),
            cutoff: F::splat(simd, splat.cutoff),
            near: F::splat(simd, place.near),
            x: F::load_array_ref(simd, &COLUMNS) + x,
            y: F::load_array_ref(simd, &ROWS) + y,
        }
    }

    #[inline(always)]
    pub(super) fn hit<const PLANAR: bool>(&self, simd: S, square: usize) -> Hit<S> {
        let x = self.x + (square % ACROSS * SIDE) as f32;
        let y = self.y + (square / ACROSS * SIDE) as f32;
        let [a, b, c, d] = self.shape;
        let (r2, distance) = if PLANAR {
            // The ray of a pixel is where two planes meet; the plane of the splat is met where both are.
            let [w0, w1, w2] = self.divisor;
            let k = [x * w0 - a, x * w1 - b, x * w2];
            let l = [y * w0 - c, y * w1 - d, y * w2];
            let across = k[0] * l[1] - k[1] * l[0];
            let one = F::splat(simd, 1.0) / across;
            let s = (k[1] * l[2] - k[2] * l[1]) * one;
            let t = (k[2] * l[0] - k[0] * l[2]) * one;
            let in_plane = s * s + t * t;
            let on_screen = (x * x + y * y) * LOW_PASS;
            let met = s * self.distance[0] + t * self.distance[1] + self.distance[2];
            let r2 = smaller(in_plane, on_screen);
            let of_plane = in_plane.simd_le(on_screen);
            (r2, of_plane.select(met, F::splat(simd, self.distance[2])))
        } else {
            let r2 = x * x * a + x * y * (2.0 * b) + y * y * c;
            (r2, F::splat(simd, self.distance[2]))
        };
        let zero = F::splat(simd, 0.0);
        let inside = r2.simd_le(self.cutoff) & r2.simd_ge(zero) & distance.simd_ge(self.near);
        Hit { inside, r2, distance }
    }

    /// How much of what is behind is hidden where pixels count; 0 elsewhere.
    #[inline(always)]
    pub(super) fn opacity(&self, simd: S, counts: M<S>, r2: F<S>) -> F<S> {
        let zero = F::splat(simd, 0.0);
        let exponent = counts.select(r2, zero) * (-0.5 * std::f32::consts::LOG2_E);
        let opacity = smaller(power_of_2(exponent) * self.opacity, F::splat(simd, MOST_OPACITY));
        counts.select(opacity, zero)
    }
}
