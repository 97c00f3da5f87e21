//! A software rasteriser of surfels on the CPU: what the shaders of the surface buffer do, without a
//! graphics device.
//!
//! Blocks of surfels are culled, chosen fine or coarse, sorted from near to far and drawn tile by tile,
//! sixteen surfels and sixteen pixels at once; what lies behind a tile that is filled is left out. The
//! rules are those of the shaders in `host/render`: a disc in its tangent plane, widened by the screen-space low-pass;
//! the nearest one decides the depth, and those within the depth tolerance blend with it.
//!
//! Splats with footprints of their own are put together in the module [`composition`].
//!
//! Invariants: this crate knows no graphics API; a picture does not depend on the number of threads nor
//! on the CPU's instructions; what is culled would not have been visible.

mod block_splats;
mod cloud;
mod columns;
pub mod composition;
mod coverage;
mod cull;
mod disc;
mod fields;
mod lanes;
mod level_of_detail;
mod local;
mod pack;
mod picture;
mod places;
mod resolve;
mod splat;
#[cfg(test)]
mod tests;
mod tile;
mod view;

pub use cloud::Cloud;
pub use columns::{Albedo, Columns, Geometry, Merging, Sources, radius_drawn};
pub use coverage::{Coverage, Rectangle};
pub use fields::Splats;
pub use level_of_detail::merge::{Sample, merge_all, merge_neighbours};
pub use level_of_detail::repaint::Paint;
pub use picture::{Clocks, DrawCounts, Mode, Parts, Picture, Spent};
pub use places::{Part, places};
pub use view::View;

use block_splats::{AllSplats, by_band, is_across};
use cloud::CloudInView;
use coverage::CELL;
use cull::VisibleBlock;
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use picture::{Band, Timer};
use rayon::prelude::*;
use resolve::Scene;
use resolve::rims::{self, BackPixel};
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use tile::Tile;
use tile::layout::TILE;
use view::Eye;

/// Surfels are drawn in groups of so many; blocks begin with one.
pub const GROUP: usize = lanes::WIDTH;

/// Draws clouds into a picture, whose memory is used again; `linear_of_srgb` holds the linear values of
/// all 8-bit codes.
///
/// # Panics
/// Where parts of columns are to be drawn that are not in order, and there is nothing to order them by:
/// [`Cloud::geometry`].
pub fn draw(
    clouds: &[Cloud<'_>],
    view: &View,
    parts: Parts,
    linear_of_srgb: &[f32; 256],
    picture: &mut Picture,
) {
    draw_with(Level::new(), clouds, view, parts, linear_of_srgb, picture);
}

/// The same with these instructions of the CPU.
fn draw_with(
    level: Level,
    clouds: &[Cloud<'_>],
    view: &View,
    parts: Parts,
    linear_of_srgb: &[f32; 256],
    picture: &mut Picture,
) {
    let [width, height] = view.size_px.map(|side| side as usize);
    let n_pixels = width * height;
    let clocks = picture.clocks;
    let mut timer = Timer::new(clocks.map(|clocks| clocks.process));
    picture.begin([width, height]);
    let requested = |requested: bool| if requested { n_pixels } else { 0 };
    picture.winners.resize(requested(parts.winners), [0; 2]);
    picture.packed.resize(requested(parts.mode != Mode::None), [0; 4]);
    picture.material.resize(requested(parts.material), 0);
    picture.object.resize(requested(parts.object), 0);
    let mut first = 1;
    let in_view: Vec<CloudInView<'_>> = clouds
        .iter()
        .map(|cloud| {
            let columns = cloud.columns;
            let eye = Eye::new(view, cloud.view_from_cloud, cloud.round_reach);
            let (first_surfel, object) = (cloud.first, cloud.object);
            let in_view = CloudInView { columns, eye, first, first_surfel, object };
            first += columns.n_places as u32;
            in_view
        })
        .collect();
    let placed = cull::visible_blocks(&in_view);
    let mut spent = Spent { cull: timer.lap(), ..Spent::default() };
    let stop = picture.stop.clone();
    let is_stopped = || stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
    make_parts(clouds, &placed, &is_stopped);
    spent.place = timer.lap();
    picture.drawn = DrawCounts {
        blocks: placed.len(),
        surfels: placed.iter().map(|placed| n_surfels(&in_view, placed)).sum(),
    };
    let scene = Scene::new(&in_view, view.world_from_view, linear_of_srgb, parts.mode);
    let by_band = by_band(&placed, height);
    let clock = clocks.map(|clocks| clocks.thread);
    let all = AllSplats::new(&in_view, &placed, &by_band, width, parts.mode == Mode::Fields);
    spent.cull += timer.lap();
    let spent = Mutex::new(spent);
    let mut backs = vec![Vec::new(); by_band.len()];
    bands(picture, width, height, &mut backs).into_par_iter().zip(&by_band).for_each_init(
        Worker::new,
        |worker, (mut band, of_band)| {
            if is_stopped() {
                return;
            }
            let timer = Timer::new(clock);
            dispatch!(level, simd => worker.draw_band(simd, &mut band, of_band, &all, &scene, timer));
            let own = std::mem::take(&mut worker.spent);
            spent.lock().unwrap_or_else(PoisonError::into_inner).add(&own);
        },
    );
    if parts.mode != Mode::None && !is_stopped() {
        rims::smooth(picture, &backs, |number| scene.cloud_of(number), &in_view);
    }
    if picture.is_stopped() {
        picture.forget();
    }
    picture.spent = spent.into_inner().unwrap_or_else(PoisonError::into_inner);
}

/// Makes the parts of clouds that are drawn and not there yet, unless nobody wants the picture any more.
fn make_parts(
    clouds: &[Cloud<'_>],
    placed: &[VisibleBlock],
    is_stopped: &(dyn Fn() -> bool + Sync),
) {
    let missing = |placed: &VisibleBlock| {
        let columns = clouds[placed.cloud as usize].columns;
        let first = columns.blocks[placed.block as usize].first;
        Some((placed.cloud as usize, columns.missing_part(first)?))
    };
    let mut all: Vec<(usize, usize)> = placed.iter().filter_map(missing).collect();
    all.sort_unstable();
    all.dedup();
    all.par_iter().for_each(|&(cloud, number)| {
        if !is_stopped() {
            let Cloud { columns, geometry, .. } = &clouds[cloud];
            columns.make_part(number, geometry.as_ref());
        }
    });
}

/// Surfels of a block, filled up to whole groups.
fn n_surfels(in_view: &[CloudInView<'_>], placed: &VisibleBlock) -> usize {
    let columns = in_view[placed.cloud as usize].columns;
    columns.blocks[placed.block as usize].count * lanes::WIDTH
}

/// A picture's memory, in rows of tiles.
fn bands<'a>(
    picture: &'a mut Picture,
    width: usize,
    height: usize,
    backs: &'a mut [Vec<BackPixel>],
) -> Vec<Band<'a>> {
    let rows = width * TILE[1];
    let mut winners = picture.winners.chunks_mut(rows);
    let mut packed = picture.packed.chunks_mut(rows);
    let mut material = picture.material.chunks_mut(rows);
    let mut object = picture.object.chunks_mut(rows);
    let across = picture.covered.across();
    let mut cells = picture.covered.cells_mut().chunks_mut(across * (TILE[1] / CELL));
    let tops = (0..height).step_by(TILE[1]).zip(backs);
    let band = |(top, backs)| Band {
        width,
        top,
        winners: winners.next().unwrap_or_default(),
        packed: packed.next().unwrap_or_default(),
        material: material.next().unwrap_or_default(),
        object: object.next().unwrap_or_default(),
        cells: cells.next().unwrap_or_default(),
        cells_across: across,
        backs,
    };
    tops.map(band).collect()
}

/// What a thread draws with.
struct Worker {
    tile: Tile,
    /// Blocks that a tile may meet.
    blocks: Vec<u32>,
    /// What a row of tiles took.
    spent: Spent,
}

impl Worker {
    fn new() -> Self {
        Self { tile: Tile::new(), blocks: Vec::new(), spent: Spent::default() }
    }

    #[inline(always)]
    fn draw_band<S: Simd>(
        &mut self,
        simd: S,
        band: &mut Band<'_>,
        of_band: &[u32],
        all: &AllSplats<'_>,
        scene: &Scene<'_>,
        mut timer: Timer,
    ) {
        let Self { tile, blocks, spent } = self;
        let height = band.height();
        for left in (0..band.width).step_by(TILE[0]) {
            let size = [TILE[0].min(band.width - left), height];
            blocks.clear();
            blocks
                .extend(of_band.iter().filter(|&&at| is_across(all.block(at).0, left, band.width)));
            if blocks.is_empty() {
                band.clear(left, size);
                spent.pack += timer.lap();
                continue;
            }
            tile.nearest(simd, [left, band.top], size, all, blocks, (&mut timer, spent));
            spent.nearest += timer.lap();
            if scene.mode.blends() {
                tile.blend(simd, scene);
                spent.blend += timer.lap();
            }
            resolve::write(simd, tile, scene, band);
            spent.pack += timer.lap();
        }
    }
}
