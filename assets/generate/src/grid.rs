//! A uniform grid of cells that finds points near a place.

use std::collections::HashMap;

use glam::{DVec3, I64Vec3};

/// Indices of points by cell.
#[derive(Debug)]
pub struct Grid {
    side: f64,
    cells: HashMap<I64Vec3, Vec<usize>>,
}

impl Grid {
    /// An empty grid of cells with this side.
    #[must_use]
    pub fn new(side: f64) -> Self {
        Self { side, cells: HashMap::new() }
    }

    fn cell(&self, point: DVec3) -> I64Vec3 {
        (point / self.side).floor().as_i64vec3()
    }

    /// Adds a point under an index.
    pub fn insert(&mut self, point: DVec3, index: usize) {
        let cell = self.cell(point);
        self.cells.entry(cell).or_default().push(index);
    }

    /// The indices of all points within `reach`, and of some beyond, in an order that depends on
    /// the points alone.
    pub fn near(&self, point: DVec3, reach: f64) -> impl Iterator<Item = usize> + '_ {
        let low = self.cell(point - DVec3::splat(reach));
        let high = self.cell(point + DVec3::splat(reach));
        let cells = (low.x..=high.x).flat_map(move |x| {
            (low.y..=high.y).flat_map(move |y| (low.z..=high.z).map(move |z| I64Vec3::new(x, y, z)))
        });
        cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::Random;

    #[test]
    fn no_near_point_is_missed() {
        let mut random = Random::new(5);
        let points: Vec<_> = (0..500).map(|_| random.in_cube()).collect();
        let mut grid = Grid::new(0.13);
        for (index, point) in points.iter().enumerate() {
            grid.insert(*point, index);
        }
        for centre in &points {
            let found: Vec<_> = grid.near(*centre, 0.3).collect();
            for (index, point) in points.iter().enumerate() {
                assert!(point.distance(*centre) > 0.3 || found.contains(&index));
            }
        }
    }
}
