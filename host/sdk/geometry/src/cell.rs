//! Voronoi cells in a tangent plane.

use glam::{Vec2, Vec3};

/// Cosine between normals below which a neighbour lies on the back of a thin sheet; sharp edges
/// reach zero, acute ones somewhat less.
pub(crate) const BACK_SIDE: f32 = -0.5;

/// Corners of a cell, at most: of so many one more that is cut off changes next to nothing.
const MOST: usize = 32;

/// The Voronoi cell of the origin of a plane, cut from an octagon by the bisectors to neighbours.
///
/// Corners are in shares of the octagon's size, so that f32 holds them: a millionth of a cell is far less than the
/// positions of neighbours are exact to.
#[derive(Clone)]
pub(crate) struct Cell {
    /// The corners counterclockwise, of which the first `count` are the cell's.
    corners: [Vec2; MOST],
    count: usize,
    /// A bit for each corner: whether the edge from there to the next one is a bisector rather than a side of the
    /// octagon.
    bisectors: u32,
    /// Square of the distance of the farthest corner.
    squared: f32,
    /// Distance of the octagon's sides, in the unit of the neighbours.
    size: f64,
}

/// So many bits.
fn ones(count: usize) -> u32 {
    ((1u64 << count) - 1) as u32
}

impl Cell {
    /// An octagon whose sides are `size` away.
    pub(crate) fn new(size: f64) -> Self {
        let corners = [Vec2::ZERO; MOST];
        let mut cell = Self { corners, count: 0, bisectors: 0, squared: 0.0, size };
        cell.reset(size);
        cell
    }

    /// Makes it an octagon again.
    fn reset(&mut self, size: f64) {
        self.size = size;
        // The sine of 22.5 degrees over the cosine.
        let near = std::f32::consts::SQRT_2 - 1.0;
        let quarter = [Vec2::new(1.0, near), Vec2::new(near, 1.0)];
        for (i, corners) in self.corners[..8].chunks_exact_mut(2).enumerate() {
            let turned = |corner: Vec2| [corner, corner.perp(), -corner, -corner.perp()][i];
            corners.copy_from_slice(&quarter.map(turned));
        }
        (self.count, self.bisectors) = (8, 0);
        self.squared = near * near + 1.0;
    }

    fn is_bisector(&self, i: usize) -> bool {
        self.bisectors >> i & 1 == 1
    }

    /// Each corner with the next one, and whether a bisector leads there.
    fn edges(&self) -> impl Iterator<Item = (Vec2, Vec2, bool)> {
        let next = |i: usize| if i + 1 < self.count { i + 1 } else { 0 };
        let corners = &self.corners;
        (0..self.count).map(move |i| (corners[i], corners[next(i)], self.is_bisector(i)))
    }

    /// Makes it the cell of a point with this normal among the points near to it, at most `size` wide: the sooner
    /// the nearest of them come, the quicker.
    pub(crate) fn become_of(&mut self, normal: Vec3, size: f64, near: impl Iterator<Item = Near>) {
        self.reset(size);
        let plane = TangentPlane::of(normal, size);
        for near in near {
            // The bisector to what is farther lies beyond the cell.
            if let Some(neighbour) = plane.place(&near, 4.0 * self.squared) {
                self.cut(neighbour);
            }
        }
    }

    /// Cuts off what is nearer to `neighbour` than to the origin, in shares of the octagon's size.
    fn cut(&mut self, neighbour: Vec2) {
        let half = 0.5 * neighbour.length_squared();
        let beyond = |corner: Vec2| corner.dot(neighbour) - half;
        let count = self.count.min(MOST);
        let mut off = 0u32;
        for (i, &corner) in self.corners[..count].iter().enumerate() {
            off |= u32::from(beyond(corner) > 0.0) << i;
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
        let crossing = |from: usize, to: usize| {
            let (from, to) = (self.corners[from], self.corners[wrapped(to)]);
            let (inside, outside) = (beyond(from), beyond(to));
            from.lerp(to, inside / (inside - outside))
        };
        let entering = wrapped(start + count - 1);
        let new = [crossing(wrapped(start + left - 1), start + left), crossing(entering, start)];
        self.replace(start, left, new);
        self.squared = self.corners[..self.count]
            .iter()
            .fold(0.0, |most, corner| f32::max(most, corner.length_squared()));
    }

    /// Leaves a row of corners from `start` on, which may go on at the first one, and puts two new ones between its end
    /// and its start; a bisector goes from the one to the other.
    fn replace(&mut self, start: usize, left: usize, new: [Vec2; 2]) {
        let (count, bits) = (self.count, u64::from(self.bisectors));
        // The edge to the first corner that is left goes on from the second new one.
        let entering = bits >> (if start > 0 { start } else { count } - 1) & 1;
        let new_bits = 1 | entering << 1;
        let (at, tail) =
            if start + left <= count { (left, 0) } else { (start + left - count, count - start) };
        let low = if tail == 0 { bits >> start } else { bits };
        let high = if tail == 0 { 0 } else { bits >> start };
        self.bisectors = (low & u64::from(ones(at)) | new_bits << at | high << (at + 2)) as u32;
        if tail == 0 {
            // Nothing to do where it starts at the first.
            for i in 0..if start > 0 { left } else { 0 } {
                self.corners[i] = self.corners[start + i];
            }
        } else if at + 2 < start {
            for i in 0..tail {
                self.corners[at + 2 + i] = self.corners[start + i];
            }
        } else if at + 2 > start {
            for i in (0..tail).rev() {
                self.corners[at + 2 + i] = self.corners[start + i];
            }
        }
        self.corners[at] = new[0];
        self.corners[at + 1] = new[1];
        self.count = left + 2;
    }

    /// Its area, squared unit of the neighbours.
    pub(crate) fn area(&self) -> f64 {
        let twice = self.edges().map(|(a, b, _)| f64::from(a.perp_dot(b))).sum::<f64>();
        0.5 * twice * self.size * self.size
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
            .fold((0.0f32, 0.0f32), |(sum, count), side| (sum + side, count + 1.0));
        if count == 0.0 {
            return;
        }
        for i in 0..8u8 {
            let across = Vec2::from_angle(f32::from(i) * std::f32::consts::FRAC_PI_4);
            self.cut(across * (4.0 * sum / count));
        }
    }

    /// Whether a ray from the origin leaves through a side that no bisector bounds.
    fn is_open_towards(&self, direction: Vec2) -> bool {
        // Corners go round counterclockwise.
        let leaves = |(a, b, _): &(Vec2, Vec2, bool)| {
            a.perp_dot(direction) >= 0.0 && direction.perp_dot(*b) > 0.0
        };
        self.edges().find(leaves).is_some_and(|(_, _, is_bisector)| !is_bisector)
    }

    /// Distance of the farthest corner where two bisectors meet, unit of the neighbours. Where there is none, as for
    /// points on a line, the farthest bisector stands in, times the square root of two that lies between
    /// side and corner of a square cell. `None` where there is no bisector.
    pub(crate) fn radius(&self) -> Option<f64> {
        let share = if self.count > 0 && self.is_closed() {
            Some(self.squared.sqrt())
        } else {
            self.open_radius()
        };
        share.map(|share| f64::from(share) * self.size)
    }

    /// [`Self::radius`] of a cell that is open, in shares of the octagon's size.
    fn open_radius(&self) -> Option<f32> {
        let mut corner_distance: Option<f32> = None;
        let mut side_distance: Option<f32> = None;
        let mut last = self.count > 0 && self.is_bisector(self.count - 1);
        for (a, b, is_bisector) in self.edges() {
            if is_bisector && last {
                let distance = a.length();
                corner_distance = Some(corner_distance.unwrap_or(0.0f32).max(distance));
            }
            if is_bisector && let Some(along) = (b - a).try_normalize() {
                let distance = along.perp_dot(a).abs();
                side_distance = Some(side_distance.unwrap_or(0.0f32).max(distance));
            }
            last = is_bisector;
        }
        corner_distance.or(side_distance.map(|distance| distance * std::f32::consts::SQRT_2))
    }
}

/// A point near another one.
#[derive(Clone, Copy)]
pub(crate) struct Near {
    /// From the other point to this one.
    pub(crate) offset: Vec3,
    /// Length of the offset.
    pub(crate) distance: f32,
    /// The surface's normal here.
    pub(crate) normal: Vec3,
}

/// The cell of a point in the plane perpendicular to its normal, among the points near to it, nearest
/// first; at most as wide as the farthest is away.
pub(crate) fn of(normal: Vec3, near: impl DoubleEndedIterator<Item = Near> + Clone) -> Cell {
    let mut cell = Cell::new(0.0);
    let limit = near.clone().next_back().map_or(0.0, |farthest| f64::from(farthest.distance));
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
    let plane = TangentPlane::of(normal, cell.size);
    for neighbour in near.filter_map(|near| plane.place(&near, f32::INFINITY)) {
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
const BEYOND: std::ops::RangeInclusive<f32> = 0.3..=2.2;

/// The plane perpendicular to a normal; any plane where it is invalid.
struct TangentPlane {
    normal: Vec3,
    u: Vec3,
    v: Vec3,
    /// What lengths are multiplied with.
    factor: f32,
}

impl TangentPlane {
    /// Lengths in it are in shares of `size`; all 0 where that is no number to divide by.
    fn of(normal: Vec3, size: f64) -> Self {
        let (u, v) = normal.try_normalize().unwrap_or(Vec3::Z).any_orthonormal_pair();
        let factor = (1.0 / size) as f32;
        Self { normal, u, v, factor: if factor.is_finite() { factor } else { 0.0 } }
    }

    fn flat(&self, vector: Vec3) -> Vec2 {
        Vec2::new(vector.dot(self.u), vector.dot(self.v))
    }

    /// Where a point near the origin lies in the plane, where the square of its distance there is less than `reach`: at
    /// its distance in space, so that around a bend a cell has the size it has on the surface. A point beyond
    /// an edge counts as mirrored at the edge, where both tangent planes meet: to there the surface goes on in this
    /// plane. Points on the back of a thin sheet have no place, and neither has one straight above, which bounds
    /// nothing.
    fn place(&self, near: &Near, reach: f32) -> Option<Vec2> {
        let cosine = near.normal.dot(self.normal);
        let distance = near.distance * self.factor;
        if cosine < EDGE {
            return self.beyond_edge(near, cosine).filter(|at| at.length_squared() < reach);
        }
        if distance * distance >= reach {
            return None;
        }
        let flat = self.flat(near.offset * self.factor);
        let length = flat.length();
        (length > 0.0 && length.is_finite()).then(|| flat * (distance / length))
    }

    fn beyond_edge(&self, near: &Near, cosine: f32) -> Option<Vec2> {
        if cosine < BACK_SIDE {
            return None;
        }
        let (offset, distance) = (near.offset * self.factor, near.distance * self.factor);
        let across = self.flat(near.normal);
        let half = near.normal.dot(offset) / across.length_squared();
        let mirrored = 2.0 * half * across;
        let direction = mirrored.try_normalize()?;
        let share = mirrored.length() / distance;
        Some(direction * share.clamp(*BEYOND.start(), *BEYOND.end()) * distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of several steps rounds shares to 6e-8.
    const ROUNDING: f64 = 1e-6;

    fn cell(neighbours: &[(f32, f32)]) -> Cell {
        let mut cell = Cell::new(10.0);
        for &(x, y) in neighbours {
            cell.cut(Vec2::new(x, y) / 10.0);
        }
        cell
    }

    #[test]
    fn the_cell_of_a_square_grid_reaches_half_a_diagonal() {
        let cell = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 1.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < ROUNDING);
    }

    #[test]
    fn the_cell_on_a_line_is_as_wide_as_a_square() {
        let cell = cell(&[(1.0, 0.0), (-1.0, 0.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < ROUNDING);
    }

    #[test]
    fn areas_are_those_of_a_square_and_of_the_octagon() {
        let cut = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]);
        assert!((cut.area() - 1.0).abs() < ROUNDING);
        let octagon = 8.0 * std::f64::consts::FRAC_PI_8.tan() * 100.0;
        assert!((cell(&[]).area() / octagon - 1.0).abs() < ROUNDING);
    }

    #[test]
    fn a_cell_without_neighbours_has_no_radius() {
        assert_eq!(cell(&[]).radius(), None);
    }

    #[test]
    fn the_open_side_of_a_border_cell_does_not_count() {
        let cell = cell(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]);
        assert!((cell.radius().unwrap() - 0.5f64.sqrt()).abs() < ROUNDING);
    }
}
