//! Heights over a plane, cell by cell.

use super::plane::area_within;
use glam::DVec2;
use rayon::prelude::*;

/// Surfels that a cell has on average: fewer leave holes, and more are blurred.
const PER_CELL: f64 = 4.0;

/// The most cells along a side.
const MOST_CELLS: f64 = 1024.0;

/// A surfel over the plane.
pub(super) struct Above {
    /// Where it is in the plane.
    pub(super) at: DVec2,
    /// How high above it.
    pub(super) height: f64,
    /// How much of it is seen from above: the cosine of its slope.
    pub(super) weight: f64,
}

/// A grid over a polygon.
pub(super) struct Grid {
    pub(super) side: f64,
    n: [usize; 2],
    /// The mean height in each cell, by what is seen from above; NaN where no surfel is.
    heights: Vec<f64>,
    /// What of each cell lies in the polygon.
    areas: Vec<f64>,
}

impl Grid {
    /// A grid of points within a polygon and their heights; `area` is that of the polygon.
    pub(super) fn new(polygon: &[DVec2], area: f64, points: &[Above]) -> Self {
        let low = polygon.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = polygon.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let side = (PER_CELL * area / points.len().max(1) as f64).sqrt();
        let side = side.max((high - low).max_element() / MOST_CELLS);
        let n = ((high - low) / side).to_array().map(|n| (n.ceil() as usize).max(1));
        let heights = heights(low, side, n, points);
        let cell_area = |i: usize| {
            let corner = low + DVec2::new((i % n[0]) as f64, (i / n[0]) as f64) * side;
            area_within(polygon, corner, corner + DVec2::splat(side))
        };
        let areas = (0..n[0] * n[1]).into_par_iter().map(cell_area).collect();
        Self { side, n, heights, areas }
    }

    /// The share of the polygon's area that lies in cells with surfels.
    pub(super) fn covered(&self) -> f64 {
        let both = || self.heights.iter().zip(&self.areas);
        let with = both().filter(|(height, _)| !height.is_nan()).map(|(_, area)| area).sum::<f64>();
        with / self.areas.iter().sum::<f64>()
    }

    /// Gives cells without surfels the mean of their neighbours, from the edges of holes inwards.
    pub(super) fn fill_holes(&mut self) {
        let holes = (0..self.heights.len()).filter(|&cell| self.heights[cell].is_nan());
        let mut edge: Vec<usize> = holes.filter(|&cell| self.around(cell).is_some()).collect();
        let mut is_known: Vec<bool> = self.heights.iter().map(|height| !height.is_nan()).collect();
        edge.iter().for_each(|&cell| is_known[cell] = true);
        while !edge.is_empty() {
            let found: Vec<Option<f64>> = edge.iter().map(|&cell| self.around(cell)).collect();
            edge.iter().zip(found).for_each(|(&cell, height)| {
                self.heights[cell] = height.unwrap_or_default();
            });
            let mut next = Vec::new();
            for cell in edge.iter().flat_map(|&cell| self.neighbours(cell)) {
                if !std::mem::replace(&mut is_known[cell], true) {
                    next.push(cell);
                }
            }
            edge = next;
        }
    }

    /// A cell and those around it.
    fn neighbours(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let [across, down] = self.n;
        let [x, y] = [cell % across, cell / across];
        let rows = y.saturating_sub(1)..(y + 2).min(down);
        let columns = x.saturating_sub(1)..(x + 2).min(across);
        rows.flat_map(move |y| columns.clone().map(move |x| y * across + x))
    }

    /// The mean of a cell's neighbours.
    fn around(&self, cell: usize) -> Option<f64> {
        let heights = self.neighbours(cell).map(|other| self.heights[other]);
        let (sum, n) = heights
            .filter(|height| !height.is_nan())
            .fold((0.0, 0u32), |(sum, n), height| (sum + height, n + 1));
        (n > 0).then(|| sum / f64::from(n))
    }

    /// What lies above the plane, and what below it.
    pub(super) fn volumes(&self) -> [f64; 2] {
        let cells = self.heights.iter().zip(&self.areas);
        cells.fold([0.0; 2], |[above, below], (height, area)| {
            [above + area * height.max(0.0), below + area * (-height).max(0.0)]
        })
    }
}

fn heights(low: DVec2, side: f64, n: [usize; 2], points: &[Above]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); n[0] * n[1]];
    for Above { at, height, weight } in points {
        let [x, y] = ((*at - low) / side).to_array().map(|share| share.max(0.0) as usize);
        let own = &mut sums[y.min(n[1] - 1) * n[0] + x.min(n[0] - 1)];
        *own = (own.0 + height * weight, own.1 + weight);
    }
    // Where nothing was added it is NaN.
    sums.into_iter().map(|(sum, weight)| sum / weight).collect()
}
