//! What of a splat is linear in a pixel's place, and what squares of pixels meet of it.

use crate::lanes::{F, M, WIDTH};
use crate::splat::Splat;
use crate::tile::layout::SIDE;
use fearless_simd::prelude::*;

/// What of a splat is linear in a pixel's place, for the first square of a tile.
pub(super) struct PlaneEquations<S: Simd> {
    u: F<S>,
    v: F<S>,
    w: F<S>,
    near: F<S>,
    one: F<S>,
}

/// What of a splat a square of pixels meets.
pub(super) struct Hit<S: Simd> {
    pub(super) inside: M<S>,
    /// In units of the half axes.
    pub(super) u: F<S>,
    pub(super) v: F<S>,
    pub(super) distance: F<S>,
    pub(super) r2: F<S>,
}

/// Columns and rows of the pixels of a square.
const ACROSS: [f32; WIDTH] =
    [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const DOWN: [f32; WIDTH] =
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];

impl<S: Simd> PlaneEquations<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, splat: &Splat, corner: [i32; 2], near: f32) -> Self {
        let across = F::load_array_ref(simd, &ACROSS) + (corner[0] - splat.pixels[0]) as f32;
        let down = F::load_array_ref(simd, &DOWN) + (corner[1] - splat.pixels[1]) as f32;
        Self {
            u: across * splat.u[1] + down * splat.u[2] + splat.u[0],
            v: across * splat.v[1] + down * splat.v[2] + splat.v[0],
            w: across * splat.w[1] + down * splat.w[2] + splat.w[0],
            near: F::splat(simd, near),
            one: F::splat(simd, 1.0),
        }
    }

    /// The pixels of a square, those of a bit mask.
    #[inline(always)]
    pub(super) fn hit(&self, splat: &Splat, column: usize, row: usize, lanes: u64) -> Hit<S> {
        let (right, down) = ((SIDE * column) as f32, (SIDE * row) as f32);
        let u = self.u + (right * splat.u[1] + down * splat.u[2]);
        let v = self.v + (right * splat.v[1] + down * splat.v[2]);
        let w = self.w + (right * splat.w[1] + down * splat.w[2]);
        let scale = self.one / w;
        let (u, v) = (u * scale, v * scale);
        let r2 = u * u + v * v;
        let distance = u * splat.depth[1] + v * splat.depth[2] + splat.depth[0];
        let lanes = M::from_bitmask(r2.token(), lanes);
        let inside = lanes & r2.simd_le(self.one) & distance.simd_ge(self.near);
        Hit { inside, u, v, distance, r2 }
    }
}

impl<S: Simd> Hit<S> {
    /// Distances, brought nearer by the depth tolerance.
    #[inline(always)]
    pub(super) fn brought_nearer(&self, splat: &Splat) -> F<S> {
        self.distance * splat.drawn_near - splat.nearer
    }
}
