//! One tile of a picture: goes through its list of splats, sixteen pixels at once.

use super::grid::{ACROSS, Lanes, N_SQUARES, SIDE, SIZE};
use super::lines::{Lines, Place};
use super::moments::{self, Moments};
use super::sorting::Visible;
use super::view::{Depths, Kind, Splats, View};
use crate::lanes::{F, U, WIDTH};
use fearless_simd::prelude::*;

/// Where less than this is let through nothing more is added: what is left out is at most as much of the largest value.
///
/// Source: Kerbl et al. 2023, appendix C.
const LEAST_LEFT: f32 = 1e-4;

/// The splats that touch a tile.
#[derive(Clone, Copy)]
pub(super) struct List<'a> {
    /// All splats, by number.
    pub(super) seen: &'a [Visible],
    /// Numbers of those that touch the tile, in the order in which they are drawn.
    pub(super) of_tile: &'a [u32],
}

/// Scratch memory of a thread.
#[derive(Default)]
pub(super) struct Tile {
    pub(super) place: Place,
    size: [usize; 2],
    /// Share of the light that is let through.
    left: Vec<Lanes>,
    /// Sums of vectors, four components each.
    pub(super) sums: Vec<[Lanes; 4]>,
    /// Sums of distances and of weights.
    pub(super) distances: Vec<[Lanes; 2]>,
    pub(super) median: Vec<Lanes>,
    /// Empty unless distortion is asked for.
    pub(super) moments: Vec<Moments>,
    /// Distances behind which nothing is seen.
    pub(super) end: Vec<Lanes>,
    has_end: bool,
    /// Squares through which something is let.
    open: Vec<bool>,
    n_open: usize,
}

/// What a tile shows, row by row.
pub(super) struct TilePicture {
    pub(super) sums: Vec<Vec<[f32; 4]>>,
    pub(super) expected: Vec<f32>,
    pub(super) median: Vec<f32>,
    pub(super) distortion: Vec<f32>,
}

/// The nearest splats of the pixels of a tile.
pub(super) struct Nearest {
    /// Infinite where there is none.
    pub(super) distances: [Lanes; N_SQUARES],
    numbers: [[u32; WIDTH]; N_SQUARES],
}

/// Squares of a rectangle of them.
pub(super) struct Squares {
    first: usize,
    /// Column and row behind the last.
    end: [usize; 2],
    column: usize,
    row: usize,
}

impl Iterator for Squares {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.row >= self.end[1] {
            return None;
        }
        let square = self.row * ACROSS + self.column;
        self.column += 1;
        if self.column == self.end[0] {
            (self.column, self.row) = (self.first, self.row + 1);
        }
        Some(square)
    }
}

/// The place of a lane of a square in the tile.
#[inline(always)]
fn place(square: usize, lane: usize) -> [usize; 2] {
    [square % ACROSS * SIDE + lane % SIDE, square / ACROSS * SIDE + lane / SIDE]
}

impl Tile {
    /// Empties it for another part of the picture.
    pub(super) fn begin(
        &mut self,
        splats: &Splats<'_>,
        depths: Depths,
        view: &View,
        corner: [usize; 2],
    ) {
        let [width, height] = view.size_px.map(|side| side as usize);
        self.place = Place { corner, near: view.near, orthographic: view.orthographic };
        self.size = [SIZE.min(width - corner[0]), SIZE.min(height - corner[1])];
        let filled = |list: &mut Vec<Lanes>, value: f32| {
            list.clear();
            list.resize(N_SQUARES, [value; WIDTH]);
        };
        filled(&mut self.left, 1.0);
        filled(&mut self.median, 0.0);
        filled(&mut self.end, f32::INFINITY);
        self.sums.clear();
        self.sums.resize(N_SQUARES * splats.n_payloads, [[0.0; WIDTH]; 4]);
        self.distances.clear();
        self.distances.resize(N_SQUARES, [[0.0; WIDTH]; 2]);
        self.moments.clear();
        self.moments.resize(if depths.distortion { N_SQUARES } else { 0 }, Moments::default());
        self.open.clear();
        self.open.resize(N_SQUARES, false);
        self.n_open = 0;
        self.has_end = !splats.surface.is_empty();
        for square in 0..N_SQUARES {
            for lane in 0..WIDTH {
                let [x, y] = place(square, lane);
                if x >= self.size[0] || y >= self.size[1] {
                    self.left[square][lane] = 0.0;
                    continue;
                }
                self.open[square] = true;
                let pixel = (corner[1] + y) * width + corner[0] + x;
                if let Some(&end) = splats.surface.get(pixel)
                    && end > 0.0
                {
                    self.end[square][lane] = end;
                }
            }
            self.n_open += usize::from(self.open[square]);
        }
    }

    /// Squares that a splat touches, row by row.
    #[inline(always)]
    pub(super) fn squares(&self, splat: &Visible) -> Squares {
        let [left, top, right, bottom] = splat.pixels.map(usize::from);
        let within = |at: usize, axis: usize| at.saturating_sub(self.place.corner[axis]).min(SIZE);
        let [left, right] = [left, right].map(|x| within(x, 0));
        let [top, bottom] = [top, bottom].map(|y| within(y, 1));
        let (column, row) = (left / SIDE, top / SIDE);
        Squares { first: column, end: [right.div_ceil(SIDE), bottom.div_ceil(SIDE)], column, row }
    }

    /// Adds up splats, each over those behind it where `OVER`.
    #[inline(always)]
    pub(super) fn blend<S: Simd, const PLANAR: bool, const OVER: bool>(
        &mut self,
        simd: S,
        splats: &Splats<'_>,
        depths: Depths,
        list: List<'_>,
    ) {
        let n = splats.n_payloads;
        for &number in list.of_tile {
            if self.n_open == 0 {
                break;
            }
            let splat = &list.seen[number as usize];
            let payload = &splats.payloads[number as usize * n..][..n];
            let lines = Lines::new(simd, splat, &self.place);
            for square in self.squares(splat) {
                if !self.open[square] {
                    continue;
                }
                let hit = lines.hit::<PLANAR>(simd, square);
                let left = F::load_array_ref(simd, &self.left[square]);
                let mut inside = hit.inside & left.simd_gt(F::splat(simd, 0.0));
                if self.has_end {
                    inside &= hit.distance.simd_lt(F::load_array_ref(simd, &self.end[square]));
                }
                if !inside.any_true() {
                    continue;
                }
                let opacity = lines.opacity(simd, inside, hit.r2);
                let weight = if OVER { opacity * left } else { opacity };
                if depths.median && OVER {
                    let half = F::splat(simd, 0.5);
                    let passes = left.simd_gt(half) & (left - weight).simd_le(half);
                    let median = F::load_array_ref(simd, &self.median[square]);
                    passes.select(hit.distance, median).store_array(&mut self.median[square]);
                }
                if OVER {
                    let still = left - weight;
                    let shut = still.simd_lt(F::splat(simd, LEAST_LEFT));
                    shut.select(F::splat(simd, 0.0), still).store_array(&mut self.left[square]);
                    if shut.all_true() {
                        self.open[square] = false;
                        self.n_open -= 1;
                    }
                }
                self.add(simd, square, weight, payload, depths.expected.then_some(hit.distance));
                moments::add(simd, self.moments.get_mut(square), weight, hit.distance);
            }
        }
    }

    /// Adds a splat's vectors, and its distance, to a square.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        square: usize,
        weight: F<S>,
        payload: &[[f32; 4]],
        distance: Option<F<S>>,
    ) {
        for (sums, vector) in self.sums[square * payload.len()..].iter_mut().zip(payload) {
            for (sum, value) in sums.iter_mut().zip(vector) {
                (F::load_array_ref(simd, sum) + weight * *value).store_array(sum);
            }
        }
        if let Some(distance) = distance {
            let [distances, weights] = &mut self.distances[square];
            let nothing = weight.simd_eq(F::splat(simd, 0.0));
            let seen = nothing.select(F::splat(simd, 0.0), weight * distance);
            (F::load_array_ref(simd, distances) + seen).store_array(distances);
            (F::load_array_ref(simd, weights) + weight).store_array(weights);
        }
    }

    /// Shows the nearest splats: those at least half opaque, or, of so many samples, those that chance leaves.
    #[inline(always)]
    pub(super) fn nearest<S: Simd>(
        &mut self,
        simd: S,
        splats: &Splats<'_>,
        depths: Depths,
        list: List<'_>,
        samples: Option<u32>,
    ) {
        let n_samples = samples.unwrap_or(1);
        for sample in 0..n_samples {
            let nearest = self.find_nearest(simd, splats.kind, list, samples.map(|_| sample));
            self.count(splats, depths, &nearest, 1.0 / n_samples as f32);
        }
    }

    /// The nearest splats that are at least half opaque, or, in a sample, that chance leaves.
    #[inline(always)]
    pub(super) fn find_nearest<S: Simd>(
        &self,
        simd: S,
        kind: Kind,
        list: List<'_>,
        sample: Option<u32>,
    ) -> Nearest {
        let mut nearest = [[f32::INFINITY; WIDTH]; N_SQUARES];
        let mut numbers = [[u32::MAX; WIDTH]; N_SQUARES];
        for &number in list.of_tile {
            let splat = &list.seen[number as usize];
            let lines = Lines::new(simd, splat, &self.place);
            for square in self.squares(splat) {
                let hit = match kind {
                    Kind::Planar => lines.hit::<true>(simd, square),
                    Kind::Conic => lines.hit::<false>(simd, square),
                };
                let known = F::load_array_ref(simd, &nearest[square]);
                let end = F::load_array_ref(simd, &self.end[square]);
                // Of equal distances the first by number, as lists have them.
                let nearer = hit.distance.simd_lt(known) & hit.distance.simd_lt(end);
                let counts = hit.inside & nearer;
                if !counts.any_true() {
                    continue;
                }
                let least = match sample {
                    None => F::splat(simd, 0.5),
                    Some(sample) => self.chance(simd, square, number, sample),
                };
                let opacity = lines.opacity(simd, counts, hit.r2);
                let wins = counts & opacity.simd_ge(least);
                wins.select(hit.distance, known).store_array(&mut nearest[square]);
                let own = U::load_array_ref(simd, &numbers[square]);
                wins.select(U::splat(simd, number), own).store_array(&mut numbers[square]);
            }
        }
        Nearest { distances: nearest, numbers }
    }

    /// A number from 0 to 1 for each pixel of a square, of a splat and a sample.
    #[inline(always)]
    fn chance<S: Simd>(&self, simd: S, square: usize, number: u32, sample: u32) -> F<S> {
        let pixel: [u32; WIDTH] = std::array::from_fn(|lane| {
            let [x, y] = place(square, lane);
            ((self.place.corner[1] + y) as u32) << 16 | (self.place.corner[0] + x) as u32
        });
        let seed = hash(number ^ sample.wrapping_mul(0x9e37_79b9));
        let mut h = U::load_array(simd, pixel) ^ seed;
        h = (h ^ (h >> 16)) * 0x7feb_352d;
        h = (h ^ (h >> 15)) * 0x846c_a68b;
        h = h ^ (h >> 16);
        (h >> 8).to_float::<F<S>>() * (1.0 / 16_777_216.0)
    }

    /// Adds the share of a sample to what pixels show.
    fn count(&mut self, splats: &Splats<'_>, depths: Depths, nearest: &Nearest, share: f32) {
        let n = splats.n_payloads;
        for square in 0..N_SQUARES {
            for lane in 0..WIDTH {
                let number = nearest.numbers[square][lane];
                if number == u32::MAX {
                    continue;
                }
                let payload = &splats.payloads[number as usize * n..][..n];
                for (sums, vector) in self.sums[square * n..].iter_mut().zip(payload) {
                    for (sum, value) in sums.iter_mut().zip(vector) {
                        sum[lane] += share * value;
                    }
                }
                let distance = nearest.distances[square][lane];
                if depths.expected {
                    self.distances[square][0][lane] += share * distance;
                    self.distances[square][1][lane] += share;
                }
                if let Some(moments) = self.moments.get_mut(square) {
                    moments.add_to_lane(lane, share, distance);
                }
                if depths.median {
                    let before = self.left[square][lane];
                    self.left[square][lane] -= share;
                    if before > 0.5 && self.left[square][lane] <= 0.5 {
                        self.median[square][lane] = distance;
                    }
                }
            }
        }
    }

    /// What the tile shows.
    pub(super) fn picture(&self, n_payloads: usize, depths: Depths) -> TilePicture {
        let n = SIZE * SIZE;
        let wanted = |wanted: bool| if wanted { vec![0.0; n] } else { Vec::new() };
        let mut picture = TilePicture {
            sums: vec![vec![[0.0; 4]; n]; n_payloads],
            expected: wanted(depths.expected),
            median: wanted(depths.median),
            distortion: wanted(depths.distortion),
        };
        for square in 0..N_SQUARES {
            for lane in 0..WIDTH {
                let [x, y] = place(square, lane);
                let to = y * SIZE + x;
                for (own, sums) in picture.sums.iter_mut().zip(&self.sums[square * n_payloads..]) {
                    own[to] = sums.map(|sum| sum[lane]);
                }
                if depths.expected {
                    let [distance, weight] = self.distances[square].map(|sums| sums[lane]);
                    picture.expected[to] = if weight > 0.0 { distance / weight } else { 0.0 };
                }
                if depths.median {
                    picture.median[to] = self.median[square][lane];
                }
                if let Some(moments) = self.moments.get(square) {
                    picture.distortion[to] = moments.distortion(lane);
                }
            }
        }
        picture
    }
}

/// Bits that look random, of a number; the same as in the shaders.
///
/// Source: Wellons 2018, "Prospecting for Hash Functions", the function lowbias32.
fn hash(number: u32) -> u32 {
    let mut h = number;
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}
