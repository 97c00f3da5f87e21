//! Nearest neighbours, by a k-d tree.

use crate::bounds::Bounds;
use crate::progress::{Cancelled, Progress, aside, each, flat_map, map, part, report, sort};
use glam::{DMat3, DQuat, DVec3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use std::num::NonZero;
use std::time::Duration;

/// A point near another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index into the positions: the first of those that coincide.
    pub index: usize,
    /// Distance, the unit of the positions.
    pub distance: f64,
}

/// Finds the nearest points of a set of positions.
///
/// Positions that coincide exactly count once, as the first of them: a thousand copies of a point
/// say no more about its surroundings than one, and would hide them from a search for 16 points.
/// Positions that are not finite are nobody's neighbour.
///
/// The search runs in a copy of the positions that is scaled to a box of about unit size, so that squared
/// distances neither overflow nor underflow, and turned by a fixed rotation: a k-d tree cannot split
/// points along an axis in which they are equal, so axis-aligned planes and lines would otherwise
/// end in buckets of thousands of points.
pub struct Neighbours {
    /// `None` where no position is finite.
    tree: Option<ImmutableKdTree<f64, 3>>,
    /// Distinct positions in the unit box, not turned, in the order of their first occurrence.
    distinct: Vec<DVec3>,
    /// For each of `distinct` the index of its first occurrence.
    first: Vec<u32>,
    /// For each position its place in `distinct`; `NOWHERE` where it is not finite.
    place: Vec<u32>,
    bounds: Bounds,
    /// Scene units per unit of the box.
    scale: f64,
}

/// Share of the work that is building the structure, for the progress of estimates that build
/// their own.
pub(crate) const SEARCH_SHARE: f64 = 0.1;

/// The place of a position that is not finite.
const NOWHERE: u32 = u32::MAX;

/// An angle about an axis without a simple relation to the axes or to each other.
fn turn() -> DMat3 {
    DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 0.754_877_666_246_693))
}

impl Neighbours {
    /// Builds the search structure: O(n log n) time, about 100 bytes a position.
    ///
    /// Where `progress` asks to stop while the tree grows, this returns at once; a thread that
    /// nobody waits for finishes the tree and drops it.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub fn build(positions: &[Vec3], progress: Progress<'_>) -> Result<Self, Cancelled> {
        let bounds = Bounds::of_positions(positions)
            .unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
        let extent = bounds.extent();
        // A power of two, so that scaling rounds nothing and equal distances stay equal.
        let scale = if extent > 0.0 { 2f64.powi(extent.log2().ceil() as i32) } else { 1.0 };
        let (first, place) = merge_coincident(positions, &part(progress, 0.0..0.4))?;
        let centre = bounds.centre();
        let distinct: Vec<DVec3> = map(first.len(), &part(progress, 0.4..0.45), |place| {
            (positions[first[place] as usize].as_dvec3() - centre) / scale
        })?;
        let tree = tree(&distinct, &part(progress, 0.45..1.0))?;
        Ok(Self { tree, distinct, first, place, bounds, scale })
    }

    /// Number of positions, coincident ones and those that are not finite included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.place.len()
    }

    /// Whether there are no positions at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.place.is_empty()
    }

    /// Number of different finite positions.
    #[must_use]
    pub fn n_distinct(&self) -> usize {
        self.distinct.len()
    }

    /// The box of the finite positions; a point at the origin where there are none.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The `k` nearest other points of position `index`, nearest first, ties by index; fewer where
    /// there are fewer, none where the position is not finite or out of range.
    #[must_use]
    pub fn nearest(&self, index: usize, k: usize) -> Vec<Neighbour> {
        let Some(place) = self.place_of(index) else { return Vec::new() };
        self.around(place, k)
            .into_iter()
            .map(|(other, distance)| Neighbour {
                index: self.first[other as usize] as usize,
                distance: distance * self.scale,
            })
            .collect()
    }

    /// The place of a position among the distinct ones.
    pub(crate) fn place_of(&self, index: usize) -> Option<usize> {
        self.place.get(index).filter(|&&place| place != NOWHERE).map(|&place| place as usize)
    }

    /// For each distinct position the index of its first occurrence.
    pub(crate) fn first(&self) -> &[u32] {
        &self.first
    }

    /// Distinct positions in the box of unit size.
    pub(crate) fn distinct(&self) -> &[DVec3] {
        &self.distinct
    }

    /// Scene units per unit of the box.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// Places and distances in the unit box of the `k` distinct positions nearest to `place`,
    /// itself left out, nearest first, ties by place.
    pub(crate) fn around(&self, place: usize, k: usize) -> Vec<(u32, f64)> {
        let wanted = k.saturating_add(1).min(self.distinct.len());
        let (Some(tree), Some(wanted)) = (&self.tree, NonZero::new(wanted)) else {
            return Vec::new();
        };
        let point = self.distinct[place];
        let found = tree
            .query(&(turn() * point).to_array())
            .nearest_n::<SquaredEuclidean<f64>>(wanted)
            .execute();
        let mut near: Vec<(u32, f64)> = found
            .iter()
            .filter(|result| result.item as usize != place)
            .map(|result| (result.item, self.distinct[result.item as usize].distance(point)))
            .collect();
        near.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        near.truncate(k);
        near
    }
}

/// The k-d tree of points, turned; `None` where there are none.
fn tree(
    points: &[DVec3],
    progress: Progress<'_>,
) -> Result<Option<ImmutableKdTree<f64, 3>>, Cancelled> {
    if points.is_empty() {
        report(progress, 1.0)?;
        return Ok(None);
    }
    let turn = turn();
    let turned =
        map(points.len(), &part(progress, 0.0..0.1), |place| (turn * points[place]).to_array())?;
    let count = points.len() as f64;
    let usually = Duration::from_secs_f64(10e-9 * count * count.log2());
    // The parallel construction picks pivots that depend on the number of threads.
    aside(&part(progress, 0.1..1.0), usually, move || {
        ImmutableKdTree::builder().with_serial_construction().build_from_slice(&turned).ok()
    })
}

/// The first occurrences of the different finite positions, and each position's place among them.
fn merge_coincident(
    positions: &[Vec3],
    progress: Progress<'_>,
) -> Result<(Vec<u32>, Vec<u32>), Cancelled> {
    let keys = flat_map(positions.len(), &part(progress, 0.0..0.1), |index| {
        // Adding zero makes the two zeros one.
        let key = (positions[index] + Vec3::ZERO).to_array().map(f32::to_bits);
        let index = u32::try_from(index).ok().filter(|_| positions[index].is_finite());
        index.map(|index| (key, index)).into_iter()
    })?;
    let count = keys.len();
    let mut sorted = sort(keys, &part(progress, 0.1..0.7))?.into_iter().flatten();
    let mut leader = vec![NOWHERE; positions.len()];
    let mut leading = ([0; 3], NOWHERE);
    each(count, &part(progress, 0.7..0.9), |_| {
        let Some((key, index)) = sorted.next() else { return };
        if leading.1 == NOWHERE || leading.0 != key {
            leading = (key, index);
        }
        leader[index as usize] = leading.1;
    })?;
    let mut first = Vec::new();
    let mut place = vec![NOWHERE; positions.len()];
    each(positions.len(), &part(progress, 0.9..1.0), |index| {
        let leading = leader[index];
        if leading == NOWHERE {
            return;
        }
        // Leaders come before their followers, since equal ones are sorted by index.
        if leading as usize == index {
            place[index] = first.len() as u32;
            first.push(leading);
        } else {
            place[index] = place[leading as usize];
        }
    })?;
    Ok((first, place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::{grid, random_sphere};

    fn built(positions: &[Vec3]) -> Neighbours {
        Neighbours::build(positions, &silent).unwrap()
    }

    fn brute_force(positions: &[Vec3], index: usize, k: usize) -> Vec<f64> {
        let mut distances: Vec<f64> = positions
            .iter()
            .map(|p| p.as_dvec3().distance(positions[index].as_dvec3()))
            .filter(|&distance| distance > 0.0)
            .collect();
        distances.sort_by(f64::total_cmp);
        distances.truncate(k);
        distances
    }

    #[test]
    fn neighbours_are_those_of_a_full_search() {
        let positions = random_sphere(700, DVec3::new(3.0, -2.0, 9.0), 2.0, 1);
        let neighbours = built(&positions);
        for index in 0..positions.len() {
            let expected = brute_force(&positions, index, 12);
            let found = neighbours.nearest(index, 12);
            assert_eq!(found.len(), 12);
            for (neighbour, distance) in found.iter().zip(expected) {
                assert!((neighbour.distance - distance).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn ten_thousand_equal_points_have_no_other_point() {
        let neighbours = built(&vec![Vec3::splat(0.3); 10_000]);
        assert_eq!(neighbours.len(), 10_000);
        assert_eq!(neighbours.n_distinct(), 1);
        assert!(neighbours.nearest(9_999, 16).is_empty());
    }

    #[test]
    fn copies_do_not_hide_the_surroundings() {
        let mut positions = grid(10, Vec3::X, Vec3::Y);
        positions.extend(vec![Vec3::ZERO; 10_000]);
        let neighbours = built(&positions);
        let near = neighbours.nearest(10_050, 2);
        assert_eq!(near.iter().map(|n| n.index).collect::<Vec<_>>(), [1, 10]);
    }

    #[test]
    fn axis_aligned_lines_and_planes_are_searched_quickly_and_right() {
        let line: Vec<Vec3> = (0..50_000).map(|i| Vec3::X * i as f32).collect();
        let neighbours = built(&line);
        for index in 1..line.len() - 1 {
            let near = neighbours.nearest(index, 2);
            assert_eq!([near[0].index, near[1].index], [index - 1, index + 1]);
        }
        let plane = grid(200, Vec3::X, Vec3::Z);
        let neighbours = built(&plane);
        let centre = 100 * 200 + 100;
        assert!(neighbours.nearest(centre, 4).iter().all(|n| n.distance == 1.0));
    }

    #[test]
    fn distances_hold_at_every_scale() {
        for scale in [1e-30f32, 1e-20, 1.0, 1e20, 1e28, 1e38] {
            let positions = [0.0, 1.0, 3.0].map(|x| Vec3::X * (x * scale));
            let near = built(&positions).nearest(1, 5);
            assert_eq!([near[0].index, near[1].index], [0, 2]);
            assert!((near[1].distance / f64::from(2.0 * scale) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn positions_that_are_not_finite_are_nobodys_neighbour() {
        let positions = [Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::new(0.0, f32::INFINITY, 0.0)];
        let neighbours = built(&positions);
        assert_eq!(neighbours.nearest(0, 9), [Neighbour { index: 2, distance: 1.0 }]);
        assert!(neighbours.nearest(1, 9).is_empty());
        assert!(neighbours.nearest(99, 9).is_empty());
    }

    #[test]
    fn no_points_have_no_neighbours() {
        let neighbours = built(&[]);
        assert!(neighbours.is_empty());
        assert!(neighbours.nearest(0, 3).is_empty());
    }

    #[test]
    fn the_two_zeros_are_one_position() {
        let neighbours = built(&[Vec3::ZERO, -Vec3::ZERO]);
        assert_eq!(neighbours.n_distinct(), 1);
    }
}
