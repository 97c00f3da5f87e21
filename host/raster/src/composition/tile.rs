//! One tile of a picture: goes through its list of splats, sixteen pixels at once.

use super::footprint::LOW_PASS;
use super::sorting::Visible;
use super::view::{Depths, Kind, Splats, View};
use crate::lanes::{F, M, U, WIDTH, power_of_2, smaller};
use fearless_simd::prelude::*;

/// Side of a tile in pixels.
pub(super) const SIZE: usize = 32;
/// Side of a square of pixels that are drawn at once.
const SIDE: usize = 4;
const ACROSS: usize = SIZE / SIDE;
const N_SQUARES: usize = ACROSS * ACROSS;

/// No splat hides more than this.
///
/// Source: Kerbl et al. 2023, appendix C.
const MOST_OPACITY: f32 = 0.99;

/// Where less than this is let through nothing more is added: what is left out is at most as much of the largest value.
///
/// Source: Kerbl et al. 2023, appendix C.
const LEAST_LEFT: f32 = 1e-4;

type Lanes = [f32; WIDTH];

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
    corner: [usize; 2],
    size: [usize; 2],
    near: f32,
    orthographic: bool,
    /// Share of the light that is let through.
    left: Vec<Lanes>,
    /// Sums of vectors, four components each.
    sums: Vec<[Lanes; 4]>,
    /// Sums of distances and of weights.
    distances: Vec<[Lanes; 2]>,
    median: Vec<Lanes>,
    /// Distances behind which nothing is seen.
    end: Vec<Lanes>,
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
}

/// The place of a lane of a square in the tile.
#[inline(always)]
fn place(square: usize, lane: usize) -> [usize; 2] {
    [square % ACROSS * SIDE + lane % SIDE, square / ACROSS * SIDE + lane / SIDE]
}

impl Tile {
    /// Empties it for another part of the picture.
    pub(super) fn begin(&mut self, splats: &Splats<'_>, view: &View, corner: [usize; 2]) {
        let [width, height] = view.size_px.map(|side| side as usize);
        self.corner = corner;
        self.size = [SIZE.min(width - corner[0]), SIZE.min(height - corner[1])];
        (self.near, self.orthographic) = (view.near, view.orthographic);
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

    /// Columns and rows of squares that a splat touches.
    #[inline(always)]
    fn squares(&self, splat: &Visible) -> [usize; 4] {
        let [left, top, right, bottom] = splat.pixels.map(usize::from);
        let within = |at: usize, axis: usize| at.saturating_sub(self.corner[axis]).min(SIZE);
        let [left, right] = [left, right].map(|x| within(x, 0));
        let [top, bottom] = [top, bottom].map(|y| within(y, 1));
        [left / SIDE, top / SIDE, right.div_ceil(SIDE), bottom.div_ceil(SIDE)]
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
            let [x0, y0, x1, y1] = self.squares(splat);
            let lines = Lines::new(simd, splat, self);
            let (mut column, mut row) = (x0, y0);
            while row < y1 {
                let square = row * ACROSS + column;
                column += 1;
                if column == x1 {
                    (column, row) = (x0, row + 1);
                }
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
            }
        }
    }

    /// Adds a splat's vectors, and its distance, to a square.
    #[inline(always)]
    fn add<S: Simd>(
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
            let mut nearest = [[f32::INFINITY; WIDTH]; N_SQUARES];
            let mut numbers = [[u32::MAX; WIDTH]; N_SQUARES];
            for &number in list.of_tile {
                let splat = &list.seen[number as usize];
                let [x0, y0, x1, y1] = self.squares(splat);
                let lines = Lines::new(simd, splat, self);
                let (mut column, mut row) = (x0, y0);
                while row < y1 {
                    let square = row * ACROSS + column;
                    column += 1;
                    if column == x1 {
                        (column, row) = (x0, row + 1);
                    }
                    let hit = match splats.kind {
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
                    let least = match samples {
                        None => F::splat(simd, 0.5),
                        Some(_) => self.chance(simd, square, number, sample),
                    };
                    let opacity = lines.opacity(simd, counts, hit.r2);
                    let wins = counts & opacity.simd_ge(least);
                    wins.select(hit.distance, known).store_array(&mut nearest[square]);
                    let own = U::load_array_ref(simd, &numbers[square]);
                    wins.select(U::splat(simd, number), own).store_array(&mut numbers[square]);
                }
            }
            self.count(splats, depths, &nearest, &numbers, 1.0 / n_samples as f32);
        }
    }

    /// A number from 0 to 1 for each pixel of a square, of a splat and a sample.
    #[inline(always)]
    fn chance<S: Simd>(&self, simd: S, square: usize, number: u32, sample: u32) -> F<S> {
        let pixel: [u32; WIDTH] = std::array::from_fn(|lane| {
            let [x, y] = place(square, lane);
            ((self.corner[1] + y) as u32) << 16 | (self.corner[0] + x) as u32
        });
        let seed = hash(number ^ sample.wrapping_mul(0x9e37_79b9));
        let mut h = U::load_array(simd, pixel) ^ seed;
        h = (h ^ (h >> 16)) * 0x7feb_352d;
        h = (h ^ (h >> 15)) * 0x846c_a68b;
        h = h ^ (h >> 16);
        (h >> 8).to_float::<F<S>>() * (1.0 / 16_777_216.0)
    }

    /// Adds the share of a sample to what pixels show.
    fn count(
        &mut self,
        splats: &Splats<'_>,
        depths: Depths,
        nearest: &[Lanes; N_SQUARES],
        numbers: &[[u32; WIDTH]; N_SQUARES],
        share: f32,
    ) {
        let n = splats.n_payloads;
        for square in 0..N_SQUARES {
            for lane in 0..WIDTH {
                let number = numbers[square][lane];
                if number == u32::MAX {
                    continue;
                }
                let payload = &splats.payloads[number as usize * n..][..n];
                for (sums, vector) in self.sums[square * n..].iter_mut().zip(payload) {
                    for (sum, value) in sums.iter_mut().zip(vector) {
                        sum[lane] += share * value;
                    }
                }
                let distance = nearest[square][lane];
                if depths.expected {
                    self.distances[square][0][lane] += share * distance;
                    self.distances[square][1][lane] += share;
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

/// Columns and rows of the pixels of a square.
const COLUMNS: Lanes =
    [0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0];
const ROWS: Lanes =
    [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0];

/// A footprint as pixels of a tile meet it.
struct Lines<S: Simd> {
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
struct Hit<S: Simd> {
    inside: M<S>,
    /// Twice the exponent.
    r2: F<S>,
    distance: F<S>,
}

impl<S: Simd> Lines<S> {
    #[inline(always)]
    fn new(simd: S, splat: &Visible, tile: &Tile) -> Self {
        let footprint = &splat.footprint;
        let [x, y] = [0, 1].map(|i| tile.corner[i] as f32 + 0.5 - footprint.center[i]);
        let distance = footprint.distance;
        Self {
            shape: footprint.shape,
            distance,
            divisor: if tile.orthographic { [0.0, 0.0, 1.0] } else { distance },
            opacity: footprint.opacity.min(1.0),
            cutoff: F::splat(simd, splat.cutoff),
            near: F::splat(simd, tile.near),
            x: F::load_array_ref(simd, &COLUMNS) + x,
            y: F::load_array_ref(simd, &ROWS) + y,
        }
    }

    #[inline(always)]
    fn hit<const PLANAR: bool>(&self, simd: S, square: usize) -> Hit<S> {
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
    fn opacity(&self, simd: S, counts: M<S>, r2: F<S>) -> F<S> {
        let zero = F::splat(simd, 0.0);
        let exponent = counts.select(r2, zero) * (-0.5 * std::f32::consts::LOG2_E);
        let opacity = smaller(power_of_2(exponent) * self.opacity, F::splat(simd, MOST_OPACITY));
        counts.select(opacity, zero)
    }
}
