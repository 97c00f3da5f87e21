//! The reference: rays against discs.
//!
//! Directions follow the cosine, so that the share of rays that hit is the occlusion. They are
//! Sobol' points, scrambled for each surfel by a hash of its index and the seed: every prefix of
//! a power of two is stratified, so that more rays refine what fewer began.

use crate::beams::NEAR;
use crate::form_factor::Reach;
use crate::settings::Settings;
use crate::surfels::Surfels;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{ControlFlow, Range};
use surfelshop_api::glam::Vec2;
use surfelshop_api::job::CANCELLED;
use surfelshop_api::prelude::*;
use surfelshop_geometry::discs::{Disc, Discs, Meeting};
use surfelshop_geometry::{Cancelled, Progress};

/// Radius of a disc over that of a circle of its effective area. Circles of the cells' own areas
/// leave corners open; this one covers the corner of a square cell but for 12 % of its distance.
const COVER: f32 = 1.25;

/// Height above the surfel at which rays start, in radii of its disc: above the rounding of its
/// neighbours' planes, below what shadows it.
pub(crate) const START: f32 = 0.1;

/// Discs and what rays start from.
pub(crate) struct Tracing<'a> {
    surfels: &'a Surfels,
    /// The discs' radii, units of the box.
    radii: Vec<f32>,
    discs: Discs,
    reach: Reach,
    seed: u32,
}

/// How many rays a surfel gets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Rays that every surfel gets.
    pub(crate) least: u32,
    /// Rays that none gets more of.
    pub(crate) most: u32,
    /// Standard error below which a surfel gets no more.
    pub(crate) error: f32,
}

impl Budget {
    /// As many rays for every surfel.
    pub(crate) fn fixed(rays: u32) -> Self {
        Self { least: rays, most: rays, error: 0.0 }
    }
}

impl<'a> Tracing<'a> {
    /// The discs to trace rays at; takes a tenth of `share`.
    pub(crate) fn of(
        surfels: &'a Surfels,
        settings: &Settings,
        share: &Range<f64>,
        job: &Job<'_>,
    ) -> Result<Self> {
        let step = 0.1 * (share.end - share.start);
        let progress = |fraction| {
            job.progress(share.start + step * fraction, "sorting discs to trace rays at");
            if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let distance = surfels.max_distance(settings);
        Self::new(surfels, distance, settings.cone, settings.seed, &progress)
            .map_err(|Cancelled| Error::new(CANCELLED))
    }

    fn new(
        surfels: &'a Surfels,
        distance: f32,
        cone: bool,
        seed: u32,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let radii = radii(surfels);
        let disc = |place: usize| Disc {
            centre: surfels.positions[place],
            normal: surfels.normals[place],
            radius: radii[place],
        };
        // A ray needs one of a thousand copies; they follow each other.
        let mut discs: Vec<Disc> = (0..surfels.len()).map(disc).collect();
        discs.dedup();
        let reach = Reach::new(distance, cone);
        Ok(Self { surfels, radii, discs: Discs::build(&discs, progress)?, reach, seed })
    }

    /// The share of rays that hit, and how many there were.
    pub(crate) fn occlusion(&self, place: usize, budget: Budget) -> (f32, u32) {
        let normal = self.surfels.normals[place];
        let (u, v) = normal.any_orthonormal_pair();
        let origin = self.surfels.positions[place] + START * self.radii[place] * normal;
        let scramble = scramble(self.surfels.order[place], self.seed);
        let (mut n, mut n_hits) = (0, 0);
        while n < budget.most {
            let until =
                if n == 0 { budget.least.clamp(1, budget.most) } else { (2 * n).min(budget.most) };
            for i in n..until {
                let across = concentric(sobol(i, scramble));
                let height = (1.0 - across.length_squared()).max(0.0).sqrt();
                let direction = across.x * u + across.y * v + height * normal;
                let shades = |m: Meeting| m.front || m.distance > NEAR * m.radius;
                let distance = 0.0..self.reach.distance;
                let hits = self.reach.has(height)
                    && self.discs.is_hit(origin, direction, distance, shades);
                n_hits += u32::from(hits);
            }
            n = until;
            // As if there had been one hit and one miss more: that all of a few rays agree does not
            // mean that all will.
            let share = (n_hits as f32 + 1.0) / (n as f32 + 2.0);
            // The error of independent rays, which bounds that of stratified ones.
            if (share * (1.0 - share) / n as f32).sqrt() <= budget.error {
                break;
            }
        }
        (n_hits as f32 / n as f32, n)
    }
}

/// The radii of the discs. Surfels at one place that face the same way, which share its area among
/// them, get discs of all of it: they lie side by side in the order.
pub(crate) fn radii(surfels: &Surfels) -> Vec<f32> {
    let mut radii = Vec::with_capacity(surfels.len());
    for copies in surfels.positions.chunk_by(|a, b| a == b) {
        let places = radii.len()..radii.len() + copies.len();
        let front = surfels.normals[places.start];
        let is_front = |place: usize| surfels.normals[place].dot(front) >= 0.0;
        let area = |side: bool| -> f32 {
            let same = places.clone().filter(|&place| is_front(place) == side);
            same.map(|place| surfels.areas[place]).sum()
        };
        let [back, front] = [area(false), area(true)];
        radii.extend(places.clone().map(|place| {
            let area = if is_front(place) { front } else { back };
            COVER * (area / PI).sqrt()
        }));
    }
    radii
}

/// Two random words for a surfel.
pub(crate) fn scramble(index: u32, seed: u32) -> [u32; 2] {
    let first = hash(index ^ hash(seed));
    [first, hash(first ^ 0x9e37_79b9)]
}

/// Mixes the bits of a word (lowbias32, found by C. Wellons's search for low bias).
pub(crate) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// The point `index` of the first two dimensions of Sobol's sequence, with scrambled digits.
pub(crate) fn sobol(index: u32, scramble: [u32; 2]) -> Vec2 {
    let first = index.reverse_bits();
    let (mut second, mut direction, mut rest) = (0, 1 << 31, index);
    while rest != 0 {
        if rest & 1 != 0 {
            second ^= direction;
        }
        direction ^= direction >> 1;
        rest >>= 1;
    }
    // 24 bits, so that the number stays below 1.
    let unit = |word: u32| (word >> 8) as f32 / (1 << 24) as f32;
    Vec2::new(unit(first ^ scramble[0]), unit(second ^ scramble[1]))
}

/// Maps the unit square to the unit disc, areas to areas and neighbours to neighbours.
///
/// Source: Shirley & Chiu 1997, A low distortion map between disk and square.
pub(crate) fn concentric(point: Vec2) -> Vec2 {
    let p = 2.0 * point - 1.0;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    radius * Vec2::from_angle(angle)
}
