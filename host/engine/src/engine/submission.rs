//! One frame's commands: which passes, over which surface, into which pictures.

use super::uniforms::{Seeing, lights_uniform, uniform, view_uniform};
use super::{RenderRequest, Rendered};
use crate::environment::Environments;
use crate::gpu::Gpu;
use crate::run::{
    Frame, FrameResources, HOST_SURFACE, HOST_VIEW, Needed, Node, Pending, Pipelines, Plan,
    Recorder, RenderError, Resources, Seen, Settings, Stage, bind, copy, execute, needed, touched,
};
use crate::surfels::{DrawnCloud, RESOLVE, Surface, SurfaceParts, Surfaces, Wanted};
use surfelshop_api::graph::{Output, SurfaceMode};

/// Everything one frame's commands are made from.
pub(super) struct Submission<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) pipelines: &'a mut Pipelines,
    pub(super) surfaces: &'a mut Surfaces,
    pub(super) resources: &'a mut Resources,
    pub(super) environments: &'a mut Environments,
    pub(super) plan: &'a Plan,
    pub(super) scope: &'a str,
    pub(super) data: &'a [u8],
    pub(super) request: &'a RenderRequest<'a>,
    pub(super) asked: Asked,
    pub(super) clouds: &'a [DrawnCloud],
    /// Whether compute draws the small surfels.
    pub(super) computes: bool,
}

/// What a frame leaves for later ones, to be taken back once the device has accepted it all.
pub(super) struct Done {
    pub(super) lent: FrameResources,
    pub(super) written: Vec<Node>,
}

/// What is asked of a graph, and what that takes.
pub(super) struct Asked {
    sources: Vec<Source>,
    graph_outputs: Vec<usize>,
    needed: Needed,
    host_mode: SurfaceMode,
}

impl Asked {
    /// # Errors
    /// Where neither the graph nor the host offers a requested output.
    pub(super) fn new(plan: &Plan, outputs: &[Output]) -> Result<Self, RenderError> {
        let sources = sources(plan, outputs)?;
        let of_graph = |source: &Source| match source {
            Source::Graph(texture) => Some(*texture),
            Source::Surface(_) => None,
        };
        let graph_outputs: Vec<usize> = sources.iter().filter_map(of_graph).collect();
        let needed = needed(plan, &graph_outputs);
        let host_mode = plan.passes.iter().find_map(|pass| pass.surface).unwrap_or_default();
        Ok(Self { sources, graph_outputs, needed, host_mode })
    }

    /// Columns that are read, of those that drawing can do without.
    pub(super) fn wanted(&self) -> Wanted {
        let shown = |entry: &str| {
            self.sources.iter().any(|s| matches!(s, Source::Surface(shown) if *shown == entry))
        };
        Wanted {
            color: self.needed.members.albedo || shown("albedo_only"),
            ao: self.needed.members.ao || shown("ao_only"),
            material: self.needed.material,
            fields: self.needed.surfaces.contains(&SurfaceMode::Fields)
                || self.host_mode == SurfaceMode::Fields && shown("normal_only"),
        }
    }
}

/// Where a requested output comes from.
enum Source {
    /// A texture of the graph.
    Graph(usize),
    /// The host's surface buffer, through an entry point of the resolve shader.
    Surface(&'static str),
}

impl Submission<'_> {
    pub(super) fn run(self) -> Result<(Rendered, Done), RenderError> {
        let Asked { sources, graph_outputs, needed, host_mode } = self.asked;
        let parts = parts(&needed, &sources, host_mode);
        let seeing = Seeing::new(self.gpu, self.request, self.clouds, self.computes)?;
        let view_uniform = uniform(self.gpu, "view", view_uniform(self.request, &seeing.drawn));
        let lights_uniform =
            uniform(self.gpu, "lights", lights_uniform(self.request, &seeing.drawn));
        let mut recorder = Recorder::new(self.gpu);
        let view_from_offset = |origin| seeing.view_from_offset(self.request, origin);
        let input = seeing.input(self.request, self.clouds, &view_from_offset);
        let surface = if parts == SurfaceParts::default() {
            None
        } else {
            let made = self.surfaces.ensure(parts, &input, &mut recorder, self.pipelines);
            Some(made.map_err(RenderError::Host)?)
        };
        let mut running = self.plan.passes.iter().zip(&needed.passes);
        let environment = match running.any(|(pass, runs)| *runs && pass.environment) {
            true => Some(self.environments.bind(self.gpu, self.request.environment.as_ref())?),
            false => None,
        };
        let nodes = touched(self.plan, &needed, &graph_outputs);
        let lent = self.resources.lend(self.gpu, self.plan, &nodes, self.scope);
        let seen = Seen {
            view_uniform: &view_uniform,
            lights_uniform: &lights_uniform,
            surface,
            environment: environment.as_ref(),
            surfels: &input,
        };
        let frame = Frame { data: self.data, seen: Some(seen) };
        let written = execute(self.plan, &needed, &lent, &frame, &mut recorder, self.pipelines)?;
        let mut pending: Vec<Pending> = Vec::new();
        for source in &sources {
            let texture = match source {
                Source::Graph(index) => lent.textures[*index].clone(),
                Source::Surface(entry) => Some(show_surface(
                    entry,
                    surface,
                    host_mode,
                    &view_uniform,
                    &mut recorder,
                    self.pipelines,
                )?),
            };
            let texture =
                texture.ok_or_else(|| RenderError::Graph("an output was not made".to_owned()))?;
            pending.push(copy(self.gpu, &mut recorder.encoder, &texture));
        }
        let passes = recorder.submit().map_err(RenderError::Device)?;
        let images = pending
            .into_iter()
            .zip(self.request.outputs)
            .map(|(pending, output)| Ok((output.clone(), pending.finish(self.gpu)?)))
            .collect::<Result<Vec<_>, String>>()
            .map_err(RenderError::Device)?;
        let wants_another_frame = self.plan.structure.wants_another_frame;
        let graph_bytes = lent.bytes();
        // Both are the engine's to say.
        let (columns_ms, merged) = (0.0, false);
        let rendered =
            Rendered { images, passes, graph_bytes, merged, columns_ms, wants_another_frame };
        Ok((rendered, Done { lent, written }))
    }
}

/// Where each requested output comes from.
fn sources(plan: &Plan, outputs: &[Output]) -> Result<Vec<Source>, RenderError> {
    let offered = &plan.structure.outputs;
    let source = |wanted: &Output| {
        if let Some((_, texture)) = offered.iter().find(|(output, _)| output == wanted) {
            return Ok(Source::Graph(texture.index()));
        }
        match wanted {
            Output::Depth => Ok(Source::Surface("depth_only")),
            Output::Normal => Ok(Source::Surface("normal_only")),
            Output::Albedo => Ok(Source::Surface("albedo_only")),
            Output::Ao => Ok(Source::Surface("ao_only")),
            Output::Color | Output::Debug(_) => {
                let own = offered.iter().map(|(output, _)| output.name());
                let host = ["depth", "normal", "albedo", "ao"].map(str::to_owned);
                let mut names: Vec<_> = own.chain(host).collect();
                names.dedup();
                Err(RenderError::NoOutput { wanted: wanted.name(), offered: names.join(", ") })
            }
        }
    };
    outputs.iter().map(source).collect()
}

/// The parts of the surface that needed passes and requested outputs read.
fn parts(needed: &Needed, sources: &[Source], host_mode: SurfaceMode) -> SurfaceParts {
    let mut parts = SurfaceParts::default();
    for &mode in &needed.surfaces {
        parts.add(mode);
    }
    parts.visibility |= needed.surfels;
    if needed.material {
        parts.visibility = true;
        parts.material = true;
    }
    if needed.object {
        parts.visibility = true;
        parts.object = true;
    }
    for source in sources {
        match source {
            Source::Surface("depth_only") => {
                parts.visibility = true;
                parts.winners = true;
            }
            Source::Surface(_) => parts.add(host_mode),
            Source::Graph(_) => {}
        }
    }
    parts
}

/// Draws one of the surface's values as a picture.
fn show_surface(
    entry: &str,
    surface: Option<&Surface>,
    mode: SurfaceMode,
    view_uniform: &wgpu::Buffer,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<wgpu::Texture, RenderError> {
    let gpu = recorder.gpu;
    let missing = || RenderError::Host("the surface was not made".to_owned());
    let surface = surface.ok_or_else(missing)?;
    let size = surface.size();
    let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(entry),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let name = format!("host: {}", entry.trim_end_matches("_only"));
    let shader = pipelines.shader(RESOLVE, &[]).map_err(RenderError::Host)?;
    let found = pipelines.compute(&name, &shader, entry, &Settings::default());
    let pipeline = found.map_err(RenderError::Host)?.pipeline;
    let group = bind(gpu, &pipeline, |name| match name {
        HOST_VIEW => Some(view_uniform.as_entire_binding()),
        HOST_SURFACE => Some(wgpu::BindingResource::TextureView(surface.packed(mode)?)),
        "nearest" => Some(wgpu::BindingResource::TextureView(&surface.winners)),
        "picture" => Some(wgpu::BindingResource::TextureView(&view)),
        _ => None,
    })
    .map_err(RenderError::Host)?;
    recorder.compute(&name, |pass| {
        if let Stage::Compute(stage) = &pipeline.stage {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(size.width.div_ceil(8), size.height.div_ceil(8), 1);
        }
    });
    Ok(target)
}
