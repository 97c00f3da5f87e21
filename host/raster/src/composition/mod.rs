//! Puts splats with footprints of their own together: Gaussians in pixels or in planes, one over the other from near to
//! far, added up, the nearest alone, by chance, or the mean of those about as far away as the nearest.
//!
//! Splats that are seen are sorted by the distances of their centres, those of equal ones by their number, and put into
//! lists of the tiles that they touch; tiles go through their lists from near to far, sixteen pixels at once, until
//! nothing more is seen. The shaders of `host/render` that do the same on a device have the same rules.
//!
//! Invariants: a picture does not depend on the number of threads nor on the CPU's instructions; numbers that are not
//! finite draw nothing.
//!
//! Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering", section 6 and appendix C;
//! Huang et al. 2024, "2D Gaussian Splatting for Geometrically Accurate Radiance Fields", section 4; Kheradmand et al.
//! 2025, "Stochastic Splats".

mod footprint;
mod grid;
mod lines;
mod moments;
mod normalized;
mod sorting;
#[cfg(test)]
mod tests;
mod tile;
mod view;

pub use footprint::{FOOTPRINT_BYTES, Footprint};

pub use view::{Composition, Depths, Kind, Splats, View, Words};

use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;
use sorting::VisibleSplats;
use tile::{List, Tile, TilePicture};

/// Pictures, row by row from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// Sums of the vectors, by how much of each splat is seen; one picture for each vector of a splat.
    pub sums: Vec<Vec<[f32; 4]>>,
    /// Expected depths, scene units, 0 where nothing is; empty unless asked for.
    pub expected: Vec<f32>,
    /// Median depths, scene units, 0 where less than half of the light is kept off; empty unless asked for.
    pub median: Vec<f32>,
    /// How far splats lie apart, squared scene units, 0 where nothing is; empty unless asked for.
    pub distortion: Vec<f32>,
    /// How much there was to do.
    pub counts: Counts,
}

/// How much a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Splats that touch the picture.
    pub visible: usize,
    /// Entries of all tiles' lists.
    pub listed: usize,
}

/// Puts splats together, with memory that is used again.
#[derive(Default)]
pub struct Composer {
    seen: VisibleSplats,
    lists: Lists,
    pictures: Pictures,
}

impl Composer {
    /// The pictures of splats; `done` hears which stage is over.
    pub fn compose(
        &mut self,
        splats: &Splats<'_>,
        composition: Composition,
        depths: Depths,
        view: &View,
        done: &dyn Fn(&str),
    ) -> &Pictures {
        self.compose_with(Level::new(), splats, composition, depths, view, done)
    }

    /// The same with these instructions of the CPU.
    fn compose_with(
        &mut self,
        level: Level,
        splats: &Splats<'_>,
        composition: Composition,
        depths: Depths,
        view: &View,
        done: &dyn Fn(&str),
    ) -> &Pictures {
        self.seen.look(splats, view);
        done("splats: choosing");
        // Sums of other ways do not depend on distances; a mean's rounding does on its order.
        if matches!(composition, Composition::Over | Composition::Normalized(_)) {
            self.seen.sort();
        }
        done("splats: sorting");
        self.lists.fill(&self.seen, view);
        done("splats: listing by tile");
        let (seen, lists) = (&self.seen, &self.lists);
        let tiles: Vec<TilePicture> = (0..lists.n_tiles())
            .into_par_iter()
            .map_init(Tile::default, |tile, at| {
                let corner = lists.corner(at);
                dispatch!(level, simd => {
                    let list = List { seen: &seen.splats, of_tile: lists.of(at) };
                    draw_tile(simd, tile, splats, composition, depths, view, corner, list)
                })
            })
            .collect();
        done("splats: drawing");
        self.pictures.begin(splats.n_payloads, depths, view);
        self.pictures.gather(&tiles, lists, view);
        done("splats: gathering of tiles");
        let visible = seen.keyed.len();
        self.pictures.counts = Counts { visible, listed: lists.entries.len() };
        &self.pictures
    }
}

#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "all that a tile is made of")]
fn draw_tile<S: Simd>(
    simd: S,
    tile: &mut Tile,
    splats: &Splats<'_>,
    composition: Composition,
    depths: Depths,
    view: &View,
    corner: [usize; 2],
    list: List<'_>,
) -> TilePicture {
    tile.begin(splats, depths, view, corner);
    match (composition, splats.kind) {
        (Composition::Over, Kind::Conic) => {
            tile.blend::<S, false, true>(simd, splats, depths, list)
        }
        (Composition::Over, Kind::Planar) => {
            tile.blend::<S, true, true>(simd, splats, depths, list)
        }
        (Composition::Additive, Kind::Conic) => {
            tile.blend::<S, false, false>(simd, splats, depths, list)
        }
        (Composition::Additive, Kind::Planar) => {
            tile.blend::<S, true, false>(simd, splats, depths, list)
        }
        (Composition::Nearest, _) => tile.nearest(simd, splats, depths, list, None),
        (Composition::Stochastic(samples), _) => {
            tile.nearest(simd, splats, depths, list, Some(samples.clamp(1, 64)))
        }
        (Composition::Normalized(tolerance), _) => {
            tile.normalized(simd, splats, depths, list, tolerance)
        }
    }
    tile.picture(splats.n_payloads, depths)
}

/// For each tile the splats that touch it, in their order.
#[derive(Default)]
struct Lists {
    across: usize,
    /// Where each tile's begin, and the end.
    first: Vec<u32>,
    next: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    fn fill(&mut self, seen: &VisibleSplats, view: &View) {
        let [across, down] = view.size_px.map(|side| (side as usize).div_ceil(grid::SIZE));
        let Self { first, next, entries, .. } = self;
        self.across = across;
        first.clear();
        first.resize(across * down + 1, 0);
        for splat in &seen.keyed {
            splat.each_tile(across, |at| first[at + 1] += 1);
        }
        for at in 1..first.len() {
            first[at] += first[at - 1];
        }
        next.clone_from(first);
        entries.resize(first.last().copied().unwrap_or(0) as usize, 0);
        for splat in &seen.keyed {
            splat.each_tile(across, |at| {
                entries[next[at] as usize] = splat.number;
                next[at] += 1;
            });
        }
    }

    fn n_tiles(&self) -> usize {
        self.first.len() - 1
    }

    fn of(&self, tile: usize) -> &[u32] {
        &self.entries[self.first[tile] as usize..self.first[tile + 1] as usize]
    }

    /// The first pixel of a tile.
    fn corner(&self, tile: usize) -> [usize; 2] {
        [tile % self.across * grid::SIZE, tile / self.across * grid::SIZE]
    }
}

impl Pictures {
    /// Empties them for a view.
    fn begin(&mut self, n_payloads: usize, depths: Depths, view: &View) {
        let n = view.size_px[0] as usize * view.size_px[1] as usize;
        // All of it is written.
        self.sums.resize_with(n_payloads, Vec::new);
        self.sums.iter_mut().for_each(|sums| sums.resize(n, [0.0; 4]));
        self.expected.resize(if depths.expected { n } else { 0 }, 0.0);
        self.median.resize(if depths.median { n } else { 0 }, 0.0);
        self.distortion.resize(if depths.distortion { n } else { 0 }, 0.0);
    }

    /// Takes what tiles show.
    fn gather(&mut self, tiles: &[TilePicture], lists: &Lists, view: &View) {
        let [width, height] = view.size_px.map(|side| side as usize);
        for (at, tile) in tiles.iter().enumerate() {
            let [left, top] = lists.corner(at);
            let (columns, rows) = (grid::SIZE.min(width - left), grid::SIZE.min(height - top));
            for row in 0..rows {
                let (to, from) = ((top + row) * width + left, row * grid::SIZE);
                let (to, from) = (to..to + columns, from..from + columns);
                for (sums, own) in self.sums.iter_mut().zip(&tile.sums) {
                    sums[to.clone()].copy_from_slice(&own[from.clone()]);
                }
                for (depths, own) in
                    [(&mut self.expected, &tile.expected), (&mut self.median, &tile.median)]
                {
                    if !depths.is_empty() && !own.is_empty() {
                        let pairs = depths[to.clone()].iter_mut().zip(&own[from.clone()]);
                        pairs.for_each(|(depth, own)| *depth = view.unit * own);
                    }
                }
                if !self.distortion.is_empty() {
                    let pairs = self.distortion[to].iter_mut().zip(&tile.distortion[from]);
                    // Unit by unit: their product may leave the range of numbers where this does not.
                    pairs.for_each(|(to, own)| *to = (own * view.unit * view.unit).min(f32::MAX));
                }
            }
        }
    }
}
