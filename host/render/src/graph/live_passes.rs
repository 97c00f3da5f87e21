//! Which passes run: those that requested outputs depend on.

use crate::graph::plan::{Node, PassCamera, Plan};
use crate::shader_compiler::SurfaceMembers;
use std::collections::{BTreeMap, HashSet};
use surfelshop_api::graph::SurfaceMode;

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
