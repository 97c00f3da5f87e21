//! Measures of a tile and of what is added up in it.

/// Width and height of a tile in pixels.
pub(crate) const TILE: [usize; 2] = [128, 32];
/// Side of a square of pixels.
pub(crate) const SIDE: usize = 4;
/// Sums of a square: normal x y z, weight, albedo r g b, accessibility. The later ones are added up only
/// where they differ from surfel to surfel.
pub(crate) const N_SUMS: usize = 8;
/// Sums that always are added up.
pub(crate) const N_NORMAL_SUMS: usize = 4;
