//! How much of a receiver's sky an emitter covers: eq. 9 of the thesis, for sixteen receivers at a
//! time.
//!
//! `f = w cos_e cos_r / (pi r^2 + A)`, with `w = A` in the first pass (eq. 10) and `A (1 - T)`
//! afterwards (eq. 11). `cos_r` is positive above the receiver's horizon and clamped below. `cos_e`
//! is signed: positive where the emitter's *back* faces the receiver. Sums are kept of `f` and of
//! `|f|`, from which those over backs and over fronts follow, each clamped (erratum T20).

use crate::lanes::{Lanes, Lanes3, WIDTH};
use crate::surfels::Surfels;
use std::f32::consts::PI;
use std::ops::Range;
use surfelshop_api::glam::Vec3;

/// Square of the distance, as a share of the emitter's area, below which two surfels coincide: a
/// thousandth of its size. Closer ones are one point, measured or stored twice; eq. 9 would have
/// the upper one hide all from the lower.
const COINCIDENT: f32 = 1e-6;

/// cos^2 of half the thesis's cone of 150 degrees (section 4.1, erratum T23).
const CONE: f32 = 0.066_987_3;

/// Which emitters count.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Distance beyond which nothing casts a shadow, units of the box.
    pub(crate) distance: f32,
    /// Square of the distance.
    pub(crate) distance_squared: f32,
    /// Square of the least cosine between the receiver's normal and an emitter: 0 for all above
    /// the horizon.
    cosine_squared: f32,
}

impl Reach {
    /// All within a distance, or only those in the thesis's cone.
    pub(crate) fn new(distance: f32, cone: bool) -> Self {
        let cosine_squared = if cone { CONE } else { 0.0 };
        Self { distance, distance_squared: distance * distance, cosine_squared }
    }

    /// Whether a direction at this cosine to the receiver's normal counts.
    pub(crate) fn has(&self, cosine: f32) -> bool {
        cosine * cosine > self.cosine_squared
    }
}

/// Sixteen receivers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Receivers {
    pub(crate) at: Lanes3,
    pub(crate) normal: Lanes3,
}

impl Receivers {
    /// The surfels of a range of at most sixteen places; the last stands in for what is missing.
    pub(crate) fn of(surfels: &Surfels, places: Range<usize>) -> Self {
        let place = |i: usize| (places.start + i).min(places.end - 1);
        let lanes = |of: &[Vec3]| Lanes3 {
            x: Lanes(std::array::from_fn(|i| of[place(i)].x)),
            y: Lanes(std::array::from_fn(|i| of[place(i)].y)),
            z: Lanes(std::array::from_fn(|i| of[place(i)].z)),
        };
        Self { at: lanes(&surfels.positions), normal: lanes(&surfels.normals) }
    }
}

/// Sums of form factors: signed, and of absolute values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums {
    pub(crate) signed: Lanes,
    pub(crate) absolute: Lanes,
}

impl Sums {
    pub(crate) const ZERO: Self = Self { signed: Lanes::ZERO, absolute: Lanes::ZERO };

    #[inline(always)]
    pub(crate) fn add(&mut self, other: Self) {
        self.signed = self.signed + other.signed;
        self.absolute = self.absolute + other.absolute;
    }

    /// What the backs of emitters cover, sums above 1 included.
    pub(crate) fn back(&self) -> [f32; WIDTH] {
        ((self.absolute + self.signed) * 0.5).0
    }

    /// What the fronts of emitters cover.
    pub(crate) fn front(&self) -> [f32; WIDTH] {
        ((self.absolute - self.signed) * 0.5).0
    }
}

/// One emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emitter {
    pub(crate) at: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) area: f32,
    /// Its area times what is left of it after the pass before.
    pub(crate) weight: f32,
}

/// What one emitter covers of each receiver's sky.
#[inline(always)]
pub(crate) fn single(receivers: &Receivers, emitter: &Emitter, reach: Reach) -> Sums {
    let to = receivers.at.to(emitter.at);
    let squared = to.dot(to);
    let above = to.dot(receivers.normal).max(0.0);
    let across = to.along(emitter.normal);
    let factor = above * emitter.weight / ((squared * PI + emitter.area) * squared);
    let coincident = Lanes::splat(COINCIDENT * emitter.area);
    let factor = squared.where_above(coincident, factor, Lanes::ZERO);
    let factor = within(squared, above, factor, reach);
    Sums { signed: factor * across, absolute: factor * across.abs() }
}

/// `factor` where an emitter counts, else 0.
#[inline(always)]
pub(crate) fn within(squared: Lanes, above: Lanes, factor: Lanes, reach: Reach) -> Lanes {
    let limit = Lanes::splat(reach.distance_squared);
    let factor = limit.where_above(squared, factor, Lanes::ZERO);
    (above * above).where_above(squared * reach.cosine_squared, factor, Lanes::ZERO)
}
