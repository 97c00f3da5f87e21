//! Voronoi cells in a tangent plane.

use glam::{DVec2, DVec3, Vec3};

/// Cosine between normals below which a neighbour lies on the back of a thin sheet; sharp edges
/// reach zero, acute ones somewhat less.
pub(crate) const BACK_SIDE: f32 = -0.5;

/// Corners of a cell, at most: of so many one more that is cut off changes next to nothing.
const MOST: usize = 32;

/// The Voronoi cell of the origin of a plane, cut from an octagon by the bisectors to neighbours.
#[derive(Clone)]
pub(crate) struct Cell {
    /// The corners counterclockwise, of which the first `count` are the cell's.
    x: [f64; MOST],
    y: [f64; MOST],
    count: usize,
    /// A bit for each corner: whether the edge from there to the next one is a bisector rather than a side of the
    /// octagon.
    bisectors: u32,
    /// Square of the distance of the farthest corner.
    squared: f64,
}

/// So many bits.
fn ones(count: usize) -> u32 {
    ((1u64 << count) - 1) as u32
}

impl Cell {
    /// An octagon whose sides are `limit` away.
    pub(crate) fn new(limit: f64) -> Self {
        let (x, y) = ([0.0; MOST], [0.0; MOST]);
        let mut cell = Self { x, y, count: 0, bisectors: 0, squared: 0.0 };
        cell.reset(limit);
        cell
    }

    /// Makes it an octagon again.
    fn reset(&mut self, limit: f64) {
        // The cosine and the sine of 22.5 degrees, over the cosine.
        let (near, far) = ((std::f64::consts::SQRT_2 - 1.0) * limit, limit);
        let x = [far, near, -near, -far, -far, -near, near, far];
        let y = [near, far, far, near, -near, -far, -far, -near];
        self.x[..x.len()].copy_from_slice(&x);
        self.y[..y.len()].copy_from_slice(&y);
        (self.count, self.bisectors) = (x.len(), 0);
        self.squared = near * near + far * far;
    }

    fn corner(&self, i: usize) -> DVec2 {
        DVec2::new(self.x[i], self.y[i])
    }

    fn is_bisector(&self, i: usize) -> bool {
        self.bisectors >> i & 1 == 1
    }

    /// Each corner with the next one, and whether a bisector leads there.
    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2, bool)> {
        let next = |i: usize| if i + 1 < self.count { i + 1 } else { 0 };
        (0..self.count).map(move |i| (self.corner(i), self.corner(next(i)), self.is_bisector(i)))
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
        let count = self.count.min(MOST);
        let mut beyond = [0.0; MOST];
        let corners = self.x[..count].iter().zip(&self.y[..count]);
        for (beyond, (x, y)) in beyond.iter_mut().zip(corners) {
            *beyond = x * neighbour.x + y * neighbour.y - half;
        }
        let mut off = 0u32;
        for (i, beyond) in beyond[..count].iter().enumerate() {
            off |= u32::from(*beyond > 0.0) << i;
        }
        let all = ones(count);
        if off == 0 || off == all {
            return;
        }
        // A line leaves one row of corners of a convex cell; where rounding makes two of it, the first is left.
        let before = (off << 1 | off >> (count - 1)) & all;
        let start = (!off & before & all).trailing_zeros() as usize;
        let turned = (u64::from(off) >> start | u64::from(off) << (count - start)) as u32 & all;
        let left = turned.trailing_zeros() as usize;
        if left + 2 > MOST {
            return;
        }
        let wrapped = |i: usize| if i < count { i } else { i - count };
        let (last, leaving, entering) =
            (wrapped(start + left - 1), wrapped(start + left), wrapped(start + count - 1));
        let crossing = |from: usize, to: usize| {
            self.corner(from).lerp(self.corner(to), beyond[from] / (beyond[from] - beyond[to]))
        };
        let new = [crossing(last, leaving), crossing(entering, start)];
        let entering = self.is_bisector(entering);
        let bits = u64::from(self.bisectors);
        if start == 0 {
            // They stand where they should.
        } else if start + left <= count {
            self.x.copy_within(start..start + left, 0);
            self.y.copy_within(start..start + left, 0);
        } else {
            self.x[..count].rotate_left(start);
            self.y[..count].rotate_left(start);
        }
        let turned = (bits >> start | bits << (count - start)) as u32 & ones(left);
        self.bisectors = turned | 1 << left | u32::from(entering) << (left + 1);
        for (i, corner) in new.into_iter().enumerate() {
            (self.x[left + i], self.y[left + i]) = (corner.x, corner.y);
        }
        self.count = left + 2;
        let corners = self.x[..self.count].iter().zip(&self.y[..self.count]);
        self.squared = corners.fold(0.0, |most, (x, y)| f64::max(most, x * x + y * y));
    }

    /// Its area.
    pub(crate) fn area(&self) -> f64 {
        0.5 * self.edges().map(|(a, b, _)| a.perp_dot(b)).sum::<f64>()
    }

    /// Whether bisectors bound it on all sides.
    pub(crate) fn is_closed(&self) -> bool {
        self.bisectors == ones(self.count)
    }

    /// Makes it at most twice as wide as it is towards its bisectors, on average.
    fn even_out(&mut self) {
        let (sum, count) = self
            .edges()
            .filter(|(_, _, is_bisector)| *is_bisector)
            .filter_map(|(a, b, _)| Some((b - a).try_normalize()?.perp_dot(a).abs()))
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
        // Corners go round counterclockwise.
        let leaves = |(a, b, _): &(DVec2, DVec2, bool)| {
            a.perp_dot(direction) >= 0.0 && direction.perp_dot(*b) > 0.0
        };
        self.edges().find(leaves).is_some_and(|(_, _, is_bisector)| !is_bisector)
    }

    /// Distance of the farthest corner where two bisectors meet. Where there is none, as for points
    /// on a line, the farthest bisector stands in, times the square root of two that lies between
    /// side and corner of a square cell. `None` where there is no bisector.
    pub(crate) fn radius(&self) -> Option<f64> {
        if self.count > 0 && self.is_closed() {
            return Some(self.squared.sqrt());
        }
        let mut corner_distance: Option<f64> = None;
        let mut side_distance: Option<f64> = None;
        let mut last = self.count > 0 && self.is_bisector(self.count - 1);
        for (a, b, is_bisector) in self.edges() {
            if is_bisector && last {
                let distance = a.length();
                corner_distance = Some(corner_distance.unwrap_or(0.0f64).max(distance));
            }
            if is_bisector && let Some(along) = (b - a).try_normalize() {
                let distance = along.perp_dot(a).abs();
                side_distance = Some(side_distance.unwrap_or(0.0f64).max(distance));
            }
            last = is_bisector;
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
    let open = cell.clone();
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
