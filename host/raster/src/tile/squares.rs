//! The squares of pixels that a splat's box touches in a tile.

use crate::tile::layout::SIDE;
use std::ops::Range;

/// The squares of a part of a tile.
pub(super) struct Squares {
    /// Its pixels in the tile.
    pixels: [usize; 4],
    first: [usize; 2],
    end: [usize; 2],
    /// Squares of a row, where each has a bit; 0 where there are more squares than bits.
    across: usize,
}

impl Squares {
    #[inline(always)]
    pub(super) fn new(pixels: [usize; 4]) -> Self {
        let [x0, y0, x1, y1] = pixels;
        let (first, end) = ([x0 / SIDE, y0 / SIDE], [x1.div_ceil(SIDE), y1.div_ceil(SIDE)]);
        let (across, down) = (end[0] - first[0], end[1] - first[1]);
        let across = if across * down <= u64::BITS as usize { across } else { 0 };
        Self { pixels, first, end, across }
    }

    #[inline(always)]
    pub(super) fn rows(&self) -> Range<usize> {
        self.first[1]..self.end[1]
    }

    #[inline(always)]
    pub(super) fn columns(&self) -> Range<usize> {
        self.first[0]..self.end[0]
    }

    /// The bit of a square; where not each has one, that of all.
    #[inline(always)]
    pub(super) fn bit(&self, column: usize, row: usize) -> u64 {
        match self.across {
            0 => 1,
            across => 1 << (across * (row - self.first[1]) + column - self.first[0]),
        }
    }

    /// The pixels of a square in this row that are within, a bit for each.
    ///
    /// Beyond a splat's box rounding alone could make one that is seen edge-on meet rays.
    #[inline(always)]
    pub(super) fn in_row(&self, row: usize) -> u64 {
        let (top, [_, y0, _, y1]) = (SIDE * row, self.pixels);
        0xffff << (SIDE * y0.saturating_sub(top))
            & 0xffff >> (SIDE * (top + SIDE).saturating_sub(y1))
    }

    /// The same of a column.
    #[inline(always)]
    pub(super) fn in_column(&self, column: usize) -> u64 {
        let (left, [x0, _, x1, _]) = (SIDE * column, self.pixels);
        let columns = 0xf << x0.saturating_sub(left) & 0xf >> (left + SIDE).saturating_sub(x1);
        // Four times the same four bits, one of each row.
        columns * 0x1111
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_squares_are_bits() {
        let within = |pixels| {
            let squares = Squares::new(pixels);
            squares.in_column(3) & squares.in_row(2)
        };
        assert_eq!(within([0, 0, 128, 32]), 0xffff);
        assert_eq!(within([13, 9, 15, 10]), 0b0110 << 4);
        assert_eq!(within([0, 9, 13, 32]), 0x1110);
    }

    #[test]
    fn squares_have_a_bit_each_up_to_as_many_as_there_are_bits() {
        let bits = |pixels| {
            let squares = Squares::new(pixels);
            let all = squares.rows().flat_map(|row| squares.columns().map(move |at| (at, row)));
            all.map(|(column, row)| squares.bit(column, row)).collect::<Vec<_>>()
        };
        // Eight by eight squares, the first and the last touched by a pixel each.
        let all = bits([7, 3, 33, 29]);
        assert_eq!(all, (0..64).map(|i| 1 << i).collect::<Vec<u64>>());
        assert_eq!(bits([7, 3, 37, 29]), [1; 72]);
    }
}
