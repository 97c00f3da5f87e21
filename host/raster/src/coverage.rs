//! Which parts of a picture hold surfels, so that what is done with it can leave the others out.

use std::ops::Range;

/// Width and height of a cell in pixels.
pub(crate) const CELL: usize = 16;

/// Cells of 16 by 16 pixels that hold a surfel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    size: [usize; 2],
    /// Cells of a row.
    across: usize,
    /// Row by row from the top.
    cells: Vec<bool>,
}

/// A part of a picture: first column and row, width and height in pixels.
pub type Rectangle = [u32; 4];

impl Coverage {
    /// A picture of so many pixels that holds nothing.
    #[must_use]
    pub fn none(size: [usize; 2]) -> Self {
        let [across, down] = size.map(|side| side.div_ceil(CELL));
        Self { size, across, cells: vec![false; across * down] }
    }

    /// One that holds surfels everywhere, as far as is known.
    #[must_use]
    pub fn whole(size: [usize; 2]) -> Self {
        let mut all = Self::none(size);
        all.cells.fill(true);
        all
    }

    /// Width and height of the picture in pixels.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    pub(crate) fn across(&self) -> usize {
        self.across
    }

    pub(crate) fn cells_mut(&mut self) -> &mut [bool] {
        &mut self.cells
    }

    /// Whether the cell of a pixel holds a surfel; `false` outside of the picture.
    #[must_use]
    pub fn holds(&self, x: usize, y: usize) -> bool {
        x / CELL < self.across && self.cells.get(y / CELL * self.across + x / CELL) == Some(&true)
    }

    /// The cells that hold surfels here or in another coverage of a picture of this size.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.cells.iter_mut().zip(&other.cells).for_each(|(cell, other)| *cell |= other);
        both
    }

    /// Pixels of the cells that hold surfels.
    #[must_use]
    pub fn pixels(&self) -> u64 {
        self.rectangles()
            .iter()
            .map(|&[_, _, width, height]| u64::from(width) * u64::from(height))
            .sum()
    }

    /// The cells that hold surfels as rectangles that do not overlap, from the top: runs of cells, as high as the
    /// runs of the rows below are the same.
    #[must_use]
    pub fn rectangles(&self) -> Vec<Rectangle> {
        let mut all = Vec::new();
        if self.across == 0 {
            return all;
        }
        let mut above: (Vec<Range<usize>>, usize) = (Vec::new(), 0);
        let rows = self.cells.chunks_exact(self.across).map(runs).chain([Vec::new()]);
        for (row, runs) in rows.enumerate() {
            if runs != above.0 {
                let (runs, first) = std::mem::replace(&mut above, (runs, row));
                all.extend(runs.into_iter().map(|run| self.rectangle(run, first..row)));
            }
        }
        all
    }

    /// At most so many rectangles around the cells that hold surfels here or in another coverage of a picture of this
    /// size, one above the other.
    #[must_use]
    pub fn strips(&self, other: &Self, most: usize) -> Vec<Rectangle> {
        let mut all = Vec::with_capacity(most);
        if self.across == 0 {
            return all;
        }
        let down = self.cells.len() / self.across;
        let high = down.div_ceil(most.max(1));
        for first in (0..down).step_by(high.max(1)) {
            let rows = first..(first + high).min(down);
            // First and behind last.
            let (mut columns, mut reached) = ((usize::MAX, 0), (usize::MAX, 0));
            for row in rows {
                let cells = row * self.across..(row + 1) * self.across;
                let of = [self, other].map(|one| one.cells.get(cells.clone()).unwrap_or_default());
                for cells in of {
                    let first = cells.iter().position(|&holds| holds);
                    let last = cells.iter().rposition(|&holds| holds);
                    if let Some((first, last)) = first.zip(last) {
                        columns = (columns.0.min(first), columns.1.max(last + 1));
                        reached = (reached.0.min(row), row + 1);
                    }
                }
            }
            if columns.0 < columns.1 {
                all.push(self.rectangle(columns.0..columns.1, reached.0..reached.1));
            }
        }
        all
    }

    /// Columns and rows of cells in pixels.
    fn rectangle(&self, columns: Range<usize>, rows: Range<usize>) -> Rectangle {
        let [width, height] = self.size;
        let x = (columns.start * CELL, (columns.end * CELL).min(width));
        let y = (rows.start * CELL, (rows.end * CELL).min(height));
        // Sides of pictures are 32-bit numbers.
        [x.0, y.0, x.1 - x.0, y.1 - y.0].map(|at| at as u32)
    }
}

/// Runs of cells that hold surfels.
fn runs(cells: &[bool]) -> Vec<Range<usize>> {
    let mut all: Vec<Range<usize>> = Vec::new();
    for (at, _) in cells.iter().enumerate().filter(|(_, holds)| **holds) {
        match all.last_mut() {
            Some(run) if run.end == at => run.end = at + 1,
            _ => all.push(at..at + 1),
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of 70 x 40 pixels: five by three cells, the last ones cut by its edges.
    fn coverage(cells: [&str; 3]) -> Coverage {
        let mut all = Coverage::none([70, 40]);
        let of = cells.iter().flat_map(|row| row.chars().map(|cell| cell == '#'));
        all.cells.iter_mut().zip(of).for_each(|(cell, holds)| *cell = holds);
        all
    }

    #[test]
    fn rectangles_hold_each_pixel_of_cells_with_surfels_once() {
        for cells in [
            [".....", ".....", "....."],
            ["##.#.", "##.#.", "....#"],
            ["#####", "#####", "#####"],
            ["#....", ".....", "#...#"],
        ] {
            let all = coverage(cells);
            let mut times = vec![0; 70 * 40];
            for [x, y, width, height] in all.rectangles() {
                for at in y..y + height {
                    (x..x + width).for_each(|x| times[(at * 70 + x) as usize] += 1);
                }
            }
            for (at, times) in times.iter().enumerate() {
                let (x, y) = (at % 70, at / 70);
                let holds = cells[y / 16].as_bytes()[x / 16] == b'#';
                assert_eq!(*times, i32::from(holds), "{cells:?} at {x}, {y}");
                assert_eq!(all.holds(x, y), holds);
            }
            assert_eq!(all.pixels(), times.iter().sum::<i32>() as u64);
        }
        let two = coverage(["##.#.", "##.#.", "....#"]).rectangles();
        assert_eq!(two, [[0, 0, 32, 32], [48, 0, 16, 32], [64, 32, 6, 8]]);
        assert!(!coverage(["#####"; 3]).holds(80, 0), "beside the picture");
    }

    #[test]
    fn strips_hold_what_either_holds() {
        let (one, other) =
            (coverage([".#...", ".....", "....."]), coverage(["...#.", ".....", "..#.."]));
        assert_eq!(one.with(&other), coverage([".#.#.", ".....", "..#.."]));
        assert_eq!(one.strips(&other, 3), [[16, 0, 48, 16], [32, 32, 16, 8]]);
        assert_eq!(one.strips(&other, 1), [[16, 0, 48, 40]]);
        assert_eq!(one.strips(&one, 2), [[16, 0, 16, 16]]);
        assert_eq!(one.strips(&Coverage::whole([70, 40]), 1), [[0, 0, 70, 40]]);
        assert!(Coverage::none([70, 40]).strips(&Coverage::none([70, 40]), 4).is_empty());
        assert!(Coverage::default().rectangles().is_empty());
    }
}
