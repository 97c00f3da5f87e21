//! Which passes run: those that requested outputs depend on; and what they wrote.

use crate::graph::plan::{Node, PassCamera, Plan, Planned};
use crate::shader_compiler::SurfaceMembers;
use std::collections::{BTreeMap, HashSet};
use std::sync::Arc;
use surfelshop_api::graph::SurfaceMode;
use surfelshop_raster::{Coverage, Rectangle};

/// What a frame has to do.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct LivePasses {
    /// For each pass, whether it feeds a requested output.
    pub(crate) passes: Vec<bool>,
    /// What they read of surfaces.
    pub(crate) members: SurfaceMembers,
    /// What they look at, by camera.
    pub(crate) looks: BTreeMap<PassCamera, SurfaceNeeds>,
}

/// What the passes that look from a camera read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct SurfaceNeeds {
    /// Surfaces.
    pub(crate) surfaces: Vec<SurfaceMode>,
    /// Whether one of them reads materials.
    pub(crate) material: bool,
    /// Whether one of them reads which cloud a pixel shows.
    pub(crate) object: bool,
    /// Whether one of them shades surfels one by one.
    pub(crate) surfels: bool,
}

impl LivePasses {
    /// What is read from a camera.
    pub(crate) fn look(&self, seat: PassCamera) -> SurfaceNeeds {
        self.looks.get(&seat).cloned().unwrap_or_default()
    }
}

/// Walks back from the requested textures over what each pass reads and writes.
pub(crate) fn needed(plan: &Plan, requested: &[usize]) -> LivePasses {
    let mut wanted: HashSet<Node> = requested.iter().map(|&i| Node::Texture(i)).collect();
    let mut needed = LivePasses { passes: vec![false; plan.passes.len()], ..LivePasses::default() };
    for (i, pass) in plan.passes.iter().enumerate().rev() {
        if !pass.writes.iter().any(|node| wanted.contains(node)) {
            continue;
        }
        needed.passes[i] = true;
        wanted.extend(&pass.reads);
        needed.members = needed.members.or(pass.members);
        let look = needed.looks.entry(pass.seat).or_default();
        look.material |= pass.material;
        look.object |= pass.object;
        look.surfels |= pass.surfels.is_some();
        if let Some(mode) = pass.surface
            && !look.surfaces.contains(&mode)
        {
            look.surfaces.push(mode);
        }
    }
    needed
}

/// What passes wrote.
#[derive(Default)]
pub(crate) struct Written {
    pub(crate) nodes: Vec<Node>,
    /// Textures that hold nothing but zeros outside of a part of the picture.
    pub(crate) covered: BTreeMap<usize, Arc<Coverage>>,
}

impl Written {
    /// Notes what a pass wrote, within a part of the picture where that is known.
    pub(super) fn add(&mut self, planned: &Planned, covered: Option<&Arc<Coverage>>) {
        self.nodes.extend(&planned.writes);
        for node in &planned.writes {
            let Node::Texture(texture) = node else { continue };
            match covered {
                Some(covered) => self.covered.insert(*texture, covered.clone()),
                None => self.covered.remove(texture),
            };
        }
    }
}

/// Most rectangles that a pass is drawn in: each is a command, which takes as long as hundreds of pixels.
const MAX_PARTS: usize = 512;

/// What is drawn of a picture.
pub(super) fn parts_of(covered: &Coverage) -> Vec<Rectangle> {
    let all = covered.rectangles();
    if all.len() <= MAX_PARTS { all } else { covered.strips(covered, MAX_PARTS) }
}
