//! An octree over positions, with the surfels of each node side by side.

use crate::bounds::Bounds;
use crate::progress::{Cancelled, Progress, each, flat_map, part, sort};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Bits a coordinate has in a key: three of them fill 63 bits.
const BITS: u32 = 21;

/// A cube's worth of surfels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// The surfels, as a range of [`Octree::order`].
    pub surfels: Range<u32>,
    /// The nodes it is divided into, which follow each other; empty for a leaf. They come after it.
    pub children: Range<u32>,
}

/// An octree: node 0 is the root.
///
/// Coordinates count as integers of 21 bits in the bounding cube, so that neither duplicates nor
/// points arbitrarily close together can be divided for ever: a leaf at the bottom keeps a list
/// as long as it needs. Nodes with one child are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Octree {
    order: Vec<u32>,
    nodes: Vec<Node>,
}

impl Octree {
    /// Builds the tree: nodes of more than `leaf` surfels are divided. O(n log n) time, about 20
    /// bytes a position. Positions that are not finite are left out.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub fn build(
        positions: &[Vec3],
        leaf: usize,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let Some(bounds) = Bounds::of_positions(positions) else {
            return Ok(Self::default());
        };
        let extent = bounds.extent();
        // One step less than the full range, so that the far side does not spill over.
        let scale = if extent > 0.0 { f64::from((1u32 << BITS) - 1) / extent } else { 0.0 };
        let keys = flat_map(positions.len(), &part(progress, 0.0..0.2), |index| {
            let finite = positions[index].is_finite();
            let cell = (positions[index].as_dvec3() - bounds.min) * scale;
            finite.then_some((key(cell), index as u32)).into_iter()
        })?;
        let count = keys.len();
        let mut sorted = sort(keys, &part(progress, 0.2..0.6))?.into_iter().flatten();
        let mut keys = Vec::with_capacity(count);
        let mut order = Vec::with_capacity(count);
        each(count, &part(progress, 0.6..0.7), |_| {
            if let Some((key, index)) = sorted.next() {
                keys.push(key);
                order.push(index);
            }
        })?;
        let nodes = divide(&keys, leaf.max(1), &part(progress, 0.7..1.0))?;
        Ok(Self { order, nodes })
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
}

/// The bits of three coordinates woven into each other, x highest.
fn key(cell: DVec3) -> u64 {
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

/// The nodes over sorted keys.
fn divide(keys: &[u64], leaf: usize, progress: Progress<'_>) -> Result<Vec<Node>, Cancelled> {
    let mut nodes = vec![Node { surfels: 0..keys.len() as u32, children: 0..0 }];
    let mut next = 0;
    // Every node that is divided has at least two children and no leaf is empty.
    each(2 * keys.len(), progress, |_| {
        let Some(node) = nodes.get(next).cloned() else { return };
        let range = node.surfels.start as usize..node.surfels.end as usize;
        if range.len() > leaf {
            let first = nodes.len() as u32;
            nodes.extend(parts(&keys[range.clone()]).map(|part| {
                let start = node.surfels.start;
                Node { surfels: start + part.start as u32..start + part.end as u32, children: 0..0 }
            }));
            nodes[next].children = first..nodes.len() as u32;
        }
        next += 1;
    })?;
    Ok(nodes)
}

/// The parts of sorted keys that differ in the highest three bits that differ at all; none where
/// all keys are equal.
fn parts(keys: &[u64]) -> impl Iterator<Item = Range<usize>> {
    let differing = keys[0] ^ keys[keys.len() - 1];
    let level = (63 - (differing | 1).leading_zeros()) / 3;
    let digit = move |key: u64| key >> (3 * level) & 7;
    let mut start = if differing == 0 { keys.len() } else { 0 };
    std::iter::from_fn(move || {
        let here = digit(*keys.get(start)?);
        let end = start + keys[start..].partition_point(|&key| digit(key) == here);
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
            if node.children.is_empty() {
                let surfels = &tree.order()[node.surfels.start as usize..node.surfels.end as usize];
                surfels.iter().for_each(|&index| seen[index as usize] += 1);
                let first = positions[surfels[0] as usize];
                let same = surfels.iter().all(|&i| positions[i as usize].distance(first) < 1e-5);
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
    fn tree_is_the_same_at_every_scale() {
        let positions = random_sphere(500, DVec3::ZERO, 1.0, 2);
        let tree = built(&positions, 8);
        for scale in [2f32.powi(-60), 2f32.powi(90)] {
            let scaled: Vec<Vec3> = positions.iter().map(|&p| p * scale).collect();
            assert_eq!(built(&scaled, 8), tree);
        }
    }
}
