//! Sixteen numbers that are computed with at once.
//!
//! Loops over an array of fixed length become vector instructions where the CPU has them:
//! [`on_best`] compiles what it is given several times and picks at run time.

use fearless_simd::{Level, dispatch};
use std::ops::{Add, Div, Mul, Sub};

/// Numbers in a [`Lanes`]: one register of AVX-512, two of AVX2.
pub(crate) const WIDTH: usize = 16;

/// Sixteen numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(crate) struct Lanes(pub(crate) [f32; WIDTH]);

macro_rules! lane_wise {
    ($($operation:ident::$function:ident),*) => {$(
        impl $operation for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i].$function(other.0[i])))
            }
        }
        impl $operation<f32> for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: f32) -> Self {
                Self(std::array::from_fn(|i| self.0[i].$function(other)))
            }
        }
    )*};
}

lane_wise!(Add::add, Sub::sub, Mul::mul, Div::div);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    pub(crate) fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    pub(crate) fn max(self, least: f32) -> Self {
        // The comparison, unlike f32::max, is one instruction.
        Self(self.0.map(|value| if value > least { value } else { least }))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    /// Where `self` is more than `than` the number of `value`, else that of `other`.
    #[inline(always)]
    pub(crate) fn where_above(self, than: Self, value: Self, other: Self) -> Self {
        Self(std::array::from_fn(|i| if self.0[i] > than.0[i] { value.0[i] } else { other.0[i] }))
    }
}

/// Three coordinates of sixteen points or vectors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes3 {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) z: Lanes,
}

impl Lanes3 {
    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> Lanes {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The dot products with one vector.
    #[inline(always)]
    pub(crate) fn along(self, [x, y, z]: [f32; 3]) -> Lanes {
        self.x * x + self.y * y + self.z * z
    }

    /// The vectors from each of these points to one point.
    #[inline(always)]
    pub(crate) fn to(self, [x, y, z]: [f32; 3]) -> Self {
        Self {
            x: Lanes::splat(x) - self.x,
            y: Lanes::splat(y) - self.y,
            z: Lanes::splat(z) - self.z,
        }
    }
}

/// Does work compiled for the best instructions that this CPU has. What is called in it
/// takes part where it is inlined.
pub(crate) fn on_best<T>(work: impl FnOnce() -> T) -> T {
    dispatch!(Level::new(), _simd => work())
}
