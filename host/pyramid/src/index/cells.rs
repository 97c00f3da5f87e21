//! Cells of an octree over the root's cube, numbered along a space-filling curve.

use glam::DVec3;
use surfelshop_geometry::Bounds;

/// Halvings of the root's cube to the smallest cells: three times as many bits make a code of 63.
pub(crate) const LEVELS: u32 = 21;

/// The root's cube.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Cube {
    pub(crate) low: DVec3,
    pub(crate) side: f64,
}

/// A cell: the part of the curve that it has.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub(crate) struct Cell {
    /// The first code in it.
    pub(crate) first: u64,
    /// Halvings.
    pub(crate) level: u32,
}

impl Cell {
    pub(crate) const ROOT: Self = Self { first: 0, level: 0 };

    /// The cell of a level that a code lies in.
    pub(crate) fn of(code: u64, level: u32) -> Self {
        let below = 3 * (LEVELS - level);
        Self { first: code >> below << below, level }
    }

    /// The first code behind it.
    pub(crate) fn end(self) -> u64 {
        self.first + (1 << (3 * (LEVELS - self.level)))
    }

    /// Its eighths.
    pub(crate) fn children(self) -> [Self; 8] {
        let level = self.level + 1;
        let step = 1 << (3 * (LEVELS - level));
        std::array::from_fn(|i| Self { first: self.first + i as u64 * step, level })
    }

    /// Its box.
    pub(crate) fn bounds(self, cube: &Cube) -> Bounds {
        let corner = [0, 1, 2].map(|axis| f64::from(gathered(self.first >> axis)));
        let cell = cube.side / f64::from(1 << LEVELS);
        let min = cube.low + DVec3::from_array(corner) * cell;
        Bounds { min, max: min + cube.side / f64::from(1u32 << self.level) }
    }
}

impl Cube {
    /// A cube around a box.
    pub(crate) fn around([low, high]: [DVec3; 2]) -> Self {
        let side = (high - low).max_element();
        // Of a single point any cube will do.
        Self { low, side: if side > 0.0 { side * (1.0 + 1e-9) } else { 1.0 } }
    }

    /// The code of a place; of one outside that of the nearest within, and of one within a cell's box that of the
    /// nearest in the cell.
    pub(crate) fn code_in(&self, place: DVec3, cell: Cell) -> u64 {
        let span = 1u64 << (LEVELS - cell.level);
        let per_unit = f64::from(1u32 << LEVELS) / self.side;
        let steps = (place - self.low) * per_unit;
        [0, 1, 2].into_iter().fold(0, |code, axis| {
            let first = u64::from(gathered(cell.first >> axis));
            // The cast takes what is no number to 0.
            let at = (steps[axis].max(0.0) as u64).clamp(first, first + span - 1);
            code | spread(at) << axis
        })
    }

    pub(crate) fn code(&self, place: DVec3) -> u64 {
        self.code_in(place, Cell::ROOT)
    }
}

/// Puts two empty bits in front of each of the lowest 21.
///
/// Source: Morton 1966; the masks are those of repeated halving.
fn spread(value: u64) -> u64 {
    let mut v = value & 0x1f_ffff;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

/// The inverse: every third bit.
fn gathered(code: u64) -> u32 {
    let mut v = code & 0x1249_2492_4924_9249;
    v = (v | v >> 2) & 0x10c3_0c30_c30c_30c3;
    v = (v | v >> 4) & 0x100f_00f0_0f00_f00f;
    v = (v | v >> 8) & 0x001f_0000_ff00_00ff;
    v = (v | v >> 16) & 0x001f_0000_0000_ffff;
    ((v | v >> 32) & 0x1f_ffff) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_lie_in_the_boxes_of_their_cells() {
        let cube = Cube::around([DVec3::new(-3.0, 5.0, 1e6), DVec3::new(4.0, 6.0, 1e6 + 2.0)]);
        for place in [DVec3::new(-3.0, 5.5, 1e6), DVec3::new(4.0, 6.0, 1e6 + 2.0)] {
            for level in [0, 1, 5, 12] {
                let cell = Cell::of(cube.code(place), level);
                let bounds = cell.bounds(&cube);
                let slack = cube.side * 1e-9;
                assert!(place.cmpge(bounds.min - slack).all(), "{level}");
                assert!(place.cmple(bounds.max + slack).all(), "{level}");
                assert_eq!(cube.code_in(place, cell), cube.code(place));
            }
        }
        for value in [0, 1, 0x15_5555, 0x1f_ffff] {
            assert_eq!(u64::from(gathered(spread(value))), value);
        }
    }

    #[test]
    fn eighths_follow_each_other_and_know_where_they_are_from() {
        let cell = Cell::of(0x1234_5678_9abc_def0, 7);
        let children = cell.children();
        assert_eq!((children[0].first, children[7].end()), (cell.first, cell.end()));
        assert!(children.windows(2).all(|pair| pair[0].end() == pair[1].first));
        assert!(children.iter().all(|child| Cell::of(child.first, 7) == cell));
    }

    #[test]
    fn places_beyond_a_cell_get_its_nearest_code() {
        let cube = Cube::around([DVec3::ZERO, DVec3::ONE]);
        let cell = Cell::of(cube.code(DVec3::splat(0.3)), 2);
        for place in [DVec3::splat(-9.0), DVec3::splat(0.6), DVec3::NAN] {
            let code = cube.code_in(place, cell);
            assert!(code >= cell.first && code < cell.end());
        }
    }
}
