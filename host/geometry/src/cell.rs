use glam::DVec2;

/// The Voronoi cell of the origin of a plane, cut from an octagon by the bisectors to neighbours.
pub(crate) struct Cell {
    corners: Vec<Corner>,
}

/// A corner and what bounds the cell from here to the next one.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    /// Whether the edge that starts here is a bisector rather than a side of the octagon.
    bisector: bool,
}

impl Cell {
    /// An octagon whose sides are `limit` away.
    pub(crate) fn new(limit: f64) -> Self {
        let angle = |i: u32| (f64::from(i) + 0.5) * std::f64::consts::FRAC_PI_4;
        let reach = limit / std::f64::consts::FRAC_PI_8.cos();
        let corners = (0..8)
            .map(|i| Corner { at: DVec2::from_angle(angle(i)) * reach, bisector: false })
            .collect();
        Self { corners }
    }

    /// Cuts off what is nearer to `neighbour` than to the origin.
    pub(crate) fn cut(&mut self, neighbour: DVec2) {
        let half = 0.5 * neighbour.length_squared();
        let beyond = |corner: &Corner| corner.at.dot(neighbour) - half;
        if self.corners.iter().all(|corner| beyond(corner) <= 0.0) {
            return;
        }
        let mut kept = Vec::with_capacity(self.corners.len() + 1);
        for (i, corner) in self.corners.iter().enumerate() {
            let next = &self.corners[(i + 1) % self.corners.len()];
            let (here, there) = (beyond(corner), beyond(next));
            if here <= 0.0 {
                kept.push(*corner);
            }
            if (here <= 0.0) != (there <= 0.0) {
                let at = corner.at.lerp(next.at, here / (here - there));
                kept.push(Corner { at, bisector: here <= 0.0 || corner.bisector });
            }
        }
        self.corners = kept;
    }

    /// Distance of the farthest corner.
    pub(crate) fn reach(&self) -> f64 {
        self.corners.iter().map(|corner| corner.at.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// Whether bisectors bound it on all sides.
    pub(crate) fn is_closed(&self) -> bool {
        self.corners.iter().all(|corner| corner.bisector)
    }

    /// Distance of the farthest corner where two bisectors meet. Where there is none, as for points
    /// on a line, the farthest bisector stands in, times the square root of two that lies between
    /// side and corner of a square cell. `None` where there is no bisector.
    pub(crate) fn radius(&self) -> Option<f64> {
        let mut corner_distance: Option<f64> = None;
        let mut side_distance: Option<f64> = None;
        for (i, corner) in self.corners.iter().enumerate() {
            if !corner.bisector {
                continue;
            }
            let last = &self.corners[(i + self.corners.len() - 1) % self.corners.len()];
            let next = &self.corners[(i + 1) % self.corners.len()];
            if last.bisector {
                let distance = corner.at.length();
                corner_distance = Some(corner_distance.unwrap_or(0.0f64).max(distance));
            }
            if let Some(along) = (next.at - corner.at).try_normalize() {
                let distance = along.perp_dot(corner.at).abs();
                side_distance = Some(side_distance.unwrap_or(0.0f64).max(distance));
            }
        }
        corner_distance.or(side_distance.map(|distance| distance * std::f64::consts::SQRT_2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(neighbours: &[(f64, f64)]) -> Cell {
        let mut cell = Cell::new(10.0);
        for &(x, y) in neighbours {
            cell.cut(DVec2::new(x, y));
        }
        cell
    }

    #[test]
    fn the_cell_of_a_square_grid_reaches_half_a_diagonal() {
        let cell = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 1.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_cell_on_a_line_is_as_wide_as_a_square() {
        let cell = cell(&[(1.0, 0.0), (-1.0, 0.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_cell_without_neighbours_has_no_radius() {
        assert_eq!(cell(&[]).radius(), None);
    }

    #[test]
    fn the_open_side_of_a_border_cell_does_not_count() {
        let cell = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
    }
}
