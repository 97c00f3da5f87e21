//! The rasteriser of one tile: binned blocks of surfels, drawn front to back against a coarse depth buffer of 8 by
//! 8 pixels, with SIMD over squares of 4 by 4 pixels.
//!
//! A first pass finds the nearest surfels (the depth buffer), a second adds up the weighted attributes of those
//! within the depth tolerance of it.

pub(crate) mod layout;
mod lines;
mod squares;

use crate::block_splats::{AllSplats, Pixels, overlap};
use crate::coverage::CELL;
use crate::lanes::{F, U, V, WIDTH, power_of_2};
use crate::local::Local;
use crate::picture::{Band, Spent, Timer};
use crate::resolve::Scene;
use crate::splat::{BACK, Splat};
use fearless_simd::prelude::*;
use layout::{N_NORMAL_SUMS, N_SUMS, SIDE, TILE};
use lines::PlaneEquations;
use squares::Squares;

/// Squares of a tile.
const SQUARES: [usize; 2] = [TILE[0] / SIDE, TILE[1] / SIDE];
const N_SQUARES: usize = SQUARES[0] * SQUARES[1];
/// Squares along a side of a cell of the coarse depth buffer, by which occluded blocks are left out.
const DEPTH_CELL: usize = 2;
const CELLS: [usize; 2] = [SQUARES[0] / DEPTH_CELL, SQUARES[1] / DEPTH_CELL];

/// A splat of a tile that may blend.
struct Met {
    splat: Splat,
    /// Squares of its box, row by row, in which it may do so; all where there are more than 64.
    squares: u64,
}

/// Scratch memory of a thread.
pub(crate) struct Tile {
    /// First pixel in the picture.
    pub(crate) corner: [i32; 2],
    /// Pixels within the picture.
    pub(crate) size: [usize; 2],
    pub(crate) depth: Vec<[f32; WIDTH]>,
    /// Numbers of the nearest surfels; 0 where nothing is.
    pub(crate) number: Vec<[u32; WIDTH]>,
    /// Sums of each square, as many as are added up.
    sums: Vec<[f32; WIDTH]>,
    met: Vec<Met>,
    /// What varies over them.
    locals: Vec<Local>,
    /// The coarse depth buffer: the largest distance in each cell, infinite where a pixel is empty; not known where NaN.
    farthest: [f32; CELLS[0] * CELLS[1]],
}

impl Tile {
    pub(crate) fn new() -> Self {
        Self {
            corner: [0; 2],
            size: [0; 2],
            depth: vec![[f32::INFINITY; WIDTH]; N_SQUARES],
            number: vec![[0; WIDTH]; N_SQUARES],
            sums: vec![[0.0; WIDTH]; N_SUMS * N_SQUARES],
            met: Vec::new(),
            locals: Vec::new(),
            farthest: [f32::INFINITY; CELLS[0] * CELLS[1]],
        }
    }

    /// The square at a column and a row of squares.
    #[inline(always)]
    pub(crate) fn square(column: usize, row: usize) -> usize {
        row * SQUARES[0] + column
    }

    /// The sums of a square, where so many are added up.
    #[inline(always)]
    pub(crate) fn sums(&self, square: usize, n_sums: usize) -> &[[f32; WIDTH]] {
        &self.sums[n_sums * square..][..n_sums]
    }

    /// Says which cells of the picture hold surfels.
    pub(crate) fn mark(&self, band: &mut Band<'_>) {
        let squares = CELL / SIDE;
        let first = self.corner[0] as usize / CELL;
        for (row, cells) in band.cells.chunks_exact_mut(band.cells_across).enumerate() {
            let here = &mut cells[first..first + self.size[0].div_ceil(CELL)];
            for (column, holds) in here.iter_mut().enumerate() {
                let rows = squares * row..squares * (row + 1);
                *holds = rows.into_iter().any(|row| {
                    let of_row = &self.number[Self::square(squares * column, row)..][..squares];
                    of_row.iter().flatten().any(|&number| number != 0)
                });
            }
        }
    }

    /// Empties it for another part of the picture.
    fn begin(&mut self, corner: [usize; 2], size: [usize; 2]) {
        self.corner = corner.map(|at| at as i32);
        self.size = size;
        self.depth.fill([f32::INFINITY; WIDTH]);
        self.number.fill([0; WIDTH]);
        self.met.clear();
        self.locals.clear();
        self.farthest.fill(f32::INFINITY);
        // Pixels beyond the picture's edge are as near as can be: nothing waits for them to be filled.
        for row in 0..SQUARES[1] {
            for column in 0..SQUARES[0] {
                if SIDE * column + SIDE > size[0] || SIDE * row + SIDE > size[1] {
                    let depth = &mut self.depth[Self::square(column, row)];
                    for (i, depth) in depth.iter_mut().enumerate() {
                        if SIDE * column + i % SIDE >= size[0] || SIDE * row + i / SIDE >= size[1] {
                            *depth = f32::NEG_INFINITY;
                        }
                    }
                }
            }
        }
    }

    /// Whether everything is nearer than a distance in a part of the picture, by the coarse depth buffer.
    fn is_occluded(&mut self, pixels: &Pixels, nearest: f32) -> bool {
        let [x0, y0, x1, y1] = self.cells(pixels);
        for row in y0..y1 {
            for column in x0..x1 {
                if self.farthest_in(column, row) >= nearest {
                    return false;
                }
            }
        }
        true
    }

    fn farthest_in(&mut self, column: usize, row: usize) -> f32 {
        let at = row * CELLS[0] + column;
        if self.farthest[at].is_nan() {
            let mut most = f32::NEG_INFINITY;
            for y in DEPTH_CELL * row..DEPTH_CELL * (row + 1) {
                for depths in &self.depth[Self::square(DEPTH_CELL * column, y)..][..DEPTH_CELL] {
                    most = depths.iter().fold(most, |most, &d| if d > most { d } else { most });
                }
            }
            self.farthest[at] = most;
        }
        self.farthest[at]
    }

    /// Columns and rows of cells that a part of the picture touches.
    fn cells(&self, pixels: &Pixels) -> [usize; 4] {
        let [x0, y0, x1, y1] = self.within(pixels);
        let cell = DEPTH_CELL * SIDE;
        [x0 / cell, y0 / cell, x1.div_ceil(cell), y1.div_ceil(cell)]
    }

    /// A part of the picture in the tile's own pixels.
    #[inline(always)]
    fn within(&self, pixels: &Pixels) -> [usize; 4] {
        let [w, h] = self.size.map(|side| side as i32);
        let x = |x: i32| (x - self.corner[0]).clamp(0, w) as usize;
        let y = |y: i32| (y - self.corner[1]).clamp(0, h) as usize;
        [x(pixels[0]), y(pixels[1]), x(pixels[2]), y(pixels[3])]
    }

    /// Finds the nearest surfels of a tile.
    #[inline(always)]
    pub(crate) fn nearest<S: Simd>(
        &mut self,
        simd: S,
        corner: [usize; 2],
        size: [usize; 2],
        all: &AllSplats<'_>,
        blocks: &[u32],
        (timer, spent): (&mut Timer, &mut Spent),
    ) {
        self.begin(corner, size);
        let [x, y] = self.corner;
        let here = [x, y, x + size[0] as i32, y + size[1] as i32];
        for &at in blocks {
            let (placed, near) = all.block(at);
            if self.is_occluded(&placed.pixels, placed.nearest) {
                all.tile_is_done(at);
                continue;
            }
            let is_new = timer.runs() && !all.is_made(at);
            if is_new {
                spent.nearest += timer.lap();
            }
            let block = all.of(simd, at);
            if is_new {
                spent.place += timer.lap();
            }
            let mut first = 0;
            for (pixels, end) in &block.groups {
                let of_group = &block.splats[first..*end];
                first = *end;
                if !overlap(pixels, &here) {
                    continue;
                }
                for splat in of_group.iter().filter(|splat| overlap(&splat.pixels, &here)) {
                    self.meet(simd, splat, block.local(splat), near);
                }
            }
            drop(block);
            all.tile_is_done(at);
            let [x0, y0, x1, y1] = self.cells(&placed.pixels);
            for row in y0..y1 {
                self.farthest[row * CELLS[0] + x0..row * CELLS[0] + x1].fill(f32::NAN);
            }
        }
    }

    /// Takes a splat in, where any of it may blend: what is behind the surface now will be so at the end.
    #[inline(always)]
    fn meet<S: Simd>(&mut self, simd: S, splat: &Splat, own: Option<&Local>, near: f32) {
        let squares = match own {
            None => self.keep_nearest::<S, false>(simd, splat, &NOTHING, near),
            Some(own) => self.keep_nearest::<S, true>(simd, splat, own, near),
        };
        if squares == 0 {
            return;
        }
        match own {
            // Straight to where it stays: read back from where it was changed, it would be waited for.
            None => self.met.push(Met { splat: *splat, squares }),
            Some(own) => {
                self.locals.push(*own);
                let local = self.locals.len() as u32;
                self.met.push(Met { splat: Splat { local, ..*splat }, squares });
            }
        }
    }

    /// Keeps a splat where it is the nearest so far; of equal ones the first by number. Returns the
    /// squares in which it may blend, as `Met` has them. What is `LOCAL` may be cut.
    #[inline(always)]
    fn keep_nearest<S: Simd, const LOCAL: bool>(
        &mut self,
        simd: S,
        splat: &Splat,
        own_parts: &Local,
        near: f32,
    ) -> u64 {
        let lines = PlaneEquations::new(simd, splat, self.corner, near);
        let squares = Squares::new(self.within(&splat.pixels));
        let own = U::splat(simd, splat.number);
        let mut met = 0;
        for row in squares.rows() {
            let in_row = squares.in_row(row);
            for column in squares.columns() {
                let mut hit = lines.hit(splat, column, row, squares.in_column(column) & in_row);
                if LOCAL {
                    hit.inside &= !own_parts.cuts(hit.u, hit.v);
                }
                let at = Self::square(column, row);
                let depth = F::load_array_ref(simd, &self.depth[at]);
                let blends = hit.inside & hit.brought_nearer(splat).simd_le(depth);
                if !blends.any_true() {
                    continue;
                }
                met |= squares.bit(column, row);
                let number = U::load_array_ref(simd, &self.number[at]);
                // Without the highest bit, which is the side.
                let tie = hit.distance.simd_eq(depth) & (own << 1).simd_lt(number << 1);
                let wins = hit.inside & (hit.distance.simd_lt(depth) | tie);
                wins.select(hit.distance, depth).store_array(&mut self.depth[at]);
                wins.select(own, number).store_array(&mut self.number[at]);
            }
        }
        met
    }

    /// Adds up what blends with the nearest surfels.
    #[inline(always)]
    pub(crate) fn blend<S: Simd>(&mut self, simd: S, scene: &Scene<'_>) {
        match scene.n_sums {
            N_NORMAL_SUMS => self.blend_sums::<S, N_NORMAL_SUMS>(simd, scene),
            _ => self.blend_sums::<S, N_SUMS>(simd, scene),
        }
    }

    #[inline(always)]
    fn blend_sums<S: Simd, const N: usize>(&mut self, simd: S, scene: &Scene<'_>) {
        self.sums[..N * N_SQUARES].fill([0.0; WIDTH]);
        let met = std::mem::take(&mut self.met);
        let locals = std::mem::take(&mut self.locals);
        for Met { splat, squares } in &met {
            let in_view = &scene.clouds[splat.cloud as usize];
            let own = splat.attributes::<N>(in_view, scene.linear_of_srgb);
            let near = in_view.eye.near;
            match (splat.local as usize).checked_sub(1).and_then(|at| locals.get(at)) {
                None => self.add::<S, false, N>(simd, splat, *squares, own, &NOTHING, near),
                Some(parts) => self.add::<S, true, N>(simd, splat, *squares, own, parts, near),
            }
        }
        (self.met, self.locals) = (met, locals);
    }

    /// Adds up one splat. What is `LOCAL` may be cut, and may have a normal field.
    #[inline(always)]
    fn add<S: Simd, const LOCAL: bool, const N: usize>(
        &mut self,
        simd: S,
        splat: &Splat,
        met: u64,
        own: [f32; N],
        parts: &Local,
        near: f32,
    ) {
        let lines = PlaneEquations::new(simd, splat, self.corner, near);
        let squares = Squares::new(self.within(&splat.pixels));
        let (of_all, share) = (own.map(|own| F::splat(simd, own)), splat.share);
        for row in squares.rows() {
            let in_row = squares.in_row(row);
            for column in squares.columns() {
                if met & squares.bit(column, row) == 0 {
                    continue;
                }
                let mut hit = lines.hit(splat, column, row, squares.in_column(column) & in_row);
                if LOCAL {
                    hit.inside &= !parts.cuts(hit.u, hit.v);
                }
                let at = Self::square(column, row);
                let depth = F::load_array_ref(simd, &self.depth[at]);
                let number = U::load_array_ref(simd, &self.number[at]);
                let same_side = (number ^ splat.number).simd_lt(U::splat(simd, BACK));
                let counts = hit.inside & hit.brought_nearer(splat).simd_le(depth) & same_side;
                if !counts.any_true() {
                    continue;
                }
                let weight = splat_weight(hit.r2) * share;
                let weight = counts.select(weight, F::splat(simd, 0.0));
                let mut own = of_all;
                if LOCAL && parts.has_field() {
                    // Rays beside the splat may not meet its plane at all.
                    let zero = F::splat(simd, 0.0);
                    let nothing = V { x: zero, y: zero, z: zero };
                    let normal = V::pick(counts, parts.normals(hit.u, hit.v), nothing);
                    (own[0], own[1], own[2]) = (normal.x, normal.y, normal.z);
                }
                let sums = &mut self.sums[N * at..][..N];
                for (sums, own) in sums.iter_mut().zip(own) {
                    (F::load_array_ref(simd, sums) + weight * own).store_array(sums);
                }
            }
        }
    }
}

/// Stands for what varies over a splat where nothing does.
static NOTHING: Local = Local::NONE;

/// `exp(-4 r2)`, relatively within 5e-7, for r2 from 0 to 1.
#[inline(always)]
fn splat_weight<S: Simd>(r2: F<S>) -> F<S> {
    power_of_2(r2 * (-4.0 * std::f32::consts::LOG2_E))
}

/// A vector of a square.
#[inline(always)]
pub(crate) fn vector<S: Simd>(simd: S, sums: &[[f32; WIDTH]]) -> V<S> {
    V {
        x: F::load_array_ref(simd, &sums[0]),
        y: F::load_array_ref(simd, &sums[1]),
        z: F::load_array_ref(simd, &sums[2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[inline(always)]
    fn weights<S: Simd>(simd: S, r2: [f32; WIDTH]) -> [f32; WIDTH] {
        splat_weight(F::load_array(simd, r2)).to_array()
    }

    #[test]
    fn weights_are_exponentials() {
        for step in 0..64 {
            let r2: [f32; WIDTH] = std::array::from_fn(|i| (WIDTH * step + i) as f32 / 1023.0);
            let found = dispatch!(Level::new(), simd => weights(simd, r2));
            for (r2, found) in r2.into_iter().zip(found) {
                let expected = (-4.0 * f64::from(r2)).exp();
                let error = f64::from(found) / expected - 1.0;
                assert!(error.abs() < 5e-7, "{r2}: {found} {expected}");
            }
        }
    }
}
