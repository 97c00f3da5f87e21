//! What of a picture is made, its memory, and the rows of it that one thread draws.

use crate::coverage::{CELL, Coverage};
use crate::resolve::rims::BackPixel;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    pub(crate) fn blends(self) -> bool {
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
    /// Which parts of it hold surfels; everything else is zeros.
    pub covered: Coverage,
    /// Blocks that were drawn, and surfels in them.
    pub drawn: DrawCounts,
    /// Once it says so, nothing more is drawn, and the picture is worth nothing.
    pub stop: Option<Arc<AtomicBool>>,
    /// What tells how long stages take, where that is asked for.
    pub clocks: Option<Clocks>,
    /// How long they took; zeros where nobody asked.
    pub spent: Spent,
}

/// What tells CPU time, nanoseconds.
#[derive(Clone, Copy, Debug)]
pub struct Clocks {
    /// Of all threads of the process.
    pub process: fn() -> u64,
    /// Of the thread that asks.
    pub thread: fn() -> u64,
}

/// CPU time of the stages of a picture, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spent {
    /// Choosing blocks, fine or merged, culling and sorting them, of the process.
    pub cull: u64,
    /// Surfels from space to the screen, of the threads that drew, as all below.
    pub place: u64,
    /// Finding the nearest surfels.
    pub nearest: u64,
    /// Adding up what blends with them.
    pub blend: u64,
    /// Writing pixels.
    pub pack: u64,
}

impl Spent {
    pub(crate) fn add(&mut self, other: &Self) {
        self.place += other.place;
        self.nearest += other.nearest;
        self.blend += other.blend;
        self.pack += other.pack;
    }
}

/// Tells a thread's stages apart.
pub(crate) struct Timer {
    clock: Option<fn() -> u64>,
    since: u64,
}

impl Timer {
    pub(crate) fn new(clock: Option<fn() -> u64>) -> Self {
        Self { clock, since: clock.map_or(0, |clock| clock()) }
    }

    /// Whether there is a clock.
    pub(crate) fn runs(&self) -> bool {
        self.clock.is_some()
    }

    /// Nanoseconds since the last one; 0 without a clock.
    pub(crate) fn lap(&mut self) -> u64 {
        let now = self.clock.map_or(0, |clock| clock());
        now.saturating_sub(std::mem::replace(&mut self.since, now))
    }
}

impl Picture {
    /// Prepares it for this size: where it has it already, what held nothing is zeros.
    pub(crate) fn begin(&mut self, size: [usize; 2]) {
        if self.covered.size() != size {
            self.covered = Coverage::none(size);
            self.winners.clear();
            self.packed.clear();
            self.material.clear();
            self.object.clear();
        }
    }

    /// Lets go of what it holds: it is of no one picture.
    pub(crate) fn forget(&mut self) {
        self.covered = Coverage::default();
    }

    /// Whether it was not to be drawn to its end.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed))
    }

    /// Bytes that it takes, room for larger pictures included.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let Self { winners, packed, material, object, .. } = self;
        let [winners, packed] = [8 * winners.capacity(), 16 * packed.capacity()];
        let others = 4 * (material.capacity() + object.capacity());
        (winners + packed + others) as u64
    }
}

/// How much a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawCounts {
    /// Blocks in front of the eye.
    pub blocks: usize,
    /// Surfels in them, merged ones counting once, and groups filled up to sixteen.
    pub surfels: usize,
}

/// Rows of a picture that one thread draws.
pub(crate) struct Band<'a> {
    pub(crate) width: usize,
    pub(crate) top: usize,
    pub(crate) winners: &'a mut [[u32; 2]],
    pub(crate) packed: &'a mut [[u32; 4]],
    pub(crate) material: &'a mut [u32],
    pub(crate) object: &'a mut [u32],
    /// Cells that hold surfels: until a tile is drawn, those of the picture before.
    pub(crate) cells: &'a mut [bool],
    pub(crate) cells_across: usize,
    /// Its pixels that are seen from behind.
    pub(crate) backs: &'a mut Vec<BackPixel>,
}

impl Band<'_> {
    /// The place of a pixel of a tile with this corner in the picture.
    #[inline(always)]
    pub(crate) fn at(&self, corner: [i32; 2], x: usize, y: usize) -> usize {
        y * self.width + corner[0] as usize + x
    }

    /// Rows of pixels.
    pub(crate) fn height(&self) -> usize {
        let rows = [self.winners.len(), self.packed.len(), self.material.len(), self.object.len()];
        rows.into_iter().max().unwrap_or(0) / self.width
    }

    /// Leaves nothing in a part of it, from a column on.
    pub(crate) fn clear(&mut self, left: usize, [width, height]: [usize; 2]) {
        let mut held = false;
        for row in self.cells.chunks_exact_mut(self.cells_across) {
            let cells = &mut row[left / CELL..(left + width).div_ceil(CELL)];
            held |= cells.contains(&true);
            cells.fill(false);
        }
        if !held {
            return;
        }
        for row in 0..height {
            let part = row * self.width + left..row * self.width + left + width;
            clear(self.winners, &part, [0; 2]);
            clear(self.packed, &part, [0; 4]);
            clear(self.material, &part, 0);
            clear(self.object, &part, 0);
        }
    }

    /// Whether anything but the surface is made.
    pub(crate) fn looks_up(&self) -> bool {
        !(self.winners.is_empty() && self.material.is_empty() && self.object.is_empty())
    }
}

fn clear<T: Copy>(pixels: &mut [T], part: &Range<usize>, nothing: T) {
    if let Some(part) = pixels.get_mut(part.clone()) {
        part.fill(nothing);
    }
}
