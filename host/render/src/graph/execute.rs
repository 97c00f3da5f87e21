//! Runs the needed passes of a plan.

use crate::graph::host_binding::{HostBinding, HostResources, SurfelShading};
use crate::graph::limits::{Watched, loop_units};
use crate::graph::live_passes::{LivePasses, Written, parts_of};
use crate::graph::pipeline_desc::{Pipeline, Stage};
use crate::graph::pipelines::Pipelines;
use crate::graph::plan::{Node, PassCamera, Plan, Planned};
use crate::graph::primitives::{PassScratch, Steps, counted_groups};
use crate::graph::recorder::{Attachment, PassState, Recorder};
use crate::graph::resources::{FrameResources, target_views, texture_views};
use crate::graph::shading::{SHADING_TARGET, SURFEL_RADIANCE, SURFEL_RECORDS};
use crate::graph::splats::SplatDrawing;
use crate::graph::uniform_layout::Uniforms;
use crate::graph::{RenderError, bind, primitives, splats};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;
use surfelshop_api::View;
use surfelshop_api::graph::{Buffer, Groups, Lifetime, Pass, Resource, SamplerKind, Span, Work};
use surfelshop_raster::Coverage;

/// What a frame's passes are bound to besides the graph's own resources.
pub(crate) struct Frame<'a> {
    pub(crate) data: &'a [u8],
    /// What the host gives for each camera; nothing where a graph computes without one.
    pub(crate) host: &'a BTreeMap<PassCamera, &'a dyn HostResources>,
    /// How splats are put together.
    pub(crate) splats: SplatDrawing,
}

/// The resources that the needed passes touch.
pub(crate) fn touched(plan: &Plan, needed: &LivePasses, outputs: &[usize]) -> Vec<Node> {
    let mut nodes: BTreeSet<Node> = outputs.iter().map(|&i| Node::Texture(i)).collect();
    for (pass, _) in plan.passes.iter().zip(&needed.passes).filter(|(_, needed)| **needed) {
        nodes.extend(&pass.reads);
        nodes.extend(&pass.writes);
    }
    nodes.into_iter().collect()
}

/// Records the needed passes in order; returns what they wrote.
///
/// # Errors
/// Where a pipeline cannot be made or the data are too short.
pub(crate) fn execute(
    plan: &Plan,
    needed: &LivePasses,
    resources: &FrameResources,
    frame: &Frame<'_>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<Written, RenderError> {
    upload_data(plan, resources, frame, recorder)?;
    let layouts = plan.passes.iter().flat_map(|pass| pass.layouts.values());
    let uniforms = Uniforms::new(&plan.structure.uniforms, layouts, frame.data, recorder.gpu)
        .map_err(RenderError::Graph)?;
    let mut watched = plan.made_for.is_sandboxed.then(|| Watched::new(recorder));
    pipelines.loop_units = plan.made_for.is_sandboxed.then(|| loop_units(recorder.gpu));
    let written = run_passes(
        &At { plan, needed, resources, frame, uniforms: uniforms.as_ref() },
        recorder,
        pipelines,
        scratch,
        watched.as_mut(),
    );
    pipelines.loop_units = None;
    let written = written?;
    if let Some(watched) = watched {
        watched.end(recorder)?;
    }
    Ok(written)
}

/// What passes are run from.
struct At<'a> {
    plan: &'a Plan,
    needed: &'a LivePasses,
    resources: &'a FrameResources,
    frame: &'a Frame<'a>,
    uniforms: Option<&'a Uniforms<'a>>,
}

fn run_passes(
    &At { plan, needed, resources, frame, uniforms }: &At<'_>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
    mut watched: Option<&mut Watched>,
) -> Result<Written, RenderError> {
    let mut written = Written::default();
    for (i, pass) in plan.structure.passes.iter().enumerate() {
        let planned = &plan.passes[i];
        if let Some(watched) = watched.as_deref_mut().filter(|_| i > 0) {
            watched.passed(&plan.structure.passes[i - 1].name, recorder)?;
        }
        if !needed.passes[i] {
            recorder.note(&pass.name, PassState::Culled);
            continue;
        }
        let kept = |node: &Node| plan.persistent(*node) && resources.is_filled(*node);
        if !planned.writes.is_empty() && planned.writes.iter().all(kept) {
            recorder.note(&pass.name, PassState::Reused);
            continue;
        }
        if matches!(pass.work, Work::Sort(_) | Work::Scan(_)) {
            primitives::run(pass, resources, recorder, pipelines, scratch)?;
            written.add(planned, None);
            continue;
        }
        let pipeline = plan.pipeline(i, pipelines)?;
        let targets = target_views(plan, resources, i, &written.nodes);
        let samplers = samplers_of(pass, pipelines);
        let mut variables = Variables {
            plan,
            pass,
            planned,
            frame,
            resources,
            uniforms,
            spent: watched.as_deref().map(|watched| &watched.spent),
            samplers: &samplers,
            views: texture_views(plan, resources, i),
            target: targets.first().map(|(view, ..)| view),
            lit: None,
        };
        if let Some(shader) = &planned.surfels {
            let pipeline = plan.surfel_pipeline(i, shader, pipelines)?;
            variables.lit = Some(shade_surfels(&variables, &pipeline, recorder, pipelines)?);
        }
        if let Work::Splats(splats) = &pass.work {
            let composing = plan.per_pixel_pipeline(i, pipelines)?;
            let composing = composing.as_deref();
            splats::draw(splats, &variables, &pipeline, composing, recorder, pipelines, scratch)?;
            written.add(planned, None);
            continue;
        }
        let group = variables
            .check_whole()
            .and_then(|()| bind(recorder.gpu, &pipeline, |name| variables.resource(name)))
            .map_err(|message| RenderError::pass(&pass.name, message))?;
        let mut covered = None;
        match &pipeline.stage {
            Stage::Compute(stage) => {
                let bound = (stage, &group);
                let at = Place { plan, resources, index: i };
                dispatch(&at, bound, recorder, pipelines, scratch)
                    .map_err(|message| RenderError::pass(&pass.name, message))?;
            }
            Stage::Render(stage) => {
                covered = variables.draw(&targets, stage, &group, recorder);
            }
        }
        written.add(planned, covered.as_ref());
    }
    Ok(written)
}

/// What the variables of one pass are bound to.
pub(super) struct Variables<'a> {
    pub(super) plan: &'a Plan,
    pub(super) pass: &'a Pass,
    pub(super) planned: &'a Planned,
    pub(super) frame: &'a Frame<'a>,
    pub(super) resources: &'a FrameResources,
    uniforms: Option<&'a Uniforms<'a>>,
    /// Units of work of a sandboxed plugin's loops.
    spent: Option<&'a wgpu::Buffer>,
    samplers: &'a HashMap<SamplerKind, wgpu::Sampler>,
    /// Textures by variable.
    views: HashMap<String, wgpu::TextureView>,
    target: Option<&'a wgpu::TextureView>,
    /// The surface of surfels that were shaded one by one.
    lit: Option<wgpu::TextureView>,
}

impl Variables<'_> {
    pub(super) fn resource(&self, name: &str) -> Option<wgpu::BindingResource<'_>> {
        if let Some(given) = HostBinding::of(name) {
            return self.of_host(given);
        }
        if name == SHADING_TARGET {
            return Some(wgpu::BindingResource::TextureView(self.target?));
        }
        match self.pass.bindings.get(name)? {
            Resource::Uniform(id) => {
                let span = match self.planned.layouts.get(name) {
                    Some(layout) => self.uniforms?.span_of(layout)?,
                    None => *self.plan.structure.uniforms.get(id.index())?,
                };
                Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &self.uniforms?.buffer,
                    offset: span.offset,
                    size: std::num::NonZeroU64::new(span.len),
                }))
            }
            Resource::Texture { .. } => {
                Some(wgpu::BindingResource::TextureView(self.views.get(name)?))
            }
            Resource::Buffer(id) => {
                Some(self.resources.buffers.get(id.index())?.as_ref()?.as_entire_binding())
            }
            Resource::Sampler(kind) => {
                Some(wgpu::BindingResource::Sampler(self.samplers.get(kind)?))
            }
        }
    }

    /// # Errors
    /// Where columns are larger than the device binds, which only passes of splats are given part by part.
    fn check_whole(&self) -> Result<(), String> {
        for (name, resource) in &self.pass.bindings {
            let Resource::Buffer(id) = resource else { continue };
            let n_parts = self.resources.parts.get(&id.index()).map_or(0, Vec::len);
            if n_parts > 1 {
                return Err(format!(
                    "`{name}` holds columns that are larger than this device binds; only passes of splats are given \
                     them in parts: ask for fewer or narrower columns, or store them as 16-bit floats"
                ));
            }
        }
        Ok(())
    }

    /// The view that the pass looks from, and scene units of a unit of drawing; `None` where a graph computes without one.
    pub(super) fn view(&self) -> Option<(&View, f64)> {
        self.frame.host.get(&self.planned.seat).map(|host| (host.view(), host.unit()))
    }

    /// Records the draw of a pass; returns in which part of its target it drew alone.
    fn draw(
        &self,
        targets: &[(wgpu::TextureView, bool, Option<u32>)],
        stage: &wgpu::RenderPipeline,
        group: &wgpu::BindGroup,
        recorder: &mut Recorder<'_>,
    ) -> Option<Arc<Coverage>> {
        let mut colors: Vec<Attachment<'_>> = targets
            .iter()
            .map(|(view, clear, slice)| Attachment { view, clear: *clear, slice: *slice })
            .collect();
        let covered = self.covered(&colors);
        let held = match self.planned.writes.as_slice() {
            [Node::Texture(i)] => self.resources.held(*i).map(Arc::as_ref),
            _ => None,
        };
        let parts = covered.as_deref().map(|covered| match (held, colors.as_mut_slice()) {
            // What was drawn there before is drawn over, with zeros where nothing is now.
            (Some(held), [color]) if held.size() == covered.size() => {
                color.clear = false;
                parts_of(&covered.with(held))
            }
            _ => parts_of(covered),
        });
        recorder.render(&self.pass.name, &colors, None, |pass| {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, group, &[]);
            match &parts {
                None => pass.draw(0..3, 0..1),
                Some(parts) => parts.iter().for_each(|&[x, y, width, height]| {
                    pass.set_scissor_rect(x, y, width, height);
                    pass.draw(0..3, 0..1);
                }),
            }
        });
        covered
    }

    /// Which parts of its only target a pass that shades the surface draws into: what is cleared there elsewhere is
    /// what it would draw. `None` where that is not so, or not known.
    fn covered(&self, targets: &[Attachment<'_>]) -> Option<Arc<Coverage>> {
        let Work::Shading { elsewhere: None, per_surfel: false, .. } = self.pass.work else {
            return None;
        };
        let [Attachment { view, clear: true, slice: None }] = targets else { return None };
        let texture = view.texture();
        let covered = self.frame.host.get(&self.planned.seat)?.covered()?;
        let same = [texture.width(), texture.height()].map(|side| side as usize) == covered.size();
        let is_one = texture.mip_level_count() == 1 && texture.depth_or_array_layers() == 1;
        (same && is_one).then(|| covered.clone())
    }

    /// The packed surface of all clouds that the pass looks at.
    pub(super) fn whole_surface(&self) -> Option<wgpu::BindingResource<'_>> {
        self.frame.host.get(&self.planned.seat)?.whole_surface(self.planned.surface)
    }

    /// A variable of the host's modules.
    fn of_host(&self, binding: HostBinding) -> Option<wgpu::BindingResource<'_>> {
        if binding == HostBinding::Spent {
            return self.spent.map(wgpu::Buffer::as_entire_binding);
        }
        if let (HostBinding::Surface, Some(lit)) = (binding, &self.lit) {
            return Some(wgpu::BindingResource::TextureView(lit));
        }
        self.frame.host.get(&self.planned.seat)?.resource(binding, self.planned.surface)
    }
}

/// The samplers that a pass binds.
fn samplers_of(pass: &Pass, pipelines: &mut Pipelines) -> HashMap<SamplerKind, wgpu::Sampler> {
    let kinds = pass.bindings.values().filter_map(|resource| match resource {
        Resource::Sampler(kind) => Some(*kind),
        _ => None,
    });
    kinds.map(|kind| (kind, pipelines.sampler(kind))).collect()
}

/// Shades surfels one by one and blends what they radiate.
fn shade_surfels(
    variables: &Variables<'_>,
    pipeline: &Pipeline,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<wgpu::TextureView, RenderError> {
    let gpu = recorder.gpu;
    let shading = SurfelShading {
        name: &variables.pass.name,
        pipeline,
        bind: &|records, radiance| {
            bind(gpu, pipeline, |name| match name {
                SURFEL_RECORDS => Some(records.as_entire_binding()),
                SURFEL_RADIANCE => Some(radiance.as_entire_binding()),
                _ => variables.resource(name),
            })
        },
    };
    let missing = || RenderError::Host("the nearest surfels were not found".to_owned());
    let host = variables.frame.host.get(&variables.planned.seat).ok_or_else(missing)?;
    host.shade_surfels(&shading, recorder, pipelines)
}

/// Checks where uniforms lie in the data and brings uploads onto the device.
fn upload_data(
    plan: &Plan,
    resources: &FrameResources,
    frame: &Frame<'_>,
    recorder: &mut Recorder<'_>,
) -> Result<(), RenderError> {
    let end = |offset: u64, len: u64| offset.saturating_add(len);
    for span in &plan.structure.uniforms {
        let Span { offset, len } = *span;
        let n_bytes = frame.data.len();
        if end(offset, len) > n_bytes as u64 || offset % 256 != 0 {
            return Err(RenderError::Graph(format!(
                "a uniform of {len} bytes at {offset} of the frame's {n_bytes} bytes of data; it must lie \
                 within them, at a multiple of 256"
            )));
        }
    }
    for (i, buffer) in plan.structure.buffers.iter().enumerate() {
        let Some(made) = &resources.buffers[i] else { continue };
        match buffer.upload {
            Some(span) => {
                let bytes = usize::try_from(span.offset)
                    .ok()
                    .zip(usize::try_from(end(span.offset, span.len)).ok())
                    .and_then(|(first, end)| frame.data.get(first..end))
                    .filter(|bytes| bytes.len() as u64 <= made.size())
                    .filter(|_| buffer.resident.is_none() || fills(buffer, span))
                    .ok_or_else(|| {
                        let label = &buffer.label;
                        RenderError::Graph(format!("buffer `{label}` has no such data to upload"))
                    })?;
                let mut padded = bytes.to_vec();
                padded.resize(bytes.len().next_multiple_of(4), 0);
                recorder.gpu.queue.write_buffer(made, 0, &padded);
            }
            None if resources.is_resident(i) => {}
            None if let Some(key) = &buffer.resident => {
                return Err(RenderError::Graph(format!(
                    "the bytes of buffer `{}` are not on the device under `{}`; a frame whose request does not \
                     list that key sends them",
                    buffer.label,
                    key.escape_debug()
                )));
            }
            None if matches!(buffer.lifetime, Lifetime::Frame)
                && buffer.surfels.is_none()
                && buffer.columns.is_none() =>
            {
                recorder.encoder.clear_buffer(made, 0, None);
            }
            None => {}
        }
    }
    Ok(())
}

/// Whether a range is as long as a buffer, but for what lacks of a word.
fn fills(buffer: &Buffer, span: Span) -> bool {
    span.len.next_multiple_of(4).max(4) == buffer.size.next_multiple_of(4)
}

/// A pass of a plan, with what it is bound to.
struct Place<'a> {
    plan: &'a Plan,
    resources: &'a FrameResources,
    index: usize,
}

/// Records a compute pass.
fn dispatch(
    at: &Place<'_>,
    (stage, group): (&wgpu::ComputePipeline, &wgpu::BindGroup),
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<(), String> {
    let &Place { plan, resources, index } = at;
    let pass = &plan.structure.passes[index];
    let groups = match pass.work {
        Work::Compute { groups: Groups::Fixed(groups), .. } => groups,
        Work::Compute { groups: Groups::Counted { buffer, offset, at_most }, .. } => {
            let of_group = plan.passes[index].workgroup_size.iter().product();
            let mut steps = Steps::new(recorder.gpu, pipelines, scratch);
            let most = [at_most, of_group];
            let (step, groups) = counted_groups(&mut steps, resources, (buffer, offset), most)?;
            let taken = steps.taken;
            recorder.compute(&pass.name, |pass| {
                step.record(pass);
                pass.set_pipeline(stage);
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups_indirect(&groups, 0);
            });
            taken.into_iter().for_each(|buffer| scratch.give(buffer));
            return Ok(());
        }
        Work::Compute { groups: Groups::PerPixel { divisor }, .. } => {
            per_pixel(plan, index, divisor)
        }
        Work::Shading { .. }
        | Work::Fullscreen { .. }
        | Work::Splats(_)
        | Work::Sort(_)
        | Work::Scan(_) => per_pixel(plan, index, 1),
    };
    recorder.compute(&pass.name, |pass| {
        pass.set_pipeline(stage);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(groups[0], groups[1], groups[2]);
    });
    Ok(())
}

/// Workgroups that give each pixel of the view, divided, one invocation.
fn per_pixel(plan: &Plan, index: usize, divisor: u32) -> [u32; 3] {
    let [x, y, _] = plan.passes[index].workgroup_size;
    let across = |size: u32, group: u32| size.div_ceil(divisor.max(1)).div_ceil(group.max(1));
    let [width, height] = plan.size_of(&plan.structure.passes[index]);
    [across(width, x), across(height, y), 1]
}
