//! Nearest neighbours, by a k-d tree.

mod search;
mod shared;
mod tree;

use crate::bounds::Bounds;
use crate::progress::{Cancelled, Progress, each, flat_map, part, report, sort};
use glam::{DVec3, Vec3};
pub(crate) use search::{Found, Scratch};
pub(crate) use shared::{Close, Shared};
use std::sync::OnceLock;
use tree::Site;
pub(crate) use tree::Tree;

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
/// The search runs in a copy of the positions, multiplied by a power of two such that neighbours are
/// about one unit apart: squared distances neither overflow nor underflow, and nothing is rounded.
#[derive(Debug)]
pub struct Neighbours {
    /// The distinct finite positions; their place in it is what the rest of this crate calls them by.
    tree: Tree,
    /// Of each position that coincides with an earlier one, its index and that of the first.
    copies: Vec<(u32, u32)>,
    /// Number of positions.
    count: usize,
    /// For each position its place; `NOWHERE` where it is not finite. Made when it is first asked for.
    place: OnceLock<Vec<u32>>,
    bounds: Bounds,
    /// Scene units per unit of the search.
    scale: f64,
}

/// Share of the work that is building the structure, for the progress of estimates that build
/// their own.
pub(crate) const SEARCH_SHARE: f64 = 0.1;

/// The place of a position that is not finite.
const NOWHERE: u32 = u32::MAX;

impl Neighbours {
    /// Builds the search structure: O(n log n) time, 19 to 22 bytes a position, and about as many more on the way.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub fn build(positions: &[Vec3], progress: Progress<'_>) -> Result<Self, Cancelled> {
        let bounds = Bounds::of_positions(positions)
            .unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
        report(progress, 0.0)?;
        let (first, copies) = merge_coincident(positions, &part(progress, 0.0..0.5))?;
        let scale = spacing(positions, &first, bounds);
        let sites = first
            .iter()
            .map(|&index| {
                let at = (positions[index as usize].as_dvec3() / scale).as_vec3();
                Site { at: at.to_array(), index }
            })
            .collect();
        drop(first);
        let tree = Tree::build(sites, &part(progress, 0.5..1.0))?;
        let (count, place) = (positions.len(), OnceLock::new());
        Ok(Self { tree, copies, count, place, bounds, scale })
    }

    /// Number of positions, coincident ones and those that are not finite included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no positions at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Number of different finite positions.
    #[must_use]
    pub fn n_distinct(&self) -> usize {
        self.tree.len()
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
        let mut room = Scratch::default();
        let near = self.around_in_order(place, k, &mut room).iter();
        let mut near: Vec<Neighbour> = near
            .map(|found| Neighbour {
                index: self.index(found.place as usize),
                distance: found.distance * self.scale,
            })
            .collect();
        near.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
        near
    }

    /// The place of a position among the distinct ones.
    pub(crate) fn place_of(&self, index: usize) -> Option<usize> {
        let all = || {
            let mut places = vec![NOWHERE; self.count];
            (0..self.tree.len()).for_each(|place| places[self.index(place)] = place as u32);
            self.copy_to_copies(&mut places);
            places
        };
        let place = self.place.get_or_init(all).get(index);
        place.filter(|&&place| place != NOWHERE).map(|&place| place as usize)
    }

    /// Values of all positions from those of places; `missing` where a position is not finite.
    pub(crate) fn by_index<T: Copy>(
        &self,
        missing: T,
        progress: Progress<'_>,
        value: impl Fn(usize) -> T,
    ) -> Result<Vec<T>, Cancelled> {
        let mut values = vec![missing; self.count];
        each(self.tree.len(), progress, |place| values[self.index(place)] = value(place))?;
        self.copy_to_copies(&mut values);
        Ok(values)
    }

    /// Gives positions that coincide with an earlier one its value.
    pub(crate) fn copy_to_copies<T: Copy>(&self, values: &mut [T]) {
        for &(copy, original) in &self.copies {
            values[copy as usize] = values[original as usize];
        }
    }

    /// The index of the first occurrence of the position at a place.
    pub(crate) fn index(&self, place: usize) -> usize {
        self.tree.index(place)
    }

    /// The position at a place, in units of the search.
    pub(crate) fn point(&self, place: usize) -> DVec3 {
        self.tree.point(place)
    }

    /// The leaves of the search: points that lie together have places that do.
    pub(crate) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Scene units per unit of the search.
    pub(crate) fn scale(&self) -> f64 {
        self.scale
    }

    /// The `k` distinct positions nearest to `place`, itself left out, nearest first, ties by place. Which of
    /// several that are equally far is last depends on nothing but the positions and their order.
    pub(crate) fn around_in_order<'a>(
        &self,
        place: usize,
        k: usize,
        room: &'a mut Scratch,
    ) -> &'a [Found] {
        room.nearest(&self.tree, place, k)
    }

    /// [`Self::around_in_order`] in an order that depends on nothing but the positions and theirs, and is not that of distances.
    pub(crate) fn around<'a>(&self, place: usize, k: usize, room: &'a mut Scratch) -> &'a [Found] {
        room.choose(&self.tree, place, k)
    }
}

/// Points looked at for the scale of a cloud.
const LOOKED_AT: usize = 1000;

/// About the distance of neighbours on a surface, a power of two: from the middle of the distances between points
/// that follow each other, which are sorted along x. Strays do not change it, however far away they are.
fn spacing(positions: &[Vec3], first: &[u32], bounds: Bounds) -> f64 {
    let step = (first.len() / LOOKED_AT).max(1);
    let looked_at: Vec<Vec3> =
        first.iter().step_by(step).map(|&index| positions[index as usize]).collect();
    let middle = |axis: usize| {
        let mut along: Vec<f32> = looked_at.iter().map(|point| point[axis]).collect();
        let quarter = along.len() / 4;
        along.sort_unstable_by(f32::total_cmp);
        match along.len() {
            0 => 0.0,
            count => f64::from(along[count - 1 - quarter]) - f64::from(along[quarter]),
        }
    };
    let size = (0..3).map(middle).fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { bounds.extent() };
    // Coordinates of up to 2^120 units have differences whose squares may overflow, which only says that they are far.
    let least = (bounds.reach() / 2f64.powi(120)).max(f64::from(f32::MIN_POSITIVE));
    let spacing = (2.0 * size / (first.len() as f64).sqrt().max(1.0)).max(least);
    if spacing > 0.0 { 2f64.powi(spacing.log2().ceil() as i32) } else { 1.0 }
}

/// The first occurrences of the different finite positions, and of each further one its index and that of the first.
type Merged = (Vec<u32>, Vec<(u32, u32)>);

/// Finds positions that coincide.
fn merge_coincident(positions: &[Vec3], progress: Progress<'_>) -> Result<Merged, Cancelled> {
    let keys = flat_map(positions.len(), &part(progress, 0.0..0.2), |index| {
        // Adding zero makes the two zeros one.
        let key = (positions[index] + Vec3::ZERO).to_array().map(f32::to_bits);
        let index = u32::try_from(index).ok().filter(|_| positions[index].is_finite());
        index.map(|index| (key, index)).into_iter()
    })?;
    let count = keys.len();
    let mut first = Vec::with_capacity(count);
    let mut copies = Vec::new();
    let mut leading: Option<[u32; 3]> = None;
    let mut sorted = sort(keys, &part(progress, 0.2..0.9))?.into_iter().flatten();
    each(count, &part(progress, 0.9..1.0), |_| {
        let Some((key, index)) = sorted.next() else { return };
        match first.last() {
            Some(&leader) if leading == Some(key) => copies.push((index, leader)),
            _ => {
                leading = Some(key);
                first.push(index);
            }
        }
    })?;
    Ok((first, copies))
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
