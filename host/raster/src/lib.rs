//! Draws surfels on the processor: what the shaders of the surface buffer do, without a graphics
//! device.
//!
//! Blocks of surfels are culled, chosen fine or coarse, sorted from near to far and drawn tile by tile,
//! sixteen surfels and sixteen pixels at once; what lies behind a tile that is filled is left out. The
//! rules are those of `shaders/host`: a disc in its tangent plane, widened by the screen-space low-pass;
//! the nearest one decides the depth, and those within the depth tolerance blend with it.
//!
//! Invariants: this crate knows no graphics API; a picture does not depend on the number of threads nor
//! on the processor's instructions; what is culled would not have been seen.

mod columns;
mod cull;
mod disc;
mod lanes;
mod levels;
mod local;
mod pack;
mod places;
mod resolve;
mod splat;
#[cfg(test)]
mod tests;
mod tile;
mod view;

pub use columns::{Albedo, Columns, Sources};
pub use local::Splats;
pub use places::{Part, places};
pub use view::View;

use cull::{Placed, Seen};
use fearless_simd::prelude::*;
use fearless_simd::{Level, dispatch};
use glam::Mat4;
use rayon::prelude::*;
use resolve::Scene;
use tile::{TILE, Tile};
use view::Eye;

/// Surfels are drawn in groups of so many; blocks begin with one.
pub const GROUP: usize = lanes::WIDTH;

/// A cloud to be drawn.
pub struct Cloud<'a> {
    /// Its columns.
    pub columns: &'a Columns,
    /// Rigid motion from its positions to view space, scaled to units of drawing.
    pub view_from_cloud: Mat4,
    /// The number of its first surfel in the picture, above 0.
    pub first: u32,
}

/// What of the surface is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The nearest surfels' numbers and distances alone.
    None,
    /// The surface of the nearest surfels.
    Nearest,
    /// The surface of blended surfels.
    Blended,
    /// The same with the normals of fields.
    Fields,
}

impl Mode {
    /// Whether surfels are added up.
    fn blends(self) -> bool {
        matches!(self, Self::Blended | Self::Fields)
    }
}

/// What is made of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// The surface.
    pub mode: Mode,
    /// The nearest surfels.
    pub winners: bool,
    /// Indices of the nearest surfels' materials.
    pub material: bool,
    /// Which of the clouds the nearest surfels belong to.
    pub object: bool,
}

/// A picture, row by row from the top.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Number of the nearest surfel, its highest bit set where it is seen from behind, and the bits of
    /// its distance in units of drawing; zeros where nothing is; empty unless asked for.
    pub winners: Vec<[u32; 2]>,
    /// The surface as `surfelshop::packing` packs it; empty unless asked for.
    pub packed: Vec<[u32; 4]>,
    /// Indices of materials; empty unless asked for.
    pub material: Vec<u32>,
    /// Clouds, from 0; empty unless asked for.
    pub object: Vec<u32>,
    /// Blocks that were drawn, and surfels in them.
    pub drawn: Drawn,
}

impl Picture {
    /// Bytes that it takes, room for larger pictures included.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let Self { winners, packed, material, object, drawn: _ } = self;
        let [winners, packed] = [8 * winners.capacity(), 16 * packed.capacity()];
        let others = 4 * (material.capacity() + object.capacity());
        (winners + packed + others) as u64
    }
}

/// How much a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Blocks in front of the eye.
    pub blocks: usize,
    /// Surfels in them, merged ones counting once, and groups filled up to sixteen.
    pub surfels: usize,
}

/// Rows of a picture that one thread draws.
struct Band<'a> {
    width: usize,
    top: usize,
    winners: &'a mut [[u32; 2]],
    packed: &'a mut [[u32; 4]],
    material: &'a mut [u32],
    object: &'a mut [u32],
}

impl Band<'_> {
    /// The place of a tile's pixel.
    #[inline(always)]
    fn at(&self, tile: &Tile, x: usize, y: usize) -> usize {
        y * self.width + tile.corner[0] as usize + x
    }

    /// Whether anything but the surface is made.
    fn looks_up(&self) -> bool {
        !(self.winners.is_empty() && self.material.is_empty() && self.object.is_empty())
    }
}

/// Draws clouds into a picture, whose memory is used again; `linear_of_srgb` holds the linear values of
/// all 8-bit codes.
pub fn draw(
    clouds: &[Cloud<'_>],
    view: &View,
    parts: Parts,
    linear_of_srgb: &[f32; 256],
    picture: &mut Picture,
) {
    draw_with(Level::new(), clouds, view, parts, linear_of_srgb, picture);
}

/// The same with these instructions of the processor.
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
    let asked = |asked: bool| if asked { n_pixels } else { 0 };
    picture.winners.resize(asked(parts.winners), [0; 2]);
    picture.packed.resize(asked(parts.mode != Mode::None), [0; 4]);
    picture.material.resize(asked(parts.material), 0);
    picture.object.resize(asked(parts.object), 0);
    let mut first = 1;
    let seen: Vec<Seen<'_>> = clouds
        .iter()
        .map(|cloud| {
            let columns = cloud.columns;
            let eye = Eye::new(view, cloud.view_from_cloud);
            let seen = Seen { columns, eye, first, first_surfel: cloud.first };
            first += columns.n_places as u32;
            seen
        })
        .collect();
    let placed = cull::placed(&seen);
    picture.drawn = Drawn {
        blocks: placed.len(),
        surfels: placed.iter().map(|placed| n_surfels(&seen, placed)).sum(),
    };
    let scene = Scene::new(&seen, view.world_from_view, linear_of_srgb, parts.mode);
    let by_band = by_band(&placed, height);
    bands(picture, width, height).into_par_iter().zip(by_band).for_each_init(
        || (Tile::new(), Vec::new()),
        |(tile, blocks), (mut band, of_band)| {
            dispatch!(level, simd => draw_band(simd, &mut band, tile, blocks, &of_band, &placed, &scene));
        },
    );
}

/// Surfels of a block, filled up to whole groups.
fn n_surfels(seen: &[Seen<'_>], placed: &Placed) -> usize {
    let columns = seen[placed.cloud as usize].columns;
    columns.blocks[placed.block as usize].count * lanes::WIDTH
}

/// A picture's memory, in rows of tiles.
fn bands(picture: &mut Picture, width: usize, height: usize) -> Vec<Band<'_>> {
    let rows = width * TILE[1];
    let mut winners = picture.winners.chunks_mut(rows);
    let mut packed = picture.packed.chunks_mut(rows);
    let mut material = picture.material.chunks_mut(rows);
    let mut object = picture.object.chunks_mut(rows);
    let tops = (0..height).step_by(TILE[1]);
    let band = |top| Band {
        width,
        top,
        winners: winners.next().unwrap_or_default(),
        packed: packed.next().unwrap_or_default(),
        material: material.next().unwrap_or_default(),
        object: object.next().unwrap_or_default(),
    };
    tops.map(band).collect()
}

/// The blocks of each row of tiles, in order.
fn by_band(placed: &[Placed], height: usize) -> Vec<Vec<u32>> {
    let n = height.div_ceil(TILE[1]);
    let mut bands = vec![Vec::new(); n];
    for (i, placed) in placed.iter().enumerate() {
        let [_, top, _, bottom] = placed.pixels;
        let first = top.max(0) as usize / TILE[1];
        let last = (bottom.max(0) as usize).div_ceil(TILE[1]).min(n);
        for band in bands.iter_mut().take(last).skip(first) {
            band.push(i as u32);
        }
    }
    bands
}

#[inline(always)]
fn draw_band<S: Simd>(
    simd: S,
    band: &mut Band<'_>,
    tile: &mut Tile,
    blocks: &mut Vec<Placed>,
    of_band: &[u32],
    placed: &[Placed],
    scene: &Scene<'_>,
) {
    let rows = [band.winners.len(), band.packed.len(), band.material.len(), band.object.len()];
    let height = rows.into_iter().max().unwrap_or(0) / band.width;
    for left in (0..band.width).step_by(TILE[0]) {
        let size = [TILE[0].min(band.width - left), height];
        let right = (left + size[0]) as i32;
        blocks.clear();
        let here = |placed: &&Placed| placed.pixels[0] < right && placed.pixels[2] > left as i32;
        blocks.extend(of_band.iter().map(|&i| &placed[i as usize]).filter(here));
        let with_fields = scene.mode == Mode::Fields;
        tile.nearest(simd, [left, band.top], size, scene.clouds, blocks, with_fields);
        if scene.mode.blends() {
            tile.blend(simd, scene.clouds, scene.n_sums, scene.linear_of_srgb);
        }
        resolve::write(simd, tile, scene, band);
    }
}
