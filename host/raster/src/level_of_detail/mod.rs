//! Level of detail: a tree of blocks with four parts each, over surfels along a space-filling curve. Blocks have
//! bounding spheres and cones of normals, as in `QSplat`, and coarser blocks have merged surfels.
//!
//! Blocks are runs of surfels in drawing order, which follows a curve through space; four blocks make a
//! larger one, up to the whole cloud. A larger block has surfels of its own: each stands for up to four
//! neighbours of the level below. They keep the mean position, normal, albedo and accessibility, weighted
//! by area, and the covariance of what these spread over. Surfels of different materials, facing
//! different ways or lying apart are not merged, nor are ellipses, whose axes have no mean.
//!
//! Source: for the hierarchy Rusinkiewicz & Levoy 2000, "`QSplat`"; what merged surfels keep follows from
//! how they blend: a pixel's normal and albedo are means weighted by Gaussians.

pub(crate) mod block;
pub(crate) mod merge;
pub(crate) mod repaint;

use crate::columns::Columns;
use crate::columns::geometry::{Geometry, OrderedGeometry, Shape};
use crate::lanes::WIDTH;
use block::{Block, Bounds, half_angle};
use merge::{BRANCH, COARSEST, Sample, dot, gather, merged, typical_radius, unit_vector};
use rayon::prelude::*;
use std::ops::Range;

/// Surfels of the smallest blocks.
const BLOCK: usize = 16 * WIDTH;
/// Merged surfels replace theirs where there are fewer than this share of them.
const WORTHWHILE: f64 = 0.7;

/// Levels of blocks that are made together, over `BRANCH` to this power of the smallest ones: what they are merged of
/// takes more memory than the cloud itself, and lives no longer.
const TOGETHER: u32 = 4;
/// Surfels that are put in order together: four smallest blocks, those under one block of the finest merged ones.
pub(crate) const PART: usize = BLOCK * BRANCH;
/// Parts of so many blocks that a thread makes before merged surfels are put to those of the cloud.
const AT_A_TIME: usize = 2;

/// What the blocks of a cloud are.
pub(crate) struct Tree {
    pub(crate) blocks: Vec<Block>,
    pub(crate) roots: Range<usize>,
    pub(crate) above: Above,
}

/// A level of blocks: its first one, and its nodes.
type Level = (usize, Vec<Node>);

/// The levels of blocks above the parts, with what they are merged of.
#[derive(Default)]
pub(crate) struct Above {
    /// Smallest blocks of a part, and its levels of blocks.
    per_part: usize,
    n_levels: u32,
    /// First block of each part.
    parts: Vec<usize>,
    /// From the blocks that are above a part each up to the one above all: the first block of the level, and its nodes.
    levels: Vec<Level>,
    /// Whether they were too large to be kept.
    is_left_out: bool,
}

/// A block being made.
struct Node {
    block: Block,
    bounds: Bounds,
    /// What it is drawn as, or would be.
    samples: Vec<Sample>,
}

/// A part of the tree: blocks that count theirs from 0, and the one above all of them.
struct Part {
    blocks: Vec<Block>,
    /// Merged surfels, with the number of the block that they are of.
    merged: Vec<(usize, Vec<Sample>)>,
    top: Node,
}

/// Makes blocks, and where surfels are to be merged appends merged ones to the columns: they take memory and time.
/// Where it `keeps` what these are merged of, levels above are left as far as they are small beside the cloud.
/// `report` hears how far it is, in [0, 1].
pub(crate) fn tree(
    columns: &mut Columns,
    geometry: &Geometry<'_>,
    (merges, keeps): (bool, bool),
    linear_of_srgb: &[f32; 256],
    report: &(dyn Fn(f32) + Sync),
) -> Tree {
    let n = columns.len();
    let n_leaves = n.div_ceil(BLOCK);
    if n_leaves <= 1 {
        let leaf =
            |part: &OrderedGeometry| leaf((columns, part, 0), 0..n, merges, linear_of_srgb).block;
        let leaf = (n > 0).then(|| columns.with_part(0, geometry, leaf));
        let blocks: Vec<Block> = leaf.into_iter().collect();
        return Tree { roots: 0..blocks.len(), blocks, above: Above::default() };
    }
    let n_levels = (1..=TOGETHER).find(|&k| BRANCH.pow(k) >= n_leaves).unwrap_or(TOGETHER);
    let per_part = BRANCH.pow(n_levels);
    let firsts: Vec<usize> = (0..n_leaves).step_by(per_part).collect();
    let above = Above { per_part, n_levels, ..Above::default() };
    let mut tree = Tree { blocks: Vec::new(), roots: 0..0, above };
    let mut level: Vec<Node> = Vec::with_capacity(firsts.len());
    for firsts in firsts.chunks(AT_A_TIME * rayon::current_num_threads()) {
        let made = |&first: &usize| {
            let leaves = first..(first + per_part).min(n_leaves);
            part((columns, geometry), leaves, n_levels, merges, linear_of_srgb)
        };
        let parts: Vec<Part> = firsts.par_iter().map(made).collect();
        for mut part in parts {
            let base = tree.blocks.len();
            tree.above.parts.push(base);
            for (number, samples) in part.merged {
                part.blocks[number].first = columns.push(&samples);
            }
            let moved = |block: &mut Block| {
                if block.parts[1] > block.parts[0] {
                    block.parts = block.parts.map(|at| at + base as u32);
                }
            };
            part.blocks.iter_mut().for_each(moved);
            moved(&mut part.top.block);
            tree.blocks.append(&mut part.blocks);
            level.push(part.top);
        }
        // What is above is a small part of all.
        report(0.95 * level.len() as f32 * per_part as f32 / n_leaves as f32);
    }
    loop {
        for node in level.iter_mut().filter(|node| node.block.count > 0) {
            node.block.first = columns.push(&node.samples);
        }
        let first = tree.blocks.len();
        tree.blocks.extend(level.iter().map(|node| node.block));
        tree.roots = first..tree.blocks.len();
        let join = |(i, nodes): (usize, &[Node])| joined(nodes, places(first, i, level.len()));
        let larger = match level.len() {
            1 => Vec::new(),
            _ => level.par_chunks(BRANCH).enumerate().map(join).collect(),
        };
        let made = std::mem::replace(&mut level, larger);
        if keeps {
            tree.above.keep((first, made), n);
        }
        if level.is_empty() {
            return tree;
        }
    }
}

/// Where the parts of block `i` of a level are that begins at `first` and has `n` parts.
fn places(first: usize, i: usize, n: usize) -> [u32; 2] {
    [BRANCH * i, (BRANCH * (i + 1)).min(n)].map(|at| (first + at) as u32)
}

/// So many levels of blocks over some of the smallest ones.
fn part(
    (columns, geometry): (&Columns, &Geometry<'_>),
    leaves: Range<usize>,
    n_levels: u32,
    merges: bool,
    linear_of_srgb: &[f32; 256],
) -> Part {
    let (mut blocks, mut level) =
        (Vec::with_capacity(leaves.len() * BRANCH / (BRANCH - 1)), Vec::new());
    let all: Vec<usize> = leaves.collect();
    // The samples of the smallest blocks live until their four are joined.
    for (i, numbers) in all.chunks(BRANCH).enumerate() {
        let first = numbers[0] * BLOCK;
        let four = |part: &OrderedGeometry| {
            let leaf = |&number: &usize| {
                let start = number * BLOCK;
                let places = start..(start + BLOCK).min(columns.len());
                leaf((columns, part, first), places, merges, linear_of_srgb)
            };
            numbers.iter().map(leaf).collect::<Vec<Node>>()
        };
        let four = columns.with_part(first / PART, geometry, four);
        blocks.extend(four.iter().map(|leaf| leaf.block));
        level.push(joined(&four, places(0, i, all.len())));
    }
    let mut merged = Vec::new();
    for _ in 1..n_levels {
        let first = blocks.len();
        blocks.extend(level.iter().map(|node| node.block));
        let join = |(i, nodes): (usize, &[Node])| joined(nodes, places(first, i, level.len()));
        let above: Vec<Node> = level.chunks(BRANCH).enumerate().map(join).collect();
        let drawn = level.into_iter().enumerate().filter(|(_, node)| node.block.count > 0);
        merged.extend(drawn.map(|(i, node)| (first + i, node.samples)));
        level = above;
    }
    // Each level has a quarter of the one below, so one is left.
    let top = level.pop().unwrap_or_else(|| joined(&[], [0, 0]));
    Part { blocks, merged, top }
}

/// A smallest block: of columns, and the part that it is in, which has its first surfel at this place.
fn leaf(
    (columns, part, first): (&Columns, &OrderedGeometry, usize),
    places: Range<usize>,
    merges: bool,
    linear_of_srgb: &[f32; 256],
) -> Node {
    let mut bounds = Bounds::none();
    let (mut reach, mut has_round) = (0.0f64, false);
    let length2 = |v: [f32; 3]| v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    let mut samples = Vec::with_capacity(if merges { places.len() } else { 0 });
    let mut normals = Vec::with_capacity(places.len());
    for place in places.clone() {
        let at = place - first;
        let position = part.positions.one(at);
        let normal = part.normals.one(at);
        bounds = bounds.and(position, position);
        normals.push(normal);
        let (radius, is_round) = match &part.shape {
            Shape::Radius(radii) => (f64::from(radii.one(at).abs()), radii.one(at) < 0.0),
            // An ellipse's longer half axis is at most the root of the sum of both squares.
            Shape::Tangents(u, v) => ((length2(u.one(at)) + length2(v.one(at))).sqrt(), false),
        };
        has_round |= is_round;
        reach = reach.max(radius);
        if merges && radius > 0.0 {
            samples.push(Sample {
                position,
                normal,
                radius: radius as f32,
                is_round,
                albedo: columns.albedo_of(place, linear_of_srgb),
                ao: columns.ao_of(place),
                material: columns.material_of(place as u32),
                stands_for: place as u32,
                apart: 0.0,
            });
        }
    }
    // Round splats face every eye.
    let (axis, cosine) = if has_round { ([0.0, 0.0, 1.0], -1.0) } else { cone(&normals) };
    let block = Block {
        first: places.start / WIDTH,
        count: places.len().div_ceil(WIDTH),
        parts: [0, 0],
        middle: bounds.middle(),
        spread: bounds.spread(),
        reach: (reach * (1.0 + 1e-6)) as f32,
        grain: 0.0,
        apart: 0.0,
        axis,
        cosine,
    };
    Node { block, bounds, samples }
}

/// Blocks as parts of a larger one.
fn joined(nodes: &[Node], parts: [u32; 2]) -> Node {
    let mut all: Vec<Sample> = nodes.iter().flat_map(|node| node.samples.iter().copied()).collect();
    gather(&mut all);
    let samples = merged(&all, COARSEST * typical_radius(&all));
    let worthwhile = !all.is_empty() && (samples.len() as f64) < WORTHWHILE * all.len() as f64;
    let bounds = nodes
        .iter()
        .fold(Bounds::none(), |bounds, node| bounds.and(node.bounds.low, node.bounds.high));
    let most = |of: fn(&Block) -> f32| nodes.iter().map(|node| of(&node.block)).fold(0.0, f32::max);
    let (axis, cosine) = cones(nodes);
    let samples = if worthwhile { samples } else { all };
    let grown = samples.iter().map(|sample| sample.radius).fold(0.0, f32::max);
    let several = samples.iter().filter(|sample| sample.apart > 0.0);
    let grain = several.clone().map(|sample| sample.radius).fold(0.0, f32::max);
    let apart = several.map(|sample| sample.apart).fold(0.0, f32::max);
    let block = Block {
        first: 0,
        count: if worthwhile { samples.len().div_ceil(WIDTH) } else { 0 },
        parts,
        middle: bounds.middle(),
        spread: bounds.spread(),
        reach: most(|block| block.reach).max(grown * (1.0 + 1e-6)),
        // Never finer than its parts, so that what is chosen grows coarser with the distance.
        grain: most(|block| block.grain).max(grain),
        apart: most(|block| block.apart).max(apart),
        axis,
        cosine,
    };
    Node { block, bounds, samples }
}

/// What vectors point to, and the least cosine of the angle to it.
fn cone(normals: &[[f32; 3]]) -> ([f32; 3], f32) {
    let mut sum = [0.0; 3];
    for normal in normals {
        for axis in 0..3 {
            sum[axis] += normal[axis] / normals.len() as f32;
        }
    }
    let Some(axis) = unit_vector(sum) else { return ([0.0, 0.0, 1.0], -1.0) };
    let least = normals.iter().map(|normal| dot(*normal, axis)).fold(1.0, least_number);
    // What rounding does to a cosine is a few units in the last place.
    (axis, least - 1e-5)
}

/// The smaller of both; -1 where one is NaN.
fn least_number(a: f32, b: f32) -> f32 {
    if a <= b {
        a
    } else if b < a {
        b
    } else {
        -1.0
    }
}

/// The cone around those of blocks.
fn cones(nodes: &[Node]) -> ([f32; 3], f32) {
    let axes: Vec<[f32; 3]> = nodes.iter().map(|node| node.block.axis).collect();
    let (axis, _) = cone(&axes);
    let angle = nodes
        .iter()
        .map(|node| dot(node.block.axis, axis).clamp(-1.0, 1.0).acos() + half_angle(&node.block))
        .fold(0.0, f32::max);
    let known = nodes.iter().all(|node| node.block.cosine > -1.0);
    let cosine = if known && angle < std::f32::consts::PI { angle.cos() - 1e-5 } else { -1.0 };
    (axis, cosine)
}
