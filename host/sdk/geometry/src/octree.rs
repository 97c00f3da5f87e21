//! An octree over positions, with the surfels of each node side by side.

use crate::bounds::Bounds;
use crate::progress::{Cancelled, Progress, each, flat_map, part, sort};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Bits a coordinate has in a key: three of them fill 63 bits.
const BITS: u32 = 21;

/// A cube's worth of surfels.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The surfels, as a range of [`Octree::order`].
    pub surfels: Range<u32>,
    /// The nodes it is divided into, which follow each other; empty for a leaf. They come after it.
    pub children: Range<u32>,
    /// Lower corner of the box of the surfels' positions.
    pub min: Vec3,
    /// Upper corner of the box of the surfels' positions.
    pub max: Vec3,
}

impl Node {
    fn of(surfels: Range<u32>) -> Self {
        Self { surfels, children: 0..0, min: Vec3::INFINITY, max: Vec3::NEG_INFINITY }
    }

    /// The square of the distance between a point and the box, 0 inside.
    #[must_use]
    pub fn distance_squared(&self, point: Vec3) -> f32 {
        point.distance_squared(point.clamp(self.min, self.max))
    }
}

/// An octree: node 0 is the root.
///
/// Nodes with one child are left out, so its size is bounded by the number of surfels however far
/// some of them stray. Surfels that coincide end in one leaf, however many there are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Octree {
    order: Vec<u32>,
    nodes: Vec<Node>,
}

impl Octree {
    /// Builds the tree: nodes of more than `leaf` surfels are divided. O(n log n) time, about 40
    /// bytes a position. Positions that are not finite are left out.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub fn build(
        positions: &[Vec3],
        leaf: usize,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let cube = Cube::around(positions.iter().copied());
        let keys = flat_map(positions.len(), &part(progress, 0.0..0.2), |index| {
            let key = cube.key(positions[index]);
            positions[index].is_finite().then_some((key, index as u32)).into_iter()
        })?;
        let mut keys = sort(keys, &part(progress, 0.2..0.6))?.concat();
        let nodes = divide(&mut keys, positions, leaf.max(1), &part(progress, 0.6..1.0))?;
        Ok(Self { order: keys.into_iter().map(|(_, index)| index).collect(), nodes })
    }

    /// Indices of the finite positions, along the curve that visits each node's surfels one after
    /// the other.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The nodes, parents before their children; empty where there are no surfels.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Calls `found` with every leaf whose box comes within `distance` of a box.
    pub fn leaves_near(
        &self,
        (min, max): (Vec3, Vec3),
        distance: f32,
        mut found: impl FnMut(&Node),
    ) {
        let mut open = vec![0u32];
        while let Some(next) = open.pop() {
            let Some(node) = self.nodes.get(next as usize) else { return };
            let gap = (node.min - max).max(min - node.max).max(Vec3::ZERO);
            if gap.length_squared() > distance * distance {
                continue;
            }
            if node.children.is_empty() {
                found(node);
            } else {
                open.extend(node.children.clone());
            }
        }
    }
}

/// A cube whose cells have keys: 2^21 of them along each edge.
struct Cube {
    min: DVec3,
    /// Cells per unit.
    scale: f64,
}

impl Cube {
    fn around(positions: impl Iterator<Item = Vec3>) -> Self {
        let bounds = Bounds::of(positions.map(|position| position.as_dvec3()));
        let bounds = bounds.unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
        let extent = bounds.extent();
        // One step less than the full range, so that the far side does not spill over.
        let scale = if extent > 0.0 { f64::from((1u32 << BITS) - 1) / extent } else { 0.0 };
        Self { min: bounds.min, scale }
    }

    /// The bits of the cell's three coordinates woven into each other, x highest.
    fn key(&self, position: Vec3) -> u64 {
        let cell = (position.as_dvec3() - self.min) * self.scale;
        let spread = |value: f64| {
            // Every third bit, by halving the distance bits travel: the masks keep what arrived.
            let mut bits = value as u64 & 0x1f_ffff;
            bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
            bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
            bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
            bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
            (bits | bits << 2) & 0x1249_2492_4924_9249
        };
        spread(cell.x) << 2 | spread(cell.y) << 1 | spread(cell.z)
    }
}

/// The nodes over surfels that are sorted by their keys; sorts on where keys are too coarse.
fn divide(
    keys: &mut [(u64, u32)],
    positions: &[Vec3],
    leaf: usize,
    progress: Progress<'_>,
) -> Result<Vec<Node>, Cancelled> {
    if keys.is_empty() {
        return Ok(Vec::new());
    }
    let mut nodes = vec![Node::of(0..keys.len() as u32)];
    let mut next = 0;
    // Every node that is divided has at least two children and no leaf is empty.
    each(2 * keys.len(), &part(progress, 0.0..0.7), |_| {
        let Some(node) = nodes.get(next) else { return };
        let start = node.surfels.start;
        let own = &mut keys[start as usize..node.surfels.end as usize];
        if own.len() > leaf {
            if own[0].0 == own[own.len() - 1].0 {
                // They share one of the 2^63 cells, because others stray far away. Coordinates in a
                // cube of their own tell them apart, unless they coincide.
                let cube = Cube::around(own.iter().map(|&(_, index)| positions[index as usize]));
                own.iter_mut().for_each(|(key, index)| *key = cube.key(positions[*index as usize]));
                own.sort_unstable();
            }
            let first = nodes.len() as u32;
            nodes
                .extend(parts(own).map(|p| Node::of(start + p.start as u32..start + p.end as u32)));
            nodes[next].children = first..nodes.len() as u32;
        }
        next += 1;
    })?;
    let count = nodes.len();
    each(count, &part(progress, 0.7..1.0), |i| {
        // Children come after their parents.
        let node = count - 1 - i;
        let children = nodes[node].children.start as usize..nodes[node].children.end as usize;
        let surfels = nodes[node].surfels.start as usize..nodes[node].surfels.end as usize;
        let (min, max) = if children.is_empty() {
            let own = keys[surfels].iter().map(|&(_, index)| positions[index as usize]);
            own.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)))
        } else {
            let own = nodes[children].iter().map(|child| (child.min, child.max));
            own.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), (c, d)| (a.min(c), b.max(d)))
        };
        (nodes[node].min, nodes[node].max) = (min, max);
    })?;
    Ok(nodes)
}

/// The parts of sorted keys that differ in the highest three bits that differ at all; none where
/// all keys are equal.
fn parts(keys: &[(u64, u32)]) -> impl Iterator<Item = Range<usize>> {
    let differing = keys[0].0 ^ keys[keys.len() - 1].0;
    let level = (63 - (differing | 1).leading_zeros()) / 3;
    let digit = move |key: u64| key >> (3 * level) & 7;
    let mut start = if differing == 0 { keys.len() } else { 0 };
    std::iter::from_fn(move || {
        let here = digit(keys.get(start)?.0);
        let end = start + keys[start..].partition_point(|&(key, _)| digit(key) == here);
        Some(std::mem::replace(&mut start, end)..end)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::random_sphere;

    fn built(positions: &[Vec3], leaf: usize) -> Octree {
        Octree::build(positions, leaf, &silent).unwrap()
    }

    /// Every node's children divide its surfels, and leaves are small where they can be.
    fn check(tree: &Octree, leaf: usize, positions: &[Vec3]) {
        let mut seen = vec![0; positions.len()];
        for node in tree.nodes() {
            for &index in &tree.order()[node.surfels.start as usize..node.surfels.end as usize] {
                assert_eq!(node.distance_squared(positions[index as usize]), 0.0);
            }
            if node.children.is_empty() {
                let surfels = &tree.order()[node.surfels.start as usize..node.surfels.end as usize];
                surfels.iter().for_each(|&index| seen[index as usize] += 1);
                let first = positions[surfels[0] as usize];
                let same = surfels.iter().all(|&i| positions[i as usize] == first);
                assert!(surfels.len() <= leaf || same);
                continue;
            }
            assert!(node.children.len() >= 2);
            let children = &tree.nodes()[node.children.start as usize..node.children.end as usize];
            assert_eq!(children[0].surfels.start, node.surfels.start);
            assert_eq!(children[children.len() - 1].surfels.end, node.surfels.end);
            assert!(children.windows(2).all(|pair| pair[0].surfels.end == pair[1].surfels.start));
        }
        let finite = positions.iter().map(|p| i32::from(p.is_finite()));
        assert!(seen.iter().copied().eq(finite));
    }

    #[test]
    fn leaves_hold_every_surfel_once() {
        let positions = random_sphere(5000, DVec3::new(1e3, -2.0, 0.5), 3.0, 4);
        for leaf in [1, 7, 64, 10_000] {
            check(&built(&positions, leaf), leaf, &positions);
        }
    }

    #[test]
    fn nodes_are_compact() {
        let positions = random_sphere(4096, DVec3::ZERO, 1.0, 4);
        let tree = built(&positions, 16);
        for node in tree.nodes().iter().filter(|node| node.surfels.len() <= 64) {
            let range = node.surfels.start as usize..node.surfels.end as usize;
            let members: Vec<Vec3> =
                tree.order()[range].iter().map(|&i| positions[i as usize]).collect();
            // 64 of 4096 random points fill about 0.2 square units of a sphere of area 12.6.
            assert!(Bounds::of_positions(&members).unwrap().extent() <= 1.0);
        }
    }

    #[test]
    fn duplicates_end_in_one_leaf() {
        let mut positions = vec![Vec3::splat(0.25); 1000];
        positions.push(Vec3::ONE);
        positions.push(Vec3::NAN);
        let tree = built(&positions, 4);
        assert_eq!(tree.nodes().len(), 3);
        check(&tree, 4, &positions);
        check(&built(&[Vec3::ONE; 100], 4), 4, &[Vec3::ONE; 100]);
    }

    #[test]
    fn no_surfels_have_no_nodes() {
        assert_eq!(built(&[], 8), Octree::default());
        assert_eq!(built(&[Vec3::NAN], 8), Octree::default());
        assert_eq!(built(&[Vec3::X], 8).nodes().len(), 1);
    }

    #[test]
    fn strays_do_not_spoil_the_tree() {
        let mut positions = random_sphere(2000, DVec3::ZERO, 1e-6, 3);
        positions.extend([Vec3::splat(1e9), Vec3::splat(-3e18), Vec3::splat(1e30)]);
        check(&built(&positions, 8), 8, &positions);
    }

    #[test]
    fn leaves_near_a_box_hold_all_that_is_near() {
        let positions = random_sphere(3000, DVec3::ZERO, 1.0, 6);
        let tree = built(&positions, 8);
        let (min, max) = (Vec3::new(0.3, 0.2, 0.7), Vec3::new(0.5, 0.5, 0.9));
        let mut near = Vec::new();
        tree.leaves_near((min, max), 0.2, |leaf| {
            let range = leaf.surfels.start as usize..leaf.surfels.end as usize;
            near.extend_from_slice(&tree.order()[range]);
        });
        let gap = |p: Vec3| p.distance(p.clamp(min, max));
        for (i, &position) in positions.iter().enumerate() {
            assert!(gap(position) > 0.2 || near.contains(&(i as u32)));
        }
        assert!(near.len() < 600, "{}", near.len());
    }

    #[test]
    fn tree_is_the_same_at_every_scale() {
        let positions = random_sphere(500, DVec3::ZERO, 1.0, 2);
        let tree = built(&positions, 8);
        for scale in [2f32.powi(-60), 2f32.powi(90)] {
            let scaled: Vec<Vec3> = positions.iter().map(|&p| p * scale).collect();
            assert_eq!(built(&scaled, 8).order(), tree.order());
        }
    }
}
