//! Voronoi cells in a tangent plane.

use glam::{DVec2, DVec3, Vec3};

/// Cosine between normals below which a neighbour lies on the back of a thin sheet; sharp edges
/// reach zero, acute ones somewhat less.
pub(crate) const BACK_SIDE: f32 = -0.5;

/// The Voronoi cell of the origin of a plane, cut from an octagon by the bisectors to neighbours.
pub(crate) struct Cell {
    corners: Vec<Corner>,
    /// Room for the corners after a cut.
    spare: Vec<Corner>,
    /// Square of the distance of the farthest corner.
    squared: f64,
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
        let mut cell = Self { corners: Vec::new(), spare: Vec::new(), squared: 0.0 };
        cell.reset(limit);
        cell
    }

    /// Makes it an octagon again.
    fn reset(&mut self, limit: f64) {
        // The cosine and the sine of 22.5 degrees, over the cosine.
        let (near, far) = (std::f64::consts::SQRT_2 - 1.0, 1.0);
        let corners = [
            (far, near),
            (near, far),
            (-near, far),
            (-far, near),
            (-far, -near),
            (-near, -far),
            (near, -far),
            (far, -near),
        ];
        self.corners.clear();
        let corner = |(x, y)| Corner { at: DVec2::new(x, y) * limit, bisector: false };
        self.corners.extend(corners.map(corner));
        self.measure();
    }

    fn measure(&mut self) {
        let squared = |corner: &Corner| corner.at.length_squared();
        self.squared = self.corners.iter().map(squared).fold(0.0, f64::max);
    }

    /// Makes it the cell of a point with this normal among the points near to it, at most `limit` wide: the sooner
    /// the nearest of them come, the quicker.
    pub(crate) fn become_of(&mut self, normal: Vec3, limit: f64, near: impl Iterator<Item = Near>) {
        self.reset(limit);
        let plane = TangentPlane::of(normal);
        for near in near {
            // The bisector to what is farther lies beyond the cell.
            if let Some(neighbour) = plane.place(&near, 4.0 * self.squared) {
                self.cut(neighbour);
            }
        }
    }

    /// Cuts off what is nearer to `neighbour` than to the origin.
    pub(crate) fn cut(&mut self, neighbour: DVec2) {
        let half = 0.5 * neighbour.length_squared();
        let beyond = |corner: &Corner| corner.at.dot(neighbour) - half;
        if self.corners.iter().all(|corner| beyond(corner) <= 0.0) {
            return;
        }
        self.spare.clear();
        let mut squared = 0.0f64;
        let Some(&(mut last)) = self.corners.last() else { return };
        let mut before = beyond(&last);
        for corner in &self.corners {
            let here = beyond(corner);
            if (before <= 0.0) != (here <= 0.0) {
                let at = last.at.lerp(corner.at, before / (before - here));
                squared = squared.max(at.length_squared());
                self.spare.push(Corner { at, bisector: before <= 0.0 || last.bisector });
            }
            if here <= 0.0 {
                squared = squared.max(corner.at.length_squared());
                self.spare.push(*corner);
            }
            (last, before) = (*corner, here);
        }
        self.squared = squared;
        std::mem::swap(&mut self.corners, &mut self.spare);
    }

    /// Its area.
    pub(crate) fn area(&self) -> f64 {
        let next = self.corners.iter().cycle().skip(1);
        0.5 * self.corners.iter().zip(next).map(|(a, b)| a.at.perp_dot(b.at)).sum::<f64>()
    }

    /// Whether bisectors bound it on all sides.
    pub(crate) fn is_closed(&self) -> bool {
        self.corners.iter().all(|corner| corner.bisector)
    }

    /// Makes it at most twice as wide as it is towards its bisectors, on average.
    fn even_out(&mut self) {
        let next = self.corners.iter().cycle().skip(1);
        let sides = self.corners.iter().zip(next).filter(|(corner, _)| corner.bisector);
        let (sum, count) = sides
            .filter_map(|(a, b)| Some((b.at - a.at).try_normalize()?.perp_dot(a.at).abs()))
            .fold((0.0, 0.0), |(sum, count), side| (sum + side, count + 1.0));
        if count == 0.0 {
            return;
        }
        for i in 0..8 {
            let across = DVec2::from_angle(f64::from(i) * std::f64::consts::FRAC_PI_4);
            self.cut(across * (4.0 * sum / count));
        }
    }

    /// Whether a ray from the origin leaves through a side that no bisector bounds.
    fn is_open_towards(&self, direction: DVec2) -> bool {
        let next = self.corners.iter().cycle().skip(1);
        let mut sides = self.corners.iter().zip(next);
        // Corners go round counterclockwise.
        let leaves = |(a, b): &(&Corner, &Corner)| {
            a.at.perp_dot(direction) >= 0.0 && direction.perp_dot(b.at) > 0.0
        };
        sides.find(leaves).is_some_and(|(corner, _)| !corner.bisector)
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

/// A point near another one.
#[derive(Clone, Copy)]
pub(crate) struct Near {
    /// From the other point to this one.
    pub(crate) offset: DVec3,
    /// Length of the offset.
    pub(crate) distance: f64,
    /// The surface's normal here.
    pub(crate) normal: Vec3,
}

/// The cell of a point in the plane perpendicular to its normal, among the points near to it, nearest
/// first; at most as wide as the farthest is away.
pub(crate) fn of(normal: Vec3, near: impl DoubleEndedIterator<Item = Near> + Clone) -> Cell {
    let mut cell = Cell::new(0.0);
    let limit = near.clone().next_back().map_or(0.0, |farthest| farthest.distance);
    cell.become_of(normal, limit, near);
    cell
}

/// [`of`], with open sides closed by mirror images of the neighbours on the other side: as at the
/// border of a surface, which goes half a step beyond its last points.
pub(crate) fn closed(normal: Vec3, near: impl DoubleEndedIterator<Item = Near> + Clone) -> Cell {
    let mut cell = of(normal, near.clone());
    if cell.is_closed() {
        return cell;
    }
    let mut open = Cell::new(0.0);
    open.corners.clone_from(&cell.corners);
    let plane = TangentPlane::of(normal);
    for neighbour in near.filter_map(|near| plane.place(&near, f64::INFINITY)) {
        if open.is_open_towards(-neighbour) {
            cell.cut(-neighbour);
        }
    }
    // Points on a line are open to both sides.
    if !cell.is_closed() {
        cell.even_out();
    }
    cell
}

/// Cosine between normals below which there is an edge between two points: 40 degrees.
const EDGE: f32 = 0.77;

/// Shares of its distance at which a neighbour beyond an edge counts.
const BEYOND: std::ops::RangeInclusive<f64> = 0.3..=2.2;

/// The plane perpendicular to a normal; any plane where it is invalid.
struct TangentPlane {
    normal: Vec3,
    u: DVec3,
    v: DVec3,
}

impl TangentPlane {
    fn of(normal: Vec3) -> Self {
        let (u, v) = normal.as_dvec3().try_normalize().unwrap_or(DVec3::Z).any_orthonormal_pair();
        Self { normal, u, v }
    }

    fn flat(&self, vector: DVec3) -> DVec2 {
        DVec2::new(vector.dot(self.u), vector.dot(self.v))
    }

    /// Where a point near the origin lies in the plane, where the square of its distance there is less than `reach`: at
    /// its distance in space, so that around a bend a cell has the size it has on the surface. A point beyond
    /// an edge counts as mirrored at the edge, where both tangent planes meet: to there the surface goes on in this
    /// plane. Points on the back of a thin sheet have no place, and neither has one straight above, which bounds
    /// nothing.
    fn place(&self, near: &Near, reach: f64) -> Option<DVec2> {
        let cosine = near.normal.dot(self.normal);
        if cosine < EDGE {
            return self.beyond_edge(near, cosine).filter(|at| at.length_squared() < reach);
        }
        if near.distance * near.distance >= reach {
            return None;
        }
        let flat = self.flat(near.offset);
        let length = flat.length();
        (length > 0.0 && length.is_finite()).then(|| flat * (near.distance / length))
    }

    fn beyond_edge(&self, near: &Near, cosine: f32) -> Option<DVec2> {
        if cosine < BACK_SIDE {
            return None;
        }
        let theirs = near.normal.as_dvec3();
        let across = self.flat(theirs);
        let half = theirs.dot(near.offset) / across.length_squared();
        let mirrored = 2.0 * half * across;
        let direction = mirrored.try_normalize()?;
        let share = mirrored.length() / near.distance;
        Some(direction * share.clamp(*BEYOND.start(), *BEYOND.end()) * near.distance)
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
    fn areas_are_those_of_a_square_and_of_the_octagon() {
        let cut = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]);
        assert!((cut.area() - 1.0).abs() < 1e-12);
        let octagon = 8.0 * std::f64::consts::FRAC_PI_8.tan() * 100.0;
        assert!((cell(&[]).area() - octagon).abs() < 1e-9);
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
