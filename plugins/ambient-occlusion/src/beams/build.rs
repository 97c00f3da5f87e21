//! The hierarchy: the surfels' octree down to some hundred, and below it whole blocks of discs.

use super::{Beams, Block, CHILDREN, LEAF, Node, WIDTH};
use crate::surfels::Surfels;
use surfelshop_api::glam::Vec3;

/// Lower and upper corner.
type Box3 = (Vec3, Vec3);

const NOTHING: Box3 = (Vec3::INFINITY, Vec3::NEG_INFINITY);

fn around(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

impl Beams {
    /// The discs of these surfels.
    pub(crate) fn of(surfels: &Surfels, radii: &[f32]) -> Self {
        let tree = surfels.tree.nodes();
        let mut boxes = vec![NOTHING; tree.len()];
        for (i, node) in tree.iter().enumerate().rev() {
            boxes[i] = if node.children.is_empty() {
                let places = node.surfels.start as usize..node.surfels.end as usize;
                places.map(|place| disc_box(surfels, radii, place)).fold(NOTHING, around)
            } else {
                let children = node.children.start as usize..node.children.end as usize;
                boxes[children].iter().copied().fold(NOTHING, around)
            };
        }
        let mut beams =
            Self { nodes: Vec::new(), leaves: Vec::new(), blocks: Vec::new(), root: None };
        if tree.is_empty() {
            return beams;
        }
        let build = Build { surfels, radii, boxes: &boxes };
        let (root, _) = build.add(&mut beams, Source::Node(0));
        beams.root = Some(root);
        beams
    }
}

/// What becomes a node or a leaf.
enum Source {
    /// A node of the tree.
    Node(u32),
    /// Discs that lie together.
    Discs(Vec<u32>),
}

/// Discs of a node that is divided by itself.
const DIVIDED: usize = CHILDREN * WIDTH;

struct Build<'a> {
    surfels: &'a Surfels,
    radii: &'a [f32],
    boxes: &'a [Box3],
}

impl Build<'_> {
    /// Adds a node or a leaf, and what is below it. The tree is at most as deep as keys have digits.
    fn add(&self, beams: &mut Beams, source: Source) -> (u32, Box3) {
        let (children, bounds) = match source {
            Source::Node(index) => {
                let node = &self.surfels.tree.nodes()[index as usize];
                if node.children.is_empty() || node.surfels.len() <= DIVIDED {
                    let is_disc = |place: &u32| self.radii[*place as usize] > 0.0;
                    return self
                        .add(beams, Source::Discs(node.surfels.clone().filter(is_disc).collect()));
                }
                let children: Vec<Source> = node.children.clone().map(Source::Node).collect();
                (children, self.boxes[index as usize])
            }
            Source::Discs(discs) => {
                let box_of = |place: &u32| disc_box(self.surfels, self.radii, *place as usize);
                let bounds = discs.iter().map(box_of).fold(NOTHING, around);
                if discs.len() <= WIDTH || discs.len() > DIVIDED {
                    return (self.leaf(beams, discs), bounds);
                }
                let mut parts = Vec::with_capacity(CHILDREN);
                self.divide(discs, &mut parts);
                (parts.into_iter().map(Source::Discs).collect(), bounds)
            }
        };
        let place = beams.nodes.len();
        let mut nothing = [[f32::INFINITY; CHILDREN]; 6];
        nothing[3..].fill([f32::NEG_INFINITY; CHILDREN]);
        beams.nodes.push(Node { bounds: nothing, children: [0; CHILDREN] });
        for (slot, child) in children.into_iter().enumerate() {
            let (reference, (low, high)) = self.add(beams, child);
            let node = &mut beams.nodes[place];
            node.children[slot] = reference;
            let corners = low.to_array().into_iter().chain(high.to_array());
            for (bound, value) in node.bounds.iter_mut().zip(corners) {
                bound[slot] = value;
            }
        }
        (place as u32, bounds)
    }

    /// Divides discs into whole blocks, halves across the longest side.
    fn divide(&self, mut discs: Vec<u32>, parts: &mut Vec<Vec<u32>>) {
        if discs.len() <= WIDTH {
            parts.push(discs);
            return;
        }
        let at = |place: u32| self.surfels.positions[place as usize];
        let (low, high) = discs
            .iter()
            .fold(NOTHING, |(low, high), &place| (low.min(at(place)), high.max(at(place))));
        let axis = (high - low).max_position();
        let half = discs.len().div_ceil(2 * WIDTH) * WIDTH;
        let order = |a: &u32, b: &u32| at(*a)[axis].total_cmp(&at(*b)[axis]).then(a.cmp(b));
        discs.select_nth_unstable_by(half, order);
        let rest = discs.split_off(half);
        self.divide(discs, parts);
        self.divide(rest, parts);
    }

    fn leaf(&self, beams: &mut Beams, mut discs: Vec<u32>) -> u32 {
        let (surfels, radii) = (self.surfels, self.radii);
        // A ray needs one of a thousand copies; of each side they have the same radius.
        let key = |place: u32| {
            let place = place as usize;
            let bits = |v: Vec3| v.to_array().map(f32::to_bits);
            (bits(surfels.positions[place]), bits(surfels.normals[place]), radii[place].to_bits())
        };
        if discs.len() > WIDTH {
            discs.sort_by_key(|&place| key(place));
            discs.dedup_by_key(|place| key(*place));
        } else {
            discs.sort_unstable();
        }
        let start = beams.blocks.len() as u32;
        for discs in discs.chunks(WIDTH) {
            let mut block = Block {
                centre: [[0.0; WIDTH]; 3],
                normal: [[0.0; WIDTH]; 3],
                radius: [-1.0; WIDTH],
            };
            for (i, &place) in discs.iter().enumerate() {
                let place = place as usize;
                for axis in 0..3 {
                    block.centre[axis][i] = surfels.positions[place][axis];
                    block.normal[axis][i] = surfels.normals[place][axis];
                }
                block.radius[i] = radii[place];
            }
            beams.blocks.push(block);
        }
        beams.leaves.push(start..beams.blocks.len() as u32);
        LEAF | (beams.leaves.len() as u32 - 1)
    }
}

/// The box of a disc, a few rounding steps larger.
fn disc_box(surfels: &Surfels, radii: &[f32], place: usize) -> Box3 {
    if radii[place] <= 0.0 {
        return NOTHING;
    }
    let (at, n) = (surfels.positions[place], surfels.normals[place]);
    let half = radii[place] * (Vec3::ONE - n * n).max(Vec3::ZERO).map(f32::sqrt);
    let half = half + 4.0 * f32::EPSILON * (at.abs() + half);
    (at - half, at + half)
}
