//! Graphs of compute passes alone, whose buffers are read back: what tools run.

use crate::engine::Engine;
use crate::graph::{
    Frame, Lending, LivePasses, MadeFor, Node, PassScratch, Plan, Recorder, RenderError, Resources,
    SceneLights, SplatDrawing, checked, copy_buffer, execute, map, touched,
};
use std::collections::BTreeMap;
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::graph::{Extent, Groups, Lifetime, Pass, Structure, Work};
use surfelshop_runtime::boundary::decode;

/// Stands for the size of a view, which no part of such a graph depends on.
const NO_VIEW: [u32; 2] = [1, 1];

impl Engine {
    /// Runs all passes of a graph and returns the bytes of these of its buffers, named by their
    /// positions. Shaders are compiled once; nothing else stays on the device.
    ///
    /// # Errors
    /// Where the graph breaks a rule or has parts that only pictures have, or the device fails.
    pub fn compute(
        &mut self,
        graph: &EncodedGraph,
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, RenderError> {
        self.compute_of((graph, false), buffers)
    }

    /// The same of a graph that comes from a sandboxed plugin.
    ///
    /// # Errors
    /// As [`Engine::compute`], and where it takes more of the device than it may.
    pub fn compute_sandboxed(
        &mut self,
        graph: &EncodedGraph,
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, RenderError> {
        self.compute_of((graph, true), buffers)
    }

    fn compute_of(
        &mut self,
        (graph, is_sandboxed): (&EncodedGraph, bool),
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, RenderError> {
        let structure = decode(graph).map_err(RenderError::Plugin)?;
        check(&structure, buffers)?;
        self.plans += 1;
        let device = self.gpu.device.clone();
        let computed =
            checked(&device, || self.run_compute((structure, is_sandboxed), &graph.data, buffers));
        let computed = computed.map_err(RenderError::Device).and_then(|computed| computed);
        computed.map_err(|error| self.cause(error))
    }

    fn run_compute(
        &mut self,
        (structure, is_sandboxed): (Structure, bool),
        data: &[u8],
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, RenderError> {
        let made_for = MadeFor { size: NO_VIEW, is_sandboxed, lights: SceneLights::default() };
        let plan = Plan::new(structure, made_for, &self.gpu, &mut self.pipelines)?;
        for (pass, planned) in plan.structure.passes.iter().zip(&plan.passes) {
            if let Some(name) = &planned.of_host {
                let message = format!(
                    "`{name}` belongs to pictures; a tool's graph has no view and no scene"
                );
                return Err(RenderError::pass(&pass.name, message));
            }
        }
        let needed = LivePasses { passes: vec![true; plan.passes.len()], ..LivePasses::default() };
        let mut nodes = touched(&plan, &needed, &[]);
        let wanted = buffers.iter().map(|&buffer| buffer as usize);
        nodes.extend(wanted.clone().map(Node::Buffer));
        nodes.sort_unstable();
        nodes.dedup();
        // Of its own, so that all of it goes when this returns.
        let mut resources = Resources::default();
        let lent = resources.lend(&self.gpu, &plan, &nodes, &Lending::default());
        let mut recorder = Recorder::new(&self.gpu);
        let host = BTreeMap::new();
        let frame = Frame { data, host: &host, splats: SplatDrawing::Processor };
        let scratch = &mut PassScratch::default();
        execute(&plan, &needed, &lent, &frame, &mut recorder, &mut self.pipelines, scratch)?;
        let copies: Vec<_> = wanted
            .map(|buffer| {
                let made = lent.buffers.get(buffer).and_then(Option::as_ref);
                let size = plan.structure.buffers.get(buffer).map(|declared| declared.size);
                made.zip(size)
                    .map(|(b, size)| (copy_buffer(&self.gpu, &mut recorder.encoder, b), size))
                    .ok_or_else(|| RenderError::Graph("a buffer was not made".to_owned()))
            })
            .collect::<Result<_, _>>()?;
        recorder.submit().map_err(RenderError::Device)?;
        let read = |(copy, size): &(wgpu::Buffer, u64)| {
            let mut bytes = map(&self.gpu, copy).map_err(RenderError::Device)?;
            // Buffers on the device are made of whole words.
            bytes.truncate(usize::try_from(*size).unwrap_or(usize::MAX));
            Ok(bytes)
        };
        copies.iter().map(read).collect()
    }
}

/// A pass and those that may run instead.
fn with_alternatives(pass: &Pass) -> impl Iterator<Item = &Pass> {
    std::iter::successors(Some(pass), |pass| pass.instead.as_deref())
}

/// Refuses what only pictures have, and what would stay on the device.
fn check(structure: &Structure, buffers: &[u32]) -> Result<(), RenderError> {
    let refused = |what: String| Err(RenderError::Graph(format!("a tool's graph {what}")));
    for pass in structure.passes.iter().flat_map(with_alternatives) {
        match &pass.work {
            Work::Compute { groups: Groups::Fixed(_) | Groups::Counted { .. }, .. }
            | Work::Sort(_)
            | Work::Scan(_) => {}
            Work::Compute { groups: Groups::PerPixel { .. }, .. } => {
                let name = &pass.name;
                return refused(format!("has no pixels to count the groups of pass `{name}` by"));
            }
            Work::Shading { .. } | Work::Fullscreen { .. } | Work::Splats(_) => {
                return refused(format!("has compute passes only; pass `{}` draws", pass.name));
            }
        }
    }
    if let Some(camera) = structure.cameras.first() {
        return refused(format!("has nothing to look at; camera `{}` looks", camera.label));
    }
    if let Some((output, _)) = structure.outputs.first() {
        return refused(format!("offers no pictures; it offers `{}`", output.name()));
    }
    let lasts = |lifetime: &Lifetime| *lifetime != Lifetime::Frame;
    let textures = structure.textures.iter().map(|texture| (&texture.label, &texture.lifetime));
    let made = structure.buffers.iter().map(|buffer| (&buffer.label, &buffer.lifetime));
    if let Some((label, _)) = textures.chain(made).find(|(_, lifetime)| lasts(lifetime)) {
        return refused(format!("keeps nothing on the device; `{label}` is to be kept"));
    }
    if let Some(buffer) = structure.buffers.iter().find(|buffer| buffer.surfels.is_some()) {
        return refused(format!("has no scene to fill `{}` with surfels of", buffer.label));
    }
    if let Some(buffer) = structure.buffers.iter().find(|buffer| buffer.columns.is_some()) {
        return refused(format!("has no scene to fill `{}` with columns of", buffer.label));
    }
    for texture in &structure.textures {
        if matches!(texture.extent, Extent::View { .. }) {
            return refused(format!("has no view to take the size of `{}` from", texture.label));
        }
    }
    match buffers.iter().find(|&&buffer| buffer as usize >= structure.buffers.len()) {
        Some(buffer) => refused(format!(
            "has {} buffers; number {buffer} is to be read back",
            structure.buffers.len()
        )),
        None => Ok(()),
    }
}
