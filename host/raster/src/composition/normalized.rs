//! The mean of splats that are about as far away as the nearest.

use super::grid::N_SQUARES;
use super::lines::Lines;
use super::moments;
use super::tile::{List, Tile};
use super::view::{Depths, Kind, Splats};
use crate::lanes::{F, WIDTH};
use fearless_simd::prelude::*;

impl Tile {
    /// Shows means, by opacity, of all splats whose distance differs from that of the nearest which is at least half
    /// opaque by at most this share of it; where opacities sum up to less than 1, their sum is what is covered.
    #[inline(always)]
    pub(super) fn normalized<S: Simd>(
        &mut self,
        simd: S,
        splats: &Splats<'_>,
        depths: Depths,
        list: List<'_>,
        tolerance: f32,
    ) {
        let n = splats.n_payloads;
        let nearest = self.find_nearest(simd, splats.kind, list, None).distances;
        for &number in list.of_tile {
            let splat = &list.seen[number as usize];
            let payload = &splats.payloads[number as usize * n..][..n];
            let lines = Lines::new(simd, splat, &self.place);
            for square in self.squares(splat) {
                let hit = match splats.kind {
                    Kind::Planar => lines.hit::<true>(simd, square),
                    Kind::Conic => lines.hit::<false>(simd, square),
                };
                let front = F::load_array_ref(simd, &nearest[square]);
                let end = F::load_array_ref(simd, &self.end[square]);
                let is_there = front.simd_lt(F::splat(simd, f32::INFINITY));
                let apart = (hit.distance - front).abs();
                let is_near = apart.simd_le(front.abs() * tolerance);
                let counts = hit.inside & is_there & is_near & hit.distance.simd_lt(end);
                if !counts.any_true() {
                    continue;
                }
                let opacity = lines.opacity(simd, counts, hit.r2);
                // Weights are always needed.
                self.add(simd, square, opacity, payload, Some(hit.distance));
                moments::add(simd, self.moments.get_mut(square), opacity, hit.distance);
            }
        }
        for (square, nearest) in nearest.iter().enumerate() {
            for (lane, distance) in nearest.iter().enumerate() {
                if depths.median && distance.is_finite() {
                    self.median[square][lane] = *distance;
                }
            }
        }
        self.divide(n);
    }

    /// Divides sums by those of weights where these are larger than 1.
    fn divide(&mut self, n_payloads: usize) {
        for square in 0..N_SQUARES {
            for lane in 0..WIDTH {
                let weight = self.distances[square][1][lane].max(1.0);
                for sums in &mut self.sums[square * n_payloads..][..n_payloads] {
                    sums.iter_mut().for_each(|sum| sum[lane] /= weight);
                }
                if let Some(moments) = self.moments.get_mut(square) {
                    moments.divide(lane, weight);
                }
            }
        }
    }
}
