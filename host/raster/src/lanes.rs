//! Sixteen surfels or pixels at once.
//!
//! Results do not depend on the instructions that a CPU has: every operation here is rounded as
//! IEEE 754 says, and none is fused with another.

use fearless_simd::prelude::*;
use fearless_simd::{f32x16, i32x16, mask32x16, u32x16};

/// Lanes.
pub(crate) const WIDTH: usize = 16;

pub(crate) type F<S> = f32x16<S>;
pub(crate) type I<S> = i32x16<S>;
pub(crate) type U<S> = u32x16<S>;
pub(crate) type M<S> = mask32x16<S>;

/// Three coordinates of points or vectors.
#[derive(Clone, Copy)]
pub(crate) struct V<S: Simd> {
    pub(crate) x: F<S>,
    pub(crate) y: F<S>,
    pub(crate) z: F<S>,
}

impl<S: Simd> V<S> {
    /// Three groups of numbers.
    #[inline(always)]
    pub(crate) fn load(simd: S, [x, y, z]: &[[f32; WIDTH]; 3]) -> Self {
        let lanes = |lanes| F::load_array_ref(simd, lanes);
        Self { x: lanes(x), y: lanes(y), z: lanes(z) }
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> F<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Dot products with one vector.
    #[inline(always)]
    pub(crate) fn along(self, [x, y, z]: [f32; 3]) -> F<S> {
        self.x * x + self.y * y + self.z * z
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: F<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    #[inline(always)]
    pub(crate) fn pick(mask: M<S>, yes: Self, no: Self) -> Self {
        Self {
            x: mask.select(yes.x, no.x),
            y: mask.select(yes.y, no.y),
            z: mask.select(yes.z, no.z),
        }
    }
}

#[inline(always)]
pub(crate) fn length2<S: Simd>(x: F<S>, y: F<S>) -> F<S> {
    (x * x + y * y).sqrt()
}

/// The larger of each two; `other` where one is NaN.
#[inline(always)]
pub(crate) fn larger<S: Simd>(one: F<S>, other: F<S>) -> F<S> {
    one.simd_gt(other).select(one, other)
}

/// The smaller of each two; `other` where one is NaN.
#[inline(always)]
pub(crate) fn smaller<S: Simd>(one: F<S>, other: F<S>) -> F<S> {
    one.simd_lt(other).select(one, other)
}

/// Two to the power of numbers from -126 to 127, relatively within 5e-7.
#[inline(always)]
pub(crate) fn power_of_2<S: Simd>(t: F<S>) -> F<S> {
    // The whole part goes into the exponent, the rest into a polynomial, the series of the
    // exponential around 0.
    let whole = (t + 0.5).floor();
    let x = (t - whole) * std::f32::consts::LN_2;
    let mut series = x * (1.0 / 720.0) + 1.0 / 120.0;
    series = series * x + 1.0 / 24.0;
    series = series * x + 1.0 / 6.0;
    series = series * x + 0.5;
    series = series * x + 1.0;
    series = series * x + 1.0;
    let exponent = (whole.to_int::<I<S>>() + 127) << 23;
    series * exponent.bitcast::<F<S>>()
}
