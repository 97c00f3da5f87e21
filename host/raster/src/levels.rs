//! Blocks of surfels and, where several surfels are smaller than a pixel, one that stands for them.
//!
//! Blocks are runs of surfels in drawing order, which follows a curve through space; four blocks make a
//! larger one, up to the whole cloud. A larger block has surfels of its own: each stands for up to four
//! neighbours of the level below. They keep the mean position, normal, albedo and accessibility, weighted
//! by area, and the covariance of what these spread over. Surfels of different materials, facing
//! different ways or lying apart are not merged, nor are ellipses, whose axes have no mean.
//!
//! Source: for the hierarchy Rusinkiewicz & Levoy 2000, "`QSplat`"; what merged surfels keep follows from
//! how they blend: a pixel's normal and albedo are means weighted by Gaussians.

use crate::columns::{Columns, Shape};
use crate::lanes::WIDTH;
use half::f16;
use rayon::prelude::*;
use std::ops::Range;

/// Merged surfels are at most so many times as coarse as those of their block usually are: a few large
/// ones would else keep all from being drawn.
const COARSEST: f32 = 2.0;
/// Surfels of the smallest blocks.
const BLOCK: usize = 16 * WIDTH;
/// Blocks in a larger one, and surfels that one stands for.
const BRANCH: usize = 4;
/// Merged surfels replace theirs where there are fewer than this share of them.
const WORTHWHILE: f64 = 0.7;
/// Cosine of the largest angle between a merged surfel's normal and those that it stands for.
const MIN_COSINE: f32 = 0.5;
/// Merged surfels stand for those within so many of their radii.
const MAX_APART: f32 = 1.5;

/// What blocks are culled, sorted and chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// First group, and how many; none where its parts have to be drawn.
    pub(crate) first: usize,
    pub(crate) count: usize,
    /// Its parts among the blocks.
    pub(crate) parts: [u32; 2],
    /// Middle of the centres.
    pub(crate) middle: [f32; 3],
    /// From there to the farthest centre, scene units.
    pub(crate) spread: f32,
    /// Largest half axis, scene units.
    pub(crate) reach: f32,
    /// The largest radius of merged surfels, or how far those that they stand for lie from them if that
    /// is more; scene units.
    pub(crate) grain: f32,
    /// A unit vector.
    pub(crate) axis: [f32; 3],
    /// Least cosine of the angle between it and the normals; -1 where that is not known.
    pub(crate) cosine: f32,
}

/// A surfel on its way to be merged.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) radius: f32,
    albedo: [f32; 3],
    pub(crate) ao: f32,
    material: u32,
    /// The largest of those that it stands for.
    pub(crate) stands_for: u32,
    /// How far from it those lie at most, scene units.
    apart: f32,
}

impl Sample {
    /// How coarse it is beside what it stands for, scene units.
    fn grain(&self) -> f32 {
        if self.apart > 0.0 { self.apart.max(self.radius) } else { 0.0 }
    }

    /// sRGB codes of the albedo.
    pub(crate) fn code(&self) -> u32 {
        let [r, g, b] = self.albedo.map(|linear| {
            let c = linear.clamp(0.0, 1.0);
            let encoded =
                if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
            (encoded * 255.0 + 0.5) as u32
        });
        r | g << 8 | b << 16
    }

    /// Half-precision albedo.
    pub(crate) fn halves(&self) -> [f16; 4] {
        let [r, g, b] = self.albedo.map(f16::from_f32);
        [r, g, b, f16::ONE]
    }
}

/// A box around centres.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    fn none() -> Self {
        Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] }
    }

    fn and(mut self, low: [f32; 3], high: [f32; 3]) -> Self {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(low[axis]);
            self.high[axis] = self.high[axis].max(high[axis]);
        }
        self
    }

    fn middle(&self) -> [f32; 3] {
        [0, 1, 2].map(|axis| 0.5 * self.low[axis] + 0.5 * self.high[axis])
    }

    fn spread(&self) -> f32 {
        let half = [0, 1, 2].map(|axis| f64::from(0.5 * self.high[axis] - 0.5 * self.low[axis]));
        // In f64, whose range no square of a length leaves; rounded outwards.
        (half.iter().map(|h| h * h).sum::<f64>().sqrt() * (1.0 + 1e-6)) as f32
    }
}

/// What the blocks of a cloud are.
pub(crate) struct Tree {
    pub(crate) blocks: Vec<Block>,
    pub(crate) roots: Range<usize>,
    /// Merged surfels of blocks, in the order of their groups, from the first behind the cloud's.
    pub(crate) merged: Vec<Vec<Sample>>,
}

/// A block being made.
struct Node {
    block: Block,
    bounds: Bounds,
    /// What it is drawn as, or would be.
    samples: Vec<Sample>,
}

pub(crate) fn tree(columns: &Columns, linear_of_srgb: &[f32; 256]) -> Tree {
    let n = columns.len();
    let merges = matches!(columns.shape, Shape::Radius(_));
    let leaf = |first: usize| leaf(columns, first..(first + BLOCK).min(n), merges, linear_of_srgb);
    let firsts: Vec<usize> = (0..n).step_by(BLOCK).collect();
    let parts = |first: usize, i: usize, n: usize| {
        [first + BRANCH * i, first + (BRANCH * (i + 1)).min(n)].map(|at| at as u32)
    };
    // The samples of the smallest blocks live until their four are joined: all of them at once would
    // take more than the cloud itself.
    let (leaves, mut level): (Vec<Vec<Block>>, Vec<Node>) = firsts
        .par_chunks(BRANCH)
        .enumerate()
        .map(|(i, firsts)| {
            let leaves: Vec<Node> = firsts.iter().map(|&first| leaf(first)).collect();
            let blocks = leaves.iter().map(|leaf| leaf.block).collect();
            (blocks, joined(&leaves, parts(0, i, n.div_ceil(BLOCK))))
        })
        .unzip();
    let blocks: Vec<Block> = leaves.into_iter().flatten().collect();
    if blocks.len() <= 1 {
        return Tree { roots: 0..blocks.len(), blocks, merged: Vec::new() };
    }
    let mut tree = Tree { blocks, roots: 0..0, merged: Vec::new() };
    let mut first_group = n.div_ceil(WIDTH);
    loop {
        for node in &mut level {
            if node.block.count > 0 {
                node.block.first = first_group;
                first_group += node.block.count;
                tree.merged.push(node.samples.clone());
            }
        }
        let first = tree.blocks.len();
        tree.blocks.extend(level.iter().map(|node| node.block));
        tree.roots = first..tree.blocks.len();
        if level.len() <= 1 {
            return tree;
        }
        let join = |(i, nodes): (usize, &[Node])| joined(nodes, parts(first, i, level.len()));
        level = level.par_chunks(BRANCH).enumerate().map(join).collect();
    }
}

fn leaf(
    columns: &Columns,
    places: Range<usize>,
    merges: bool,
    linear_of_srgb: &[f32; 256],
) -> Node {
    let mut bounds = Bounds::none();
    let mut reach = 0.0f64;
    let length2 = |v: [f32; 3]| v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    let mut samples = Vec::with_capacity(if merges { places.len() } else { 0 });
    let mut normals = Vec::with_capacity(places.len());
    for place in places.clone() {
        let position = columns.positions.one(place);
        let normal = columns.normals.one(place);
        bounds = bounds.and(position, position);
        normals.push(normal);
        let radius = match &columns.shape {
            Shape::Radius(radii) => f64::from(radii.one(place)),
            // An ellipse's longer half axis is at most the root of the sum of both squares.
            Shape::Tangents(u, v) => (length2(u.one(place)) + length2(v.one(place))).sqrt(),
        };
        reach = reach.max(radius);
        if merges && radius > 0.0 {
            samples.push(Sample {
                position,
                normal,
                radius: radius as f32,
                albedo: columns.albedo_of(place, linear_of_srgb),
                ao: columns.ao_of(place),
                material: columns.material_of(place as u32),
                stands_for: place as u32,
                apart: 0.0,
            });
        }
    }
    let (axis, cosine) = cone(&normals);
    let block = Block {
        first: places.start / WIDTH,
        count: places.len().div_ceil(WIDTH),
        parts: [0, 0],
        middle: bounds.middle(),
        spread: bounds.spread(),
        reach: (reach * (1.0 + 1e-6)) as f32,
        grain: 0.0,
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
    let grain = samples.iter().map(Sample::grain).fold(0.0, f32::max);
    let block = Block {
        first: 0,
        count: if worthwhile { samples.len().div_ceil(WIDTH) } else { 0 },
        parts,
        middle: bounds.middle(),
        spread: bounds.spread(),
        reach: most(|block| block.reach).max(grown * (1.0 + 1e-6)),
        // Never finer than its parts, so that what is chosen grows coarser with the distance.
        grain: most(|block| block.grain).max(grain),
        axis,
        cosine,
    };
    Node { block, bounds, samples }
}

/// Puts samples into an order in which each four are neighbours: halves of halves across the longest
/// side, as the order along the curve has leaps.
fn gather(samples: &mut [Sample]) {
    let n_groups = samples.len().div_ceil(BRANCH);
    if n_groups < 2 {
        return;
    }
    let bounds = samples
        .iter()
        .fold(Bounds::none(), |bounds, sample| bounds.and(sample.position, sample.position));
    let side = [0, 1, 2].map(|axis| bounds.high[axis] - bounds.low[axis]);
    let longer = |a: usize, b: usize| if side[b] > side[a] { b } else { a };
    let axis = longer(longer(0, 1), 2);
    let half = BRANCH * (n_groups / 2);
    let by_place = |a: &Sample, b: &Sample| {
        let (x, y) = (a.position[axis], b.position[axis]);
        x.total_cmp(&y).then(a.stands_for.cmp(&b.stands_for))
    };
    samples.select_nth_unstable_by(half, by_place);
    let (near, far) = samples.split_at_mut(half);
    gather(near);
    gather(far);
}

/// The middle one of the radii; 0 where there are none.
fn typical_radius(samples: &[Sample]) -> f32 {
    let mut radii: Vec<f32> = samples.iter().map(|sample| sample.radius).collect();
    let middle = radii.len() / 2;
    if radii.is_empty() {
        return 0.0;
    }
    *radii.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Merges neighbours, where that makes no surfel coarser than a radius.
fn merged(all: &[Sample], coarsest: f32) -> Vec<Sample> {
    let merge = |samples: &[Sample]| merge(samples).filter(|one| one.grain() <= coarsest);
    let mut found = Vec::with_capacity(all.len() / 2);
    for four in all.chunks(BRANCH) {
        match merge(four) {
            Some(one) => found.push(one),
            None => {
                for two in four.chunks(2) {
                    match merge(two) {
                        Some(one) => found.push(one),
                        None => found.extend_from_slice(two),
                    }
                }
            }
        }
    }
    found
}

/// One surfel for several; `None` where there is none that looks like them.
fn merge(samples: &[Sample]) -> Option<Sample> {
    let [first, rest @ ..] = samples else { return None };
    if rest.is_empty() || rest.iter().any(|other| other.material != first.material) {
        return None;
    }
    // In units of the largest radius: no square overflows or vanishes.
    let unit = samples.iter().map(|sample| sample.radius).fold(0.0, f32::max);
    let weights = samples.iter().map(|sample| (sample.radius / unit).powi(2));
    let total: f32 = weights.clone().sum();
    let mean = |of: fn(&Sample) -> [f32; 3]| {
        let mut sum = [0.0; 3];
        for (sample, weight) in samples.iter().zip(weights.clone()) {
            let value = of(sample);
            for axis in 0..3 {
                sum[axis] += value[axis] * (weight / total);
            }
        }
        sum
    };
    // Relative to the first: differences of neighbours are small, coordinates need not be.
    let offset_of = |sample: &Sample, axis: usize| sample.position[axis] - first.position[axis];
    let position = [0, 1, 2].map(|axis| {
        let offsets = samples.iter().zip(weights.clone());
        let offset: f32 = offsets.map(|(one, w)| offset_of(one, axis) * (w / total)).sum();
        first.position[axis] + offset
    });
    let normal = unit_vector(mean(|sample| sample.normal))?;
    // The covariance of Gaussians around several places is the mean of theirs and that of the places;
    // a disc's is an eighth of its squared radius along each of two axes.
    let (mut squared, mut farthest) = (0.0, 0.0f32);
    for (sample, weight) in samples.iter().zip(weights.clone()) {
        let offset = [0, 1, 2].map(|axis| (sample.position[axis] - position[axis]) / unit);
        let apart2 = dot(offset, offset);
        squared += weight / total * ((sample.radius / unit).powi(2) + 4.0 * apart2);
        farthest = farthest.max(apart2.sqrt() * unit + sample.apart);
        if dot(sample.normal, normal) < MIN_COSINE || apart2 > MAX_APART * MAX_APART * total {
            return None;
        }
    }
    let radius = unit * squared.sqrt();
    let ao = samples.iter().zip(weights.clone()).map(|(sample, w)| sample.ao * (w / total)).sum();
    let largest = samples
        .iter()
        .fold(first, |largest, other| if other.radius > largest.radius { other } else { largest });
    let albedo = mean(|sample| sample.albedo);
    let is_finite = [position, normal, albedo].iter().flatten().all(|x| x.is_finite());
    let Sample { material, stands_for, .. } = *largest;
    // Surfels at one place are merged without a trace.
    let apart = farthest.max(f32::MIN_POSITIVE);
    let sample = Sample { position, normal, radius, albedo, ao, material, stands_for, apart };
    (is_finite && radius.is_finite()).then_some(sample)
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit_vector(v: [f32; 3]) -> Option<[f32; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-3).then(|| v.map(|x| x / length))
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

/// The smaller of both; -1 where one is no number.
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

/// The angle between a block's axis and any of its normals is at most this, radians.
pub(crate) fn half_angle(block: &Block) -> f32 {
    block.cosine.clamp(-1.0, 1.0).acos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(position: [f32; 3], normal: [f32; 3]) -> Sample {
        Sample {
            position,
            normal,
            radius: 1.0,
            albedo: [position[0].abs(), 0.5, 0.25],
            ao: 0.5,
            material: 0,
            stands_for: 7,
            apart: 0.0,
        }
    }

    const UP: [f32; 3] = [0.0, 1.0, 0.0];

    fn square(side: f32) -> Vec<Sample> {
        let at = |x, z| sample([x, 3.0, z], UP);
        vec![at(0.0, 0.0), at(side, 0.0), at(0.0, side), at(side, side)]
    }

    #[test]
    fn one_for_four_has_their_means_and_their_covariance() {
        let one = merge(&square(0.5)).unwrap();
        assert_eq!((one.position, one.normal), ([0.25, 3.0, 0.25], UP));
        assert_eq!((one.albedo, one.ao), ([0.25, 0.5, 0.25], 0.5));
        // An eighth of the radius squared, and a sixteenth along each axis: 1 + 8 / 16.
        assert!((one.radius - 1.5f32.sqrt()).abs() < 1e-6, "{}", one.radius);
        assert!((one.apart - 0.125f32.sqrt()).abs() < 1e-6, "{}", one.apart);
        let large = sample([9.0, 3.0, 0.0], UP);
        let mut unequal = [sample([8.0, 3.0, 0.0], UP), Sample { radius: 2.0, ..large }];
        unequal[1].stands_for = 8;
        let one = merge(&unequal).unwrap();
        assert_eq!((one.position, one.stands_for), ([8.8, 3.0, 0.0], 8), "weighted by area");
    }

    #[test]
    fn those_that_do_not_look_alike_are_not_merged() {
        let with = |change: fn(&mut Sample)| {
            let mut samples = square(0.5);
            change(&mut samples[2]);
            merge(&samples)
        };
        assert!(with(|_| ()).is_some());
        assert!(with(|sample| sample.material = 1).is_none(), "another material");
        assert!(with(|sample| sample.normal = [0.0, -1.0, 0.0]).is_none(), "turned away");
        assert!(with(|sample| sample.position[0] = 9.0).is_none(), "far away");
        assert!(with(|sample| sample.normal = [f32::NAN; 3]).is_none(), "no normal");
        assert!(with(|sample| sample.position[1] = f32::INFINITY).is_none(), "nowhere");
        assert!(merge(&square(0.5)[..1]).is_none(), "nothing to merge");
    }

    #[test]
    fn extreme_sizes_are_merged_alike() {
        for scale in [1e-30, 1e-12, 1e12, 1e30] {
            let scaled = square(0.5).into_iter().map(|sample| Sample {
                position: sample.position.map(|x| x * scale),
                radius: scale,
                ..sample
            });
            let one = merge(&scaled.collect::<Vec<_>>()).unwrap();
            let relative = one.radius / scale - 1.5f32.sqrt();
            assert!(relative.abs() < 1e-5, "{scale}: {}", one.radius);
        }
    }

    #[test]
    fn a_large_surfel_among_small_ones_stays_as_it_is() {
        let mut samples: Vec<Sample> = (0..15).flat_map(|_| square(0.5)).collect();
        samples.extend(square(0.5).into_iter().map(|one| Sample { radius: 50.0, ..one }));
        let found = merged(&samples, COARSEST * typical_radius(&samples));
        assert_eq!(found.len(), 15 + 4);
        assert!(found.iter().all(|one| one.grain() <= 2.0), "all stay fine");
    }
}
