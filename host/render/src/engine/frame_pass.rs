//! One frame's commands: which passes, over which surface, into which pictures.

use crate::engine::RenderRequest;
use crate::engine::output_request::{DEPTH_ONLY, OutputRequest, Source, parts};
use crate::engine::prepared_view::{DrawnAs, PreparedView, lights_uniform, uniform, view_uniform};
use crate::engine::several::masked;
use crate::environment_map::{Bound, Environments};
use crate::gpu::Gpu;
use crate::graph::{
    Frame, FrameResources, HostBinding, HostResources, Lending, LivePasses, PassCamera, PassReport,
    PassScratch, Pending, Pipelines, Plan, Recorder, RenderError, Resources, Settings,
    SplatDrawing, Stage, SurfelShading, Written, bind, copy, execute, touched,
};
use crate::surfels::{
    DrawnCloud, RESOLVE, Surface, SurfaceInput, SurfaceParts, Surfaces, SurfelDrawing, lit_surface,
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

/// Where the picture of an output is when a frame has been drawn.
enum OutputImage {
    OnDevice(Pending),
    OnHost(Arc<Image>),
}

impl OutputImage {
    /// The picture, once the device is done with it.
    fn finish(self, gpu: &Gpu) -> Result<Image, String> {
        match self {
            Self::OnDevice(pending) => pending.finish(gpu),
            Self::OnHost(image) => Ok(Image::clone(&image)),
        }
    }
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
        let mut pictures: Vec<OutputImage> = Vec::new();
        for source in &sources {
            pictures.push(match source {
                Source::Graph(index) => {
                    let missing = || RenderError::Graph("an output was not made".to_owned());
                    let texture = resources.textures[*index].as_ref().ok_or_else(missing)?;
                    let covered = written.covered.get(index).map(Arc::as_ref);
                    OutputImage::OnDevice(copy(self.gpu, &mut recorder.encoder, texture, covered))
                }
                Source::Surface(entry) => {
                    show_surface(entry, own, host_mode, &mut recorder, self.pipelines)?
                }
            });
        }
        recorder.end_stage("read-back: copy");
        let passes = recorder.submit().map_err(RenderError::Device)?;
        let read = pictures.into_iter().map(|picture| picture.finish(self.gpu));
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

/// One of the surface's values as a picture: the device draws it, unless the CPU knows it.
fn show_surface(
    entry: &str,
    view: Option<&PassView<'_>>,
    mode: SurfaceMode,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<OutputImage, RenderError> {
    let gpu = recorder.gpu;
    let missing = || RenderError::Host("the surface was not made".to_owned());
    let of_camera = view.ok_or_else(missing)?;
    let surface = of_camera.surface.as_ref().ok_or_else(missing)?;
    if let (DEPTH_ONLY, Some(distances)) = (entry, &surface.distances) {
        return Ok(OutputImage::OnHost(distances.clone()));
    }
    let size = surface.size();
    let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(entry),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: match entry {
            DEPTH_ONLY => wgpu::TextureFormat::R32Float,
            _ => wgpu::TextureFormat::Rgba32Float,
        },
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
        "nearest" => surface.winners.as_ref().map(wgpu::BindingResource::TextureView),
        "picture" | "distances" => Some(wgpu::BindingResource::TextureView(&view)),
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
    Ok(OutputImage::OnDevice(copy(gpu, &mut recorder.encoder, &target, None)))
}
