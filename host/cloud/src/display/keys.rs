//! What tells things that are made of columns from all others.

use super::filter::{FilterAction, FilterTest};
use super::maps::ColorMap;
use super::palette::Palette;
use super::settings::Scale;
use crate::cloud::axis::Axis;

/// Tells the numbers of an attribute from all others: equal keys mean equal numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct ScalarKey {
    pub(super) generation: u64,
    pub(super) component: u32,
    /// Bits of what is added.
    pub(super) offset: u64,
    /// Whether the sign is changed.
    pub(super) is_reversed: bool,
}

/// Tells a column of colours from all others.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColorKey {
    /// So many of one colour.
    Uniform(usize, [u8; 3]),
    Normal(u64, Axis),
    Ramp(ScalarKey, ColorMap, Scale, [u64; 2]),
    Categories(ScalarKey, Palette),
}

/// Tells radii, and which surfels are round splats, from all others: by generations and the bits of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SplatKey {
    /// So many of one radius.
    Same(usize, u32),
    /// So many round splats.
    AllRound(usize),
    /// Radii of a column, at most so large.
    AtMost(u64, u32),
    /// Round splats by a column and the least planarity of discs.
    Round(u64, u32),
}

/// Tells the rows that filters let through from all others.
pub(super) type RowsKey = Vec<(ScalarKey, FilterAction, FilterTest)>;

/// Tells a histogram from all others: by the bits of its range, too.
pub(super) type HistogramKey = (ScalarKey, [u64; 2], Scale);
