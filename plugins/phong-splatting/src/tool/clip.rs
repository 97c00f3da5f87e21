//! Lines that cut a splat.

use surfelshop_api::glam::DVec2;

/// A line: what stays is where inwards · x + offset is not negative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) inwards: DVec2,
    pub(crate) offset: f64,
}

impl Line {
    /// Distance of a point inside of the line.
    pub(crate) fn of(&self, at: DVec2) -> f64 {
        self.inwards.dot(at) + self.offset
    }
}

/// A line, points where it was found, and the sample across it at each.
#[derive(Clone, Debug)]
pub(crate) struct CreaseLine {
    pub(crate) line: Line,
    pub(crate) at: Vec<(DVec2, u32)>,
}

/// Lines that cut a splat: none, one or two.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cut {
    pub(crate) lines: Vec<CreaseLine>,
    /// Whether what is on the side of either line stays, rather than of both.
    pub(crate) either: bool,
}
