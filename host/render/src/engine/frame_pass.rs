//! One frame's commands: which passes, over which surface, into which pictures.

use crate::engine::RenderRequest;
use crate::engine::prepared_view::{DrawnAs, PreparedView, lights_uniform, uniform, view_uniform};
use crate::engine::several::masked;
use crate::environment_map::{Bound, Environments};
use crate::gpu::Gpu;
use crate::graph::{
    Frame, FrameResources, HostBinding, HostResources, Lending, LivePasses, Node, PassCamera,
    PassReport, PassScratch, Pending, Pipelines, Plan, Recorder, RenderError, Resources, Settings,
    SplatDrawing, Stage, SurfaceNeeds, SurfelShading, Written, bind, copy, execute, needed,
    touched,
};
use crate::surfels::{
    ColumnDemand, DrawnCloud, RESOLVE, Surface, SurfaceInput, SurfaceParts, Surfaces,
    SurfelDrawing, lit_surface,
};
use glam::Vec2;
use std::collections::BTreeMap;
use std::sync::Arc;
use surfelshop_api::View;
use surfelshop_api::graph::{Output, SurfaceMode, Work};
use surfelshop_image::Image;
use surfelshop_raster::Coverage;

/// Everything one frame's commands are made from.
pub(super) struct Submission<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) pipelines: &'a mut Pipelines,
    pub(super) surfaces: &'a mut Surfaces,
    pub(super) resources: &'a mut Resources,
    pub(super) environments: &'a mut Environments,
    pub(super) plan: &'a Plan,
    pub(super) lending: Lending<'a>,
    pub(super) data: &'a [u8],
    pub(super) request: &'a RenderRequest<'a>,
    /// Where the picture is seen in each pixel, from its centre.
    pub(super) shift_px: Vec2,
    pub(super) asked: OutputRequest,
    pub(super) clouds: &'a [DrawnCloud<'a>],
    pub(super) scratch: &'a mut PassScratch,
    /// How splats are put together.
    pub(super) splats: SplatDrawing,
    /// The clouds whose surface the graph shades; `None` where it is all of it.
    pub(super) own: Option<&'a [u32]>,
    /// How surfels are drawn.
    pub(super) drawing: SurfelDrawing,
    /// Whether those that are seen from behind have a colour of their own.
    pub(super) tints_backs: bool,
}

/// What came of a frame, with what later ones take back once the device has accepted it all.
pub(super) struct FrameResult {
    pub(super) images: Vec<(Output, Image)>,
    /// Pictures of the surface that were asked of the host besides.
    pub(super) of_host: Vec<Image>,
    pub(super) passes: Vec<PassReport>,
    pub(super) graph_bytes: u64,
    pub(super) resources: FrameResources,
    pub(super) written: Written,
}

/// What is asked of a graph, and besides of the host, by entry points of its shader; and what that takes.
pub(super) struct OutputRequest {
    sources: Vec<Source>,
    graph_outputs: Vec<usize>,
    needed: LivePasses,
    host_mode: SurfaceMode,
}

impl OutputRequest {
    /// # Errors
    /// Where neither the graph nor the host offers a requested output.
    pub(super) fn new(
        plan: &Plan,
        outputs: &[Output],
        besides: &[&'static str],
    ) -> Result<Self, RenderError> {
        let mut sources = sources(plan, outputs)?;
        sources.extend(besides.iter().map(|entry| Source::Surface(entry)));
        let of_graph = |source: &Source| match source {
            Source::Graph(texture) => Some(*texture),
            Source::Surface(_) => None,
        };
        let graph_outputs: Vec<usize> = sources.iter().filter_map(of_graph).collect();
        let needed = needed(plan, &graph_outputs);
        // What the host shows is seen from the view's own camera.
        let mut own = plan.passes.iter().filter(|pass| pass.seat == PassCamera::View);
        let host_mode = own.find_map(|pass| pass.surface).unwrap_or_default();
        Ok(Self { sources, graph_outputs, needed, host_mode })
    }

    /// Whether passes that run touch a resource.
    pub(super) fn touches(&self, plan: &Plan, node: Node) -> bool {
        touched(plan, &self.needed, &self.graph_outputs).contains(&node)
    }

    /// Columns that are read, of those that drawing can do without.
    pub(super) fn wanted(&self) -> ColumnDemand {
        let shown = |entry: &str| {
            self.sources.iter().any(|s| matches!(s, Source::Surface(shown) if *shown == entry))
        };
        ColumnDemand {
            color: self.needed.members.albedo || shown("albedo_only"),
            ao: self.needed.members.ao || shown("ao_only"),
            material: self.needed.looks.values().any(|look| look.material),
            fields: (self.needed.looks.values())
                .any(|look| look.surfaces.contains(&SurfaceMode::Fields))
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
    pub(super) fn run(self) -> Result<FrameResult, RenderError> {
        let OutputRequest { sources, graph_outputs, needed, host_mode } = self.asked;
        let mut recorder = Recorder::new(self.gpu);
        self.surfaces.make_room(needed.looks.len(), self.request.view.size_px);
        let mut running = self.plan.passes.iter().zip(&needed.passes);
        let environment = match running.any(|(pass, runs)| *runs && pass.environment) {
            true => Some(self.environments.bind(self.gpu, self.request.environment.as_ref())?),
            false => None,
        };
        let mut views = BTreeMap::new();
        for (seat, request) in looked_from(self.plan, &needed, self.data, self.request)? {
            let computes = self.drawing.computes(self.gpu, request.view.size_px);
            // Cameras of the graph's own have their pixels where they had them, and see what light is reflected by.
            let is_own = seat == PassCamera::View;
            let shift_px = if is_own { self.shift_px } else { Vec2::ZERO };
            let tints_backs = self.tints_backs && is_own;
            let drawn_as = DrawnAs { computes, tints_backs, bounds_round: is_own };
            let prepared = PreparedView::new(self.gpu, &request, self.clouds, drawn_as, shift_px)?;
            let own = &self.request.view;
            let mut view = PassView::new(self.gpu, request, own, prepared, self.clouds, shift_px);
            view.environment = environment.as_ref();
            let sources: &[Source] = if seat == PassCamera::View { &sources } else { &[] };
            let mut parts = parts(&needed.look(seat), sources, host_mode);
            let is_masked = self.own.is_some() && seat == PassCamera::View;
            parts.object |= is_masked && !shaded_modes(self.plan, &needed).is_empty();
            if parts != SurfaceParts::default() {
                recorder.seen_from = label_of(self.plan, seat);
                let made =
                    self.surfaces.ensure(parts, &view.input(), &mut recorder, self.pipelines);
                view.surface = Some(made.map_err(RenderError::Host)?);
                recorder.seen_from = None;
            }
            if let (Some(own), PassCamera::View) = (self.own, seat) {
                for mode in shaded_modes(self.plan, &needed) {
                    view.mask(mode, own, &mut recorder, self.pipelines)?;
                }
            }
            views.insert(seat, view);
        }
        let host = views.iter().map(|(seat, view)| (*seat, view as &dyn HostResources)).collect();
        let nodes = touched(self.plan, &needed, &graph_outputs);
        let resources = self.resources.lend(self.gpu, self.plan, &nodes, &self.lending);
        let frame = Frame { data: self.data, host: &host, splats: self.splats };
        let written = execute(
            self.plan,
            &needed,
            &resources,
            &frame,
            &mut recorder,
            self.pipelines,
            self.scratch,
        )?;
        let own = views.get(&PassCamera::View);
        let mut pending: Vec<Pending> = Vec::new();
        for source in &sources {
            let (texture, covered) = match source {
                Source::Graph(index) => (
                    resources.textures[*index].clone(),
                    written.covered.get(index).map(Arc::as_ref),
                ),
                Source::Surface(entry) => {
                    let shown = show_surface(entry, own, host_mode, &mut recorder, self.pipelines)?;
                    (Some(shown), None)
                }
            };
            let texture =
                texture.ok_or_else(|| RenderError::Graph("an output was not made".to_owned()))?;
            pending.push(copy(self.gpu, &mut recorder.encoder, &texture, covered));
        }
        recorder.end_stage("read-back: copy");
        let passes = recorder.submit().map_err(RenderError::Device)?;
        let read = pending.into_iter().map(|pending| pending.finish(self.gpu));
        let mut read = read.collect::<Result<Vec<_>, String>>().map_err(RenderError::Device)?;
        self.gpu.stages.end("read-back: floats");
        let of_host = read.split_off(read.len().min(self.request.outputs.len()));
        let images = self.request.outputs.iter().cloned().zip(read).collect();
        let graph_bytes = resources.bytes();
        Ok(FrameResult { images, of_host, passes, graph_bytes, resources, written })
    }
}

/// What passes that look from one camera are given.
struct PassView<'a> {
    request: RenderRequest<'a>,
    prepared: PreparedView,
    view_uniform: wgpu::Buffer,
    lights_uniform: wgpu::Buffer,
    clouds: &'a [DrawnCloud<'a>],
    surface: Option<Surface>,
    /// The surface of own clouds, by mode, where a graph shades no other.
    masked: Vec<(SurfaceMode, wgpu::TextureView)>,
    environment: Option<&'a Bound>,
}

impl<'a> PassView<'a> {
    fn new(
        gpu: &Gpu,
        request: RenderRequest<'a>,
        own: &View,
        prepared: PreparedView,
        clouds: &'a [DrawnCloud<'a>],
        shift_px: Vec2,
    ) -> Self {
        let seen = view_uniform(&request, &prepared.drawn, shift_px);
        let view_uniform = uniform(gpu, "view", &seen.into_bytes());
        let lights = lights_uniform(&request, own, &prepared.drawn);
        let lights_uniform = uniform(gpu, "lights", &lights.into_bytes());
        Self {
            request,
            prepared,
            view_uniform,
            lights_uniform,
            clouds,
            surface: None,
            masked: Vec::new(),
            environment: None,
        }
    }

    /// Leaves of the surface what belongs to some clouds.
    fn mask(
        &mut self,
        mode: SurfaceMode,
        own: &[u32],
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<(), RenderError> {
        let Some(surface) = &self.surface else { return Ok(()) };
        if let Some((packed, objects)) = surface.packed(mode).zip(surface.object.as_ref()) {
            self.masked.push((mode, masked(packed, objects, own, recorder, pipelines)?));
        }
        Ok(())
    }

    fn input(&self) -> SurfaceInput<'_> {
        self.prepared.input(&self.request, self.clouds)
    }
}

impl HostResources for PassView<'_> {
    fn resource(
        &self,
        binding: HostBinding,
        surface: Option<SurfaceMode>,
    ) -> Option<wgpu::BindingResource<'_>> {
        let texture = wgpu::BindingResource::TextureView;
        match binding {
            HostBinding::View => Some(self.view_uniform.as_entire_binding()),
            HostBinding::Lights => Some(self.lights_uniform.as_entire_binding()),
            HostBinding::Environment => Some(self.environment?.uniform.as_entire_binding()),
            HostBinding::EnvironmentMap => Some(texture(&self.environment?.map)),
            HostBinding::EnvironmentSampler => {
                Some(wgpu::BindingResource::Sampler(&self.environment?.sampler))
            }
            HostBinding::Surface => {
                let own = self.masked.iter().find(|(mode, _)| Some(*mode) == surface);
                match own {
                    Some((_, own)) => Some(texture(own)),
                    None => self.whole_surface(surface),
                }
            }
            HostBinding::Material => Some(texture(self.surface.as_ref()?.material.as_ref()?)),
            HostBinding::Object => Some(texture(self.surface.as_ref()?.object.as_ref()?)),
            // The passes of a graph share it, whatever they look from.
            HostBinding::Spent => None,
        }
    }

    fn whole_surface(&self, mode: Option<SurfaceMode>) -> Option<wgpu::BindingResource<'_>> {
        Some(wgpu::BindingResource::TextureView(self.surface.as_ref()?.packed(mode?)?))
    }

    fn covered(&self) -> Option<&Arc<Coverage>> {
        self.surface.as_ref()?.covered.as_ref()
    }

    fn view(&self) -> &View {
        &self.request.view
    }

    fn unit(&self) -> f64 {
        self.prepared.drawn.unit
    }

    fn shade_surfels(
        &self,
        shading: &SurfelShading<'_>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<wgpu::TextureView, RenderError> {
        let missing = || RenderError::Host("the nearest surfels were not found".to_owned());
        let surface = self.surface.as_ref().ok_or_else(missing)?;
        lit_surface(&self.input(), surface, shading, recorder, pipelines)
            .map_err(|message| RenderError::pass(shading.name, message))
    }
}

/// What is asked of each camera that passes look from, and of the view's own last: what was drawn last
/// is what is told about.
///
/// # Errors
/// Where a frame's data hold no such camera.
fn looked_from<'a>(
    plan: &Plan,
    needed: &LivePasses,
    data: &[u8],
    request: &RenderRequest<'a>,
) -> Result<Vec<(PassCamera, RenderRequest<'a>)>, RenderError> {
    let cameras = needed.looks.keys().filter_map(|seat| match seat {
        PassCamera::View => None,
        PassCamera::Camera(i) => plan.structure.cameras.get(*i).map(|camera| (*seat, camera)),
    });
    let mut asked = cameras
        .map(|(seat, camera)| match camera.view(data) {
            Some(view) => Ok((seat, RenderRequest { view, ..*request })),
            None => Err(RenderError::Graph(format!(
                "camera `{}` has numbers that no camera has: all must be finite, angle, height and near \
                 plane above 0",
                camera.label
            ))),
        })
        .collect::<Result<Vec<_>, _>>()?;
    asked.push((PassCamera::View, *request));
    Ok(asked)
}

/// The modes of surfaces that passes shade which look from the view's own camera: splats are only hidden by them.
fn shaded_modes(plan: &Plan, needed: &LivePasses) -> Vec<SurfaceMode> {
    let mut modes = Vec::new();
    let all = plan.structure.passes.iter().zip(&plan.passes).zip(&needed.passes);
    for ((pass, planned), runs) in all {
        let shades = *runs && planned.seat == PassCamera::View;
        let of_splats = matches!(pass.work, Work::Splats(_));
        if let Some(mode) = planned.surface.filter(|_| shades && !of_splats)
            && !modes.contains(&mode)
        {
            modes.push(mode);
        }
    }
    modes
}

/// What a camera of the graph is called.
fn label_of(plan: &Plan, seat: PassCamera) -> Option<String> {
    match seat {
        PassCamera::View => None,
        PassCamera::Camera(i) => plan.structure.cameras.get(i).map(|camera| camera.label.clone()),
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
fn parts(look: &SurfaceNeeds, sources: &[Source], host_mode: SurfaceMode) -> SurfaceParts {
    let mut parts = SurfaceParts::default();
    for &mode in &look.surfaces {
        parts.add(mode);
    }
    parts.visibility |= look.surfels;
    if look.material {
        parts.visibility = true;
        parts.material = true;
    }
    if look.object {
        parts.visibility = true;
        parts.object = true;
    }
    for source in sources {
        match source {
            Source::Surface(entry @ ("depth_only" | "owner_only")) => {
                parts.visibility = true;
                parts.winners = true;
                parts.object |= *entry == "owner_only";
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
    view: Option<&PassView<'_>>,
    mode: SurfaceMode,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<wgpu::Texture, RenderError> {
    let gpu = recorder.gpu;
    let missing = || RenderError::Host("the surface was not made".to_owned());
    let of_camera = view.ok_or_else(missing)?;
    let surface = of_camera.surface.as_ref().ok_or_else(missing)?;
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
        _ if HostBinding::of(name) == Some(HostBinding::Surface) => {
            of_camera.whole_surface(Some(mode))
        }
        _ if HostBinding::of(name).is_some() => {
            of_camera.resource(HostBinding::of(name)?, Some(mode))
        }
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
