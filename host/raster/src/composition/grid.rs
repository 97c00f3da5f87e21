//! Tiles of a picture, and squares of a tile.

use crate::lanes::WIDTH;

/// Side of a tile in pixels.
pub(super) const SIZE: usize = 32;
/// Side of a square of pixels that are drawn at once.
pub(super) const SIDE: usize = 4;
/// Squares across a tile.
pub(super) const ACROSS: usize = SIZE / SIDE;
pub(super) const N_SQUARES: usize = ACROSS * ACROSS;

/// A number of each pixel of a square.
pub(super) type Lanes = [f32; WIDTH];
