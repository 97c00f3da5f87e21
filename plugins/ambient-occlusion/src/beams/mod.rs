//! Rays of neighbouring surfels in one direction, traced together.
//!
//! Sixteen surfels that lie side by side and face about the same way look in the same directions:
//! their rays are parallel and close, so that they meet the same nodes. What is tested against a
//! node's children, eight at a time, is the beam that holds all of them; only at the discs that the
//! beam meets are they told apart, sixteen at a time. A ray takes a fifth of the time that it takes
//! alone, and finds the same.

use fearless_simd::prelude::*;
use fearless_simd::{f32x8, f32x16, mask32x16};
use std::ops::Range;
use surfelshop_api::glam::Vec3;

mod build;
#[cfg(test)]
mod tests;

/// Rays that are traced together, and discs in a block.
pub(crate) const WIDTH: usize = 16;

/// Children of a node.
const CHILDREN: usize = 8;

/// Bit of a reference that tells leaves from nodes.
const LEAF: u32 = 1 << 31;

/// Hits on the back of a disc closer than this many of its radii are a neighbour of the surface
/// the ray started from, seen through the gap between two discs at different slopes. Farther away
/// both sides shade, so that open sheets do.
pub(crate) const NEAR: f32 = 3.0;

/// The least component of a direction, so that its inverse times any length is finite.
const LEAST: f32 = 1e-20;

/// A node's children: their boxes, lower corner and upper corner, and where they are.
struct Node {
    bounds: [[f32; CHILDREN]; 6],
    children: [u32; CHILDREN],
}

/// Sixteen discs of a leaf; what is missing has no radius.
struct Block {
    centre: [[f32; WIDTH]; 3],
    normal: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
}

/// Discs in the nodes of the surfels' octree.
pub(crate) struct Beams {
    nodes: Vec<Node>,
    /// Blocks of each leaf.
    leaves: Vec<Range<u32>>,
    blocks: Vec<Block>,
    /// Where to start, if there is anything.
    root: Option<u32>,
}

impl Beams {
    /// Which of the rays that are asked for meet something, as bits.
    #[inline(always)]
    pub(crate) fn hits<S: Simd>(
        &self,
        simd: S,
        rays: &Rays<S>,
        direction: Vec3,
        asked: u64,
        reach: f32,
        open: &mut Vec<u32>,
    ) -> u64 {
        let Some(root) = self.root else { return 0 };
        let beam = Beam::new(simd, rays, direction, reach);
        let mut left = asked;
        open.clear();
        open.push(root);
        while let Some(next) = open.pop() {
            if next & LEAF == 0 {
                beam.open(simd, &self.nodes[next as usize], open);
                continue;
            }
            let blocks = self.leaves[(next & !LEAF) as usize].clone();
            for block in &self.blocks[blocks.start as usize..blocks.end as usize] {
                left &= !beam.meets(simd, rays, block);
                if left == 0 {
                    return asked;
                }
            }
        }
        asked & !left
    }
}

/// Where sixteen rays start.
pub(crate) struct Rays<S: Simd> {
    origins: [f32x16<S>; 3],
    /// Offsets from the middle, and their squared lengths.
    offsets: [f32x16<S>; 3],
    squares: f32x16<S>,
    middle: Vec3,
    half: Vec3,
}

impl<S: Simd> Rays<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, origins: &[[f32; WIDTH]; 3]) -> Self {
        let [x, y, z] = origins;
        let (x, y, z) = (load(simd, x), load(simd, y), load(simd, z));
        let low = Vec3::new(x.reduce_min(), y.reduce_min(), z.reduce_min());
        let high = Vec3::new(x.reduce_max(), y.reduce_max(), z.reduce_max());
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        // Rounding moves the middle by a step, so the half size grows by two.
        let half = half + 4.0 * f32::EPSILON * (middle.abs() + half);
        let origins = [x, y, z];
        let (x, y, z) = (x - middle.x, y - middle.y, z - middle.z);
        let offsets = [x, y, z];
        Self { origins, offsets, squares: x * x + y * y + z * z, middle, half }
    }
}

/// What holds sixteen parallel rays.
struct Beam<S: Simd> {
    inverse: Vec3,
    /// For each axis and side what bounds it in a node, and what that is moved by.
    near: [(usize, f32); 3],
    far: [(usize, f32); 3],
    middle: Vec3,
    reach: f32,
    /// The largest distance of a ray from the one through the middle.
    radius: f32,
    /// The least and largest offset of an origin along the direction.
    along: (f32, f32),
    spread: [f32x16<S>; 3],
}

impl<S: Simd> Beam<S> {
    #[inline(always)]
    fn new(simd: S, rays: &Rays<S>, direction: Vec3, reach: f32) -> Self {
        let away = direction.map(|x| if x.abs() < LEAST { LEAST.copysign(x) } else { x });
        let inverse = away.recip();
        let [x, y, z] = rays.offsets;
        let along = x * direction.x + y * direction.y + z * direction.z;
        let across = rays.squares - along * along;
        let side = |axis: usize, is_near: bool| {
            let is_low = (away[axis] > 0.0) == is_near;
            let (index, half) =
                if is_low { (axis, -rays.half[axis]) } else { (axis + 3, rays.half[axis]) };
            (index, half - rays.middle[axis])
        };
        Self {
            inverse,
            near: [side(0, true), side(1, true), side(2, true)],
            far: [side(0, false), side(1, false), side(2, false)],
            middle: rays.middle,
            reach,
            radius: 1.0001 * across.reduce_max().max(0.0).sqrt(),
            along: (along.reduce_min(), along.reduce_max()),
            spread: [
                f32x16::splat(simd, direction.x),
                f32x16::splat(simd, direction.y),
                f32x16::splat(simd, direction.z),
            ],
        }
    }

    /// Where the beam crosses one side of the children's boxes.
    #[inline(always)]
    fn crossing(&self, simd: S, node: &Node, axis: usize, (side, shift): (usize, f32)) -> f32x8<S> {
        (f32x8::load_array_ref(simd, &node.bounds[side]) + shift) * self.inverse[axis]
    }

    /// Adds the children that the beam meets, nearest last.
    #[inline(always)]
    fn open(&self, simd: S, node: &Node, open: &mut Vec<u32>) {
        let [x, y, z] = self.near;
        let start = self.crossing(simd, node, 0, x);
        let start = start.max(self.crossing(simd, node, 1, y));
        let start = start.max(self.crossing(simd, node, 2, z));
        let [x, y, z] = self.far;
        let end = self.crossing(simd, node, 0, x);
        let end = end.min(self.crossing(simd, node, 1, y));
        let end = end.min(self.crossing(simd, node, 2, z));
        let start = start.max(f32x8::splat(simd, 0.0));
        let end = end.min(f32x8::splat(simd, self.reach));
        let mut met = start.simd_le(end).to_bitmask();
        if met & (met.wrapping_sub(1)) == 0 {
            if met != 0 {
                open.push(node.children[met.trailing_zeros() as usize]);
            }
            return;
        }
        let starts = start.as_slice();
        let mut sorted = [(0.0f32, 0u32); CHILDREN];
        let mut n = 0;
        while met != 0 {
            let slot = met.trailing_zeros() as usize % CHILDREN;
            met &= met - 1;
            let new = (starts[slot], node.children[slot]);
            let mut place = n;
            while place > 0 && sorted[place - 1].0 < new.0 {
                sorted[place] = sorted[place - 1];
                place -= 1;
            }
            sorted[place] = new;
            n += 1;
        }
        open.extend(sorted[..n].iter().map(|&(_, child)| child));
    }

    /// Which rays meet a disc of a block.
    #[inline(always)]
    fn meets(&self, simd: S, rays: &Rays<S>, block: &Block) -> u64 {
        let [dx, dy, dz] = self.spread;
        let zero = f32x16::splat(simd, 0.0);
        let radius = load(simd, &block.radius);
        let [x, y, z] = &block.centre;
        let x = load(simd, x) - self.middle.x;
        let y = load(simd, y) - self.middle.y;
        let z = load(simd, z) - self.middle.z;
        let along = x * dx + y * dy + z * dz;
        let square = x * x + y * y + z * z;
        let limit = radius + self.radius;
        // Squares of lengths round by their own size.
        let near = (square * (1.0 - 1e-6) - along * along).simd_le(limit * limit)
            & (along + radius).simd_ge(f32x16::splat(simd, self.along.0))
            & (along - radius).simd_le(f32x16::splat(simd, self.along.1 + self.reach))
            & radius.simd_gt(zero);
        if near.to_bitmask() == 0 {
            return 0;
        }
        let [nx, ny, nz] = &block.normal;
        let (nx, ny, nz) = (load(simd, nx), load(simd, ny), load(simd, nz));
        let slope = nx * dx + ny * dy + nz * dz;
        let is_front = slope.simd_lt(zero);
        let least = is_front.select(zero, radius * NEAR);
        let mut near = near.to_bitmask();
        let inverse = f32x16::splat(simd, 1.0) / slope;
        let (inverse, least) = (inverse.as_slice(), least.as_slice());
        let reach = f32x16::splat(simd, self.reach);
        let [ox, oy, oz] = rays.origins;
        let mut met = mask32x16::splat(simd, false);
        while near != 0 {
            let i = near.trailing_zeros() as usize % WIDTH;
            near &= near - 1;
            let x = f32x16::splat(simd, block.centre[0][i]) - ox;
            let y = f32x16::splat(simd, block.centre[1][i]) - oy;
            let z = f32x16::splat(simd, block.centre[2][i]) - oz;
            let distance =
                (x * block.normal[0][i] + y * block.normal[1][i] + z * block.normal[2][i])
                    * inverse[i];
            let (x, y, z) = (x - distance * dx, y - distance * dy, z - distance * dz);
            let radius = block.radius[i];
            met |= (x * x + y * y + z * z).simd_lt(f32x16::splat(simd, radius * radius))
                & distance.simd_gt(f32x16::splat(simd, least[i]))
                & distance.simd_lt(reach);
        }
        met.to_bitmask()
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, lanes: &[f32; WIDTH]) -> f32x16<S> {
    f32x16::load_array_ref(simd, lanes)
}
