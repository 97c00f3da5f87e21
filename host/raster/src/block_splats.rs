//! The surfels of blocks as tiles meet them: put together by the first tile that a block touches, for all of
//! them, and let go of behind the last.

use crate::cloud::CloudInView;
use crate::cull::VisibleBlock;
use crate::lanes::WIDTH;
use crate::local::Local;
use crate::splat::{Splat, splats};
use crate::tile::layout::TILE;
use fearless_simd::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What of the picture surfels may cover: first and behind-last pixels.
pub(crate) type Pixels = [i32; 4];

/// A box around nothing.
pub(crate) const NO_PIXELS: Pixels = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];

/// The box around two.
#[inline(always)]
pub(crate) fn around([x0, y0, x1, y1]: Pixels, [left, top, right, bottom]: Pixels) -> Pixels {
    [x0.min(left), y0.min(top), x1.max(right), y1.max(bottom)]
}

/// Whether two parts of the picture have a pixel in common.
#[inline(always)]
pub(crate) fn overlap(a: &Pixels, b: &Pixels) -> bool {
    a[0] < b[2] && a[1] < b[3] && a[2] > b[0] && a[3] > b[1]
}

/// The surfels of a block that are seen, with what they cover of the whole picture.
#[derive(Default)]
pub(crate) struct BlockSplats {
    pub(crate) splats: Vec<Splat>,
    pub(crate) locals: Vec<Local>,
    /// What the splats of each group cover, and where they end.
    pub(crate) groups: Vec<(Pixels, usize)>,
}

impl BlockSplats {
    /// What varies over a splat.
    #[inline(always)]
    pub(crate) fn local(&self, splat: &Splat) -> Option<&Local> {
        self.locals.get((splat.local as usize).checked_sub(1)?)
    }

    #[inline(always)]
    fn fill<S: Simd>(
        &mut self,
        simd: S,
        in_view: &CloudInView<'_>,
        placed: &VisibleBlock,
        with_fields: bool,
    ) {
        let Self { splats: all, locals, groups } = self;
        all.clear();
        locals.clear();
        groups.clear();
        let block = &in_view.columns.blocks[placed.block as usize];
        all.reserve(block.count * WIDTH);
        for group in block.first..block.first + block.count {
            if let Some(pixels) =
                splats(simd, in_view, placed.cloud, group, with_fields, all, locals)
            {
                groups.push((pixels, all.len()));
            }
        }
    }
}

/// A block's surfels while tiles need them.
struct Slot {
    made: Mutex<Option<Arc<BlockSplats>>>,
    /// Tiles that may still meet the block.
    tiles_left: AtomicU32,
}

/// The surfels of all blocks of a picture.
pub(crate) struct AllSplats<'a> {
    clouds: &'a [CloudInView<'a>],
    placed: &'a [VisibleBlock],
    with_fields: bool,
    slots: Vec<Slot>,
    /// Memory that blocks were in, for others.
    spare: Mutex<Vec<BlockSplats>>,
}

/// Locks what no panic leaves half done.
fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<'a> AllSplats<'a> {
    pub(crate) fn new(
        clouds: &'a [CloudInView<'a>],
        placed: &'a [VisibleBlock],
        by_band: &[Vec<u32>],
        width: usize,
        with_fields: bool,
    ) -> Self {
        let mut tiles = vec![0; placed.len()];
        for &at in by_band.iter().flatten() {
            let across = (0..width).step_by(TILE[0]);
            tiles[at as usize] +=
                across.filter(|&left| is_across(&placed[at as usize], left, width)).count() as u32;
        }
        let slot = |tiles| Slot { made: Mutex::new(None), tiles_left: AtomicU32::new(tiles) };
        let slots = tiles.into_iter().map(slot).collect();
        Self { clouds, placed, with_fields, slots, spare: Mutex::default() }
    }

    /// A block, and the nearest distance at which its cloud is drawn.
    #[inline(always)]
    pub(crate) fn block(&self, at: u32) -> (&'a VisibleBlock, f32) {
        let placed = &self.placed[at as usize];
        (placed, self.clouds[placed.cloud as usize].eye.near)
    }

    /// Whether a block's surfels are put together.
    pub(crate) fn is_made(&self, at: u32) -> bool {
        locked(&self.slots[at as usize].made).is_some()
    }

    /// The surfels of a block.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(&self, simd: S, at: u32) -> Arc<BlockSplats> {
        let slot = &self.slots[at as usize];
        // Others that need the same block wait: it takes less time than to do it twice.
        let mut made = locked(&slot.made);
        if let Some(made) = &*made {
            return made.clone();
        }
        let placed = &self.placed[at as usize];
        let mut own = locked(&self.spare).pop().unwrap_or_default();
        own.fill(simd, &self.clouds[placed.cloud as usize], placed, self.with_fields);
        let own = Arc::new(own);
        *made = Some(own.clone());
        own
    }

    /// Says that a tile is done with a block: most are of one tile where surfels are many, and are let go of at once.
    pub(crate) fn tile_is_done(&self, at: u32) {
        let slot = &self.slots[at as usize];
        if slot.tiles_left.fetch_sub(1, Ordering::AcqRel) > 1 {
            return;
        }
        let made = locked(&slot.made).take();
        locked(&self.spare).extend(made.and_then(Arc::into_inner));
    }
}

/// Whether a block may cover pixels of the tiles that begin at this column of a picture.
#[inline(always)]
pub(crate) fn is_across(placed: &VisibleBlock, left: usize, width: usize) -> bool {
    let [x0, _, x1, _] = placed.pixels;
    x0 < (left + TILE[0]).min(width) as i32 && x1 > left as i32
}

/// The blocks of each row of tiles, in order.
pub(crate) fn by_band(placed: &[VisibleBlock], height: usize) -> Vec<Vec<u32>> {
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
