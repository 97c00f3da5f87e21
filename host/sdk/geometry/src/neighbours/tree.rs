//! A k-d tree in the order of its points: no pointers, only ranges that halve.

use crate::progress::{Cancelled, Progress, part, report};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Points of a leaf, at most. Fewer make more boxes to test, more make more points to test.
pub(super) const LEAF: usize = 16;

/// Nodes from which on each is split to the end by one thread.
const PARTS: usize = 256;

/// A point before it is in its leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    /// In units of the search.
    pub(super) at: [f32; 3],
    pub(super) index: u32,
}

/// A box in units of the search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cuboid {
    min: [f32; 3],
    max: [f32; 3],
}

impl Cuboid {
    const NOTHING: Self = Self { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    fn of(points: impl Iterator<Item = [f32; 3]>) -> Self {
        points.fold(Self::NOTHING, |all, point| all.with(&Self { min: point, max: point }))
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// Square of the distance to another box, 0 where they overlap: no more than that of any point of one to the other,
    /// rounding included.
    pub(super) fn squared_between(&self, other: &Self) -> f32 {
        let off = |axis: usize| {
            (self.min[axis] - other.max[axis]).max(other.min[axis] - self.max[axis]).max(0.0)
        };
        let offset = [off(0), off(1), off(2)];
        offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
    }

    fn longest_axis(&self) -> usize {
        let size = |axis: usize| self.max[axis] - self.min[axis];
        (1..3).fold(0, |longest, axis| if size(axis) > size(longest) { axis } else { longest })
    }
}

/// The points, leaf by leaf, and the boxes of all nodes.
///
/// Node 1 is the root and `2 * node` and `2 * node + 1` are the halves of a node, so that the points of a
/// node follow from its number alone.
#[derive(Debug)]
pub(crate) struct Tree {
    /// Coordinates of the points in units of the search, apart, so that several are compared at a time.
    axes: [Vec<f32>; 3],
    /// For each point the index of its first occurrence.
    index: Vec<u32>,
    /// By the number of the node; the first is of no node.
    boxes: Vec<Cuboid>,
    /// Halvings from the root to the leaves.
    levels: u32,
}

impl Tree {
    /// Sorts points into leaves: O(n log n) time. The result depends on nothing but the points.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub(super) fn build(mut sites: Vec<Site>, progress: Progress<'_>) -> Result<Self, Cancelled> {
        let mut levels = 0;
        while sites.len().div_ceil(1 << levels) > LEAF {
            levels += 1;
        }
        let root = Part { count: sites.len(), levels, level: 0, number: 0, sites: &mut sites };
        root.split_all(&part(progress, 0.0..0.8))?;
        report(progress, 0.8)?;
        let axes = [0, 1, 2].map(|axis| sites.par_iter().map(|site| site.at[axis]).collect());
        let index = sites.par_iter().map(|site| site.index).collect();
        drop(sites);
        report(progress, 0.9)?;
        let mut tree = Self { axes, index, boxes: Vec::new(), levels };
        tree.boxes = tree.measured();
        report(progress, 1.0)?;
        Ok(tree)
    }

    /// The tree of points in units of some search, and for each its place.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub(crate) fn of_points(
        points: impl Iterator<Item = Vec3>,
        progress: Progress<'_>,
    ) -> Result<(Self, Vec<u32>), Cancelled> {
        let site = |(at, index): (Vec3, u32)| Site { at: at.to_array(), index };
        let tree = Self::build(points.zip(0..).map(site).collect(), progress)?;
        let mut places = vec![0; tree.len()];
        for (place, &index) in tree.index.iter().enumerate() {
            places[index as usize] = place as u32;
        }
        Ok((tree, places))
    }

    /// The boxes of all nodes, the leaves' from their points.
    fn measured(&self) -> Vec<Cuboid> {
        let n_leaves = self.n_leaves();
        let mut boxes = vec![Cuboid::NOTHING; 2 * n_leaves];
        let (nodes, leaves) = boxes.split_at_mut(n_leaves);
        leaves.par_iter_mut().enumerate().for_each(|(leaf, cuboid)| {
            *cuboid = Cuboid::of(self.leaf(leaf).map(|place| self.at(place)));
        });
        for node in (1..n_leaves).rev() {
            let half = |half: usize| {
                if half < n_leaves { nodes[half] } else { leaves[half - n_leaves] }
            };
            nodes[node] = half(2 * node).with(&half(2 * node + 1));
        }
        boxes
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.index.len()
    }

    /// Number of leaves, of which the first has the first points; a power of two.
    pub(crate) fn n_leaves(&self) -> usize {
        1 << self.levels
    }

    /// The points of a leaf.
    pub(crate) fn leaf(&self, leaf: usize) -> Range<usize> {
        start(self.len(), self.levels, leaf)..start(self.len(), self.levels, leaf + 1)
    }

    /// The leaf of a point.
    pub(crate) fn leaf_of(&self, place: usize) -> usize {
        // The inverse of `start`: the last leaf that starts at or before this place.
        let last = ((place as u64 + 1) << self.levels) - 1;
        (last / self.len().max(1) as u64) as usize
    }

    pub(crate) fn at(&self, place: usize) -> [f32; 3] {
        [self.axes[0][place], self.axes[1][place], self.axes[2][place]]
    }

    pub(super) fn point(&self, place: usize) -> DVec3 {
        Vec3::from_array(self.at(place)).as_dvec3()
    }

    /// The index of the first occurrence of a point.
    pub(crate) fn index(&self, place: usize) -> usize {
        self.index[place] as usize
    }

    /// Squares of the distances from a place to the points of a leaf, units of the search.
    pub(super) fn squared(&self, at: [f32; 3], leaf: &Range<usize>, found: &mut [f32; LEAF]) {
        let [x, y, z] = self.axes(leaf);
        for (found, ((x, y), z)) in found.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let offset = [x - at[0], y - at[1], z - at[2]];
            *found = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        }
    }

    /// Squares of the distances from a box to the points of a leaf, units of the search.
    pub(super) fn squared_to_box(&self, leaf: &Range<usize>, from: &Cuboid) -> [f32; LEAF] {
        let [x, y, z] = self.axes(leaf);
        let Cuboid { min, max } = from;
        let mut found = [f32::NAN; LEAF];
        for (found, ((x, y), z)) in found.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let off = |axis: usize, at: f32| (min[axis] - at).max(at - max[axis]).max(0.0);
            let offset = [off(0, *x), off(1, *y), off(2, *z)];
            *found = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        }
        found
    }

    /// The coordinates of the points of a leaf, axis by axis, units of the search.
    pub(super) fn axes(&self, leaf: &Range<usize>) -> [&[f32]; 3] {
        let [x, y, z] = &self.axes;
        [&x[leaf.clone()], &y[leaf.clone()], &z[leaf.clone()]]
    }

    /// The box of a node.
    pub(super) fn cuboid(&self, node: usize) -> &Cuboid {
        &self.boxes[node]
    }

    /// Square of the distance from a place to the box of a node, 0 inside: no more than `squared` says of any
    /// point in it, rounding included.
    pub(crate) fn squared_to(&self, node: usize, at: [f32; 3]) -> f32 {
        let Cuboid { min, max } = &self.boxes[node];
        let off = |axis: usize| (min[axis] - at[axis]).max(at[axis] - max[axis]).max(0.0);
        let offset = [off(0), off(1), off(2)];
        offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]
    }

    /// The largest of the values of the points of each node, by the number of the node.
    pub(crate) fn largest(&self, value: impl Fn(usize) -> f32 + Sync) -> Vec<f32> {
        let n_leaves = self.n_leaves();
        let mut largest = vec![0.0f32; 2 * n_leaves];
        largest[n_leaves..].par_iter_mut().enumerate().for_each(|(leaf, largest)| {
            *largest = self.leaf(leaf).map(&value).fold(0.0, f32::max);
        });
        for node in (1..n_leaves).rev() {
            largest[node] = largest[2 * node].max(largest[2 * node + 1]);
        }
        largest
    }
}

/// The first point of a node among those of its level: its share of the points, rounded down, so that the
/// halves of a node differ by one point at most.
fn start(count: usize, level: u32, number: usize) -> usize {
    ((count as u128 * number as u128) >> level) as usize
}

/// The points of a node that is to be split.
struct Part<'a> {
    /// Points of the tree.
    count: usize,
    levels: u32,
    level: u32,
    /// The node's number among those of its level.
    number: usize,
    sites: &'a mut [Site],
}

impl Part<'_> {
    /// Splits a node at the middle of the longest side of its box.
    fn halves(self) -> [Self; 2] {
        let Self { count, levels, level, number, sites } = self;
        let (level, number) = (level + 1, 2 * number);
        let middle = start(count, level, number + 1) - start(count, level, number);
        let axis = Cuboid::of(sites.iter().map(|site| site.at)).longest_axis();
        if middle < sites.len() {
            sites.select_nth_unstable_by(middle, |a, b| {
                a.at[axis].total_cmp(&b.at[axis]).then(a.index.cmp(&b.index))
            });
        }
        let (low, high) = sites.split_at_mut(middle);
        let half = |number, sites| Self { count, levels, level, number, sites };
        [half(number, low), half(number + 1, high)]
    }

    /// Splits a node down to its leaves.
    fn split(self) {
        if self.level < self.levels {
            self.halves().into_iter().for_each(Self::split);
        }
    }

    /// Splits the root down to its leaves, several nodes at a time.
    fn split_all(self, progress: Progress<'_>) -> Result<(), Cancelled> {
        let levels = self.levels;
        let mut parts = vec![self];
        let mut level = 0;
        while level < levels && parts.len() < PARTS {
            report(progress, f64::from(level) / f64::from(levels))?;
            parts = parts.into_par_iter().flat_map_iter(Self::halves).collect();
            level += 1;
        }
        let done = f64::from(level) / f64::from(levels.max(1));
        let at_a_time = 4 * rayon::current_num_threads();
        let n_parts = parts.len();
        while !parts.is_empty() {
            let share = 1.0 - parts.len() as f64 / n_parts as f64;
            report(progress, done + (1.0 - done) * share)?;
            let rest = parts.split_off(at_a_time.min(parts.len()));
            parts.into_par_iter().for_each(Self::split);
            parts = rest;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::Random;

    fn tree(count: usize) -> Tree {
        let mut random = Random::new(4);
        let site =
            |index: usize| Site { at: random.in_ball().as_vec3().to_array(), index: index as u32 };
        Tree::build((0..count).map(site).collect(), &silent).unwrap()
    }

    #[test]
    fn every_point_is_in_the_leaf_that_it_says() {
        for count in [0, 1, 15, 16, 17, 33, 1000, 4097] {
            let tree = tree(count);
            let mut places = 0;
            for leaf in 0..tree.n_leaves() {
                assert!(tree.leaf(leaf).len() <= LEAF);
                for place in tree.leaf(leaf) {
                    assert_eq!(tree.leaf_of(place), leaf);
                    assert_eq!(tree.squared_to(tree.n_leaves() + leaf, tree.at(place)), 0.0);
                    places += 1;
                }
            }
            assert_eq!(places, count);
        }
    }

    #[test]
    fn boxes_are_no_farther_than_what_is_in_them() {
        let tree = tree(3000);
        let at = [0.3, -0.2, 0.9];
        for leaf in 0..tree.n_leaves() {
            let range = tree.leaf(leaf);
            let mut squared = [0.0; LEAF];
            tree.squared(at, &range, &mut squared);
            let nearest = squared[..range.len()].iter().copied().fold(f32::INFINITY, f32::min);
            let mut node = tree.n_leaves() + leaf;
            while node > 0 {
                assert!(tree.squared_to(node, at) <= nearest);
                node /= 2;
            }
        }
    }
}
