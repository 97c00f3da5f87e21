//! One frame from request to pictures.

use crate::gpu::Gpu;
use crate::run::{
    CompileCounts, Frame, HOST_SURFACE, HOST_VIEW, Image, PassReport, Pending, Pipelines, Plan,
    Recorder, RenderError, Resources, Stage, bind, checked, copy, execute, needed, touched,
};
use crate::surfels::{
    Columns, DrawnCloud, RESOLVE, Surface, SurfaceCounts, SurfaceInput, SurfaceParts, Surfaces,
};
use glam::{DVec3, Mat4, Vec2, Vec4};
use std::collections::BTreeMap;
use surfelshop_api::abi::host_side::{EncodedGraph, Fault, Instance};
use surfelshop_api::graph::{Output, Structure, SurfaceMode};
use surfelshop_api::params::Values;
use surfelshop_api::{
    CloudFacts, CloudView, FrameRequest, Light, Projection, Scene, Uniform, View,
};
use wgpu::util::DeviceExt as _;

/// How an engine works; the defaults fit everything but tests.
#[derive(Clone, Copy, Debug)]
pub struct EngineOptions {
    /// Most surfels in one chunk; fewer where the device's bindings are smaller.
    pub chunk_surfels: u32,
}

impl Default for EngineOptions {
    fn default() -> Self {
        Self { chunk_surfels: 1 << 20 }
    }
}

/// What the engine did since it was made; tests and reports read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Shaders and pipelines compiled.
    pub compiled: CompileCounts,
    /// Parts of surface buffers made.
    pub surfaces: SurfaceCounts,
    /// Structures decoded and checked.
    pub plans: u32,
    /// Columns uploaded.
    pub uploads: u32,
    /// Bytes of columns on the device now.
    pub column_bytes: u64,
}

/// A frame to be rendered.
#[derive(Clone, Copy)]
pub struct RenderRequest<'a> {
    /// The clouds of the scene.
    pub clouds: &'a [CloudView<'a>],
    /// Facts of the clouds.
    pub facts: &'a CloudFacts,
    /// Lights, exposure and surface settings.
    pub scene: &'a Scene,
    /// Camera, size and depth range.
    pub view: View,
    /// The renderer's parameters.
    pub values: &'a Values,
    /// The pictures wanted.
    pub outputs: &'a [Output],
    /// Frames since something in this view changed.
    pub frame_index: u32,
}

/// A rendered frame.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The requested pictures, in the order of the request.
    pub images: Vec<(Output, Image)>,
    /// The passes in the order they stand in the frame.
    pub passes: Vec<PassReport>,
    /// Whether the renderer says that another frame would refine the picture.
    pub wants_another_frame: bool,
}

impl Rendered {
    /// The picture of an output, where it was requested.
    #[must_use]
    pub fn image(&self, output: &Output) -> Option<&Image> {
        self.images.iter().find(|(other, _)| other == output).map(|(_, image)| image)
    }
}

/// A renderer in a view: its instance and the plan of its last structure.
pub struct RendererView {
    instance: Instance,
    scope: String,
    structure: Vec<u8>,
    plan: Option<Plan>,
}

impl RendererView {
    /// Puts an instance of a renderer into a view; `scope` keeps the persistent resources of
    /// different renderers apart and is usually package and unit id.
    #[must_use]
    pub fn new(instance: Instance, scope: impl Into<String>) -> Self {
        Self { instance, scope: scope.into(), structure: Vec::new(), plan: None }
    }
}

/// The device side: columns, pipelines, surfaces and resources of all views.
pub struct Engine {
    gpu: Gpu,
    pipelines: Pipelines,
    columns: Columns,
    surfaces: Surfaces,
    resources: Resources,
    plans: u32,
}

impl Engine {
    /// An engine on a device.
    ///
    /// # Errors
    /// Where a shader module of the host is broken.
    pub fn new(gpu: Gpu, options: &EngineOptions) -> Result<Self, RenderError> {
        Ok(Self {
            pipelines: Pipelines::new(gpu.device.clone())?,
            columns: Columns::new(gpu.device.clone(), options.chunk_surfels),
            surfaces: Surfaces::default(),
            resources: Resources::default(),
            plans: 0,
            gpu,
        })
    }

    /// The device.
    #[must_use]
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What was done so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        Counters {
            compiled: self.pipelines.counts,
            surfaces: self.surfaces.counts,
            plans: self.plans,
            uploads: self.columns.uploads,
            column_bytes: self.columns.bytes(),
        }
    }

    /// Has a renderer describe a frame and runs it.
    ///
    /// # Errors
    /// Where the plugin fails, its graph breaks a rule, a cloud cannot be drawn, or the device
    /// fails. The engine can be used on.
    pub fn render(
        &mut self,
        renderer: &mut RendererView,
        request: &RenderRequest<'_>,
    ) -> Result<Rendered, RenderError> {
        self.check_size(request.view.size_px)?;
        let encoded = renderer
            .instance
            .frame(&FrameRequest {
                view: request.view,
                scene: request.scene.clone(),
                cloud: request.facts.clone(),
                frame_index: request.frame_index,
                values: request.values.clone(),
            })
            .map_err(RenderError::Plugin)?;
        self.replan(renderer, &encoded, request.view.size_px)?;
        let Some(plan) = &renderer.plan else {
            return Err(RenderError::Graph("there is none".to_owned()));
        };
        self.columns.next_frame();
        self.resources.next_frame();
        let clouds = request
            .clouds
            .iter()
            .map(|cloud| self.columns.cloud(cloud))
            .collect::<Result<Vec<_>, _>>()?;
        let device = self.gpu.device.clone();
        let work = Submission {
            gpu: &self.gpu,
            pipelines: &mut self.pipelines,
            surfaces: &mut self.surfaces,
            resources: &mut self.resources,
            plan,
            scope: &renderer.scope,
            data: &encoded.data,
            request,
            clouds: &clouds,
        };
        let rendered = checked(&device, || work.run())
            .map_err(RenderError::Device)
            .and_then(|rendered| rendered);
        if rendered.is_err() {
            self.surfaces.clear();
        }
        rendered
    }

    fn check_size(&self, size: [u32; 2]) -> Result<(), RenderError> {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        if size.iter().any(|&side| side == 0 || side > most) {
            return Err(RenderError::Device(format!(
                "a picture of {} x {} was asked for; each side must be 1 to {most}",
                size[0], size[1]
            )));
        }
        Ok(())
    }

    /// Decodes and checks the structure, unless it is the one planned last.
    fn replan(
        &mut self,
        renderer: &mut RendererView,
        encoded: &EncodedGraph,
        size: [u32; 2],
    ) -> Result<(), RenderError> {
        let known = renderer.plan.as_ref().is_some_and(|plan| plan.size == size)
            && renderer.structure == encoded.structure;
        if known {
            return Ok(());
        }
        renderer.plan = None;
        let structure: Structure = rmp_serde::from_slice(&encoded.structure).map_err(|error| {
            RenderError::Plugin(Fault::Misbehaved(format!("its graph is unreadable: {error}")))
        })?;
        self.plans += 1;
        renderer.plan = Some(Plan::new(structure, size, &self.gpu, &mut self.pipelines)?);
        renderer.structure.clone_from(&encoded.structure);
        Ok(())
    }
}

/// Everything one frame's commands are made from.
struct Submission<'a> {
    gpu: &'a Gpu,
    pipelines: &'a mut Pipelines,
    surfaces: &'a mut Surfaces,
    resources: &'a mut Resources,
    plan: &'a Plan,
    scope: &'a str,
    data: &'a [u8],
    request: &'a RenderRequest<'a>,
    clouds: &'a [DrawnCloud],
}

/// Where a requested output comes from.
enum Source {
    /// A texture of the graph.
    Graph(usize),
    /// The host's surface buffer, through an entry point of the resolve shader.
    Surface(&'static str),
}

impl Submission<'_> {
    fn run(self) -> Result<Rendered, RenderError> {
        let sources = self.sources()?;
        let graph_outputs: Vec<usize> = sources
            .iter()
            .filter_map(|source| match source {
                Source::Graph(texture) => Some(*texture),
                Source::Surface(_) => None,
            })
            .collect();
        let needed = needed(self.plan, &graph_outputs);
        let host_mode = self.plan.passes.iter().find_map(|p| p.surface).unwrap_or_default();
        let mut parts = SurfaceParts::default();
        for &mode in &needed.surfaces {
            parts.add(mode);
        }
        if needed.material {
            parts.visibility = true;
            parts.material = true;
        }
        for source in &sources {
            match source {
                Source::Surface("depth_only") => parts.visibility = true,
                Source::Surface(_) => parts.add(host_mode),
                Source::Graph(_) => {}
            }
        }
        let drawn_view = drawn_view(self.request, self.clouds);
        let view_uniform = uniform(self.gpu, "view", view_uniform(self.request, &drawn_view));
        let lights_uniform = uniform(self.gpu, "lights", lights_uniform(self.request));
        let mut recorder = Recorder::new(self.gpu);
        let input = SurfaceInput {
            clouds: self.clouds,
            settings: &self.request.scene.surface,
            view_uniform: &view_uniform,
            view_from_offset: &|origin| self.request.view.view_from_offset(origin).as_mat4(),
            size: self.request.view.size_px,
            key: surface_key(self.request, self.clouds)?,
        };
        let surface = if parts == SurfaceParts::default() {
            None
        } else {
            let made = self.surfaces.ensure(parts, &input, &mut recorder, self.pipelines);
            Some(made.map_err(RenderError::Host)?)
        };
        let nodes = touched(self.plan, &needed, &graph_outputs);
        let lent = self.resources.lend(self.gpu, self.plan, &nodes, self.scope);
        let frame = Frame {
            data: self.data,
            view_uniform: &view_uniform,
            lights_uniform: &lights_uniform,
            surface,
        };
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
        self.resources.give_back(lent, &written);
        let images = pending
            .into_iter()
            .zip(self.request.outputs)
            .map(|(pending, output)| Ok((output.clone(), pending.finish(self.gpu)?)))
            .collect::<Result<Vec<_>, String>>()
            .map_err(RenderError::Device)?;
        let wants_another_frame = self.plan.structure.wants_another_frame;
        Ok(Rendered { images, passes, wants_another_frame })
    }

    /// Where each requested output comes from.
    fn sources(&self) -> Result<Vec<Source>, RenderError> {
        let offered = &self.plan.structure.outputs;
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
                    let names: Vec<_> = offered.iter().map(|(output, _)| output.name()).collect();
                    Err(RenderError::NoOutput {
                        wanted: wanted.name(),
                        offered: if names.is_empty() { "none".into() } else { names.join(", ") },
                    })
                }
            }
        };
        self.request.outputs.iter().map(source).collect()
    }
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
    let pipeline =
        pipelines.compute(&name, &shader, entry, &BTreeMap::new()).map_err(RenderError::Host)?;
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

fn uniform(gpu: &Gpu, label: &str, uniform: Uniform) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: &uniform.into_bytes(),
        usage: wgpu::BufferUsages::UNIFORM,
    })
}

/// The view as it is drawn: its near plane lies before the requested one, so that the depth
/// tolerance has room there (`MAX_PULL` of the surfel shaders).
fn drawn_view(request: &RenderRequest<'_>, clouds: &[DrawnCloud]) -> View {
    let mut view = request.view;
    match view.camera.projection {
        Projection::Perspective { .. } => view.near *= 0.5,
        Projection::Orthographic { .. } => {
            let settings = &request.scene.surface;
            let reach = clouds.iter().fold(0.0f32, |most, cloud| most.max(cloud.max_radius));
            let slack = settings.depth_tolerance * settings.radius_scale * reach;
            view.near -= f64::from(slack);
        }
    }
    view
}

/// The bytes of `surfelshop::view::View`.
fn view_uniform(request: &RenderRequest<'_>, drawn: &View) -> Uniform {
    let view = &request.view;
    let origin = request.clouds.first().map_or(DVec3::ZERO, |cloud| cloud.origin);
    let world_from_view = view.camera.view_from_world().transpose();
    let eye = (view.camera.eye - origin).as_vec3();
    let [half_x, half_y] = view.half_extent();
    let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
    Uniform::new()
        .mat4(drawn.clip_from_view())
        .mat4(Mat4::from_mat3_translation(world_from_view.as_mat3(), eye))
        .vec2(Vec2::new(half_x as f32, half_y as f32))
        .vec2(Vec2::new(view.size_px[0] as f32, view.size_px[1] as f32))
        .f32(view.near as f32)
        .f32(view.far as f32)
        .u32(u32::from(orthographic))
        .u32(request.frame_index)
}

/// The bytes of `surfelshop::light::Lights`; a light's two vectors take 16 bytes each.
fn lights_uniform(request: &RenderRequest<'_>) -> Uniform {
    let world_from_view = request.view.camera.view_from_world().transpose();
    let lights = request.scene.lights.iter().take(Scene::MAX_LIGHTS);
    let mut uniform = Uniform::new();
    let mut count = 0;
    for light in lights {
        let Light::Directional { towards, radiance, follows_camera } = *light;
        let world = if follows_camera { world_from_view * towards } else { towards };
        let towards = world.try_normalize().unwrap_or(DVec3::Y).as_vec3();
        uniform = uniform.vec4(towards.extend(0.0)).vec4(radiance.extend(0.0));
        count += 1;
    }
    for _ in count..Scene::MAX_LIGHTS {
        uniform = uniform.vec4(Vec4::ZERO).vec4(Vec4::ZERO);
    }
    uniform.u32(count as u32)
}

/// Equal bytes mean an equal surface: clouds, camera, size and surface settings.
fn surface_key(request: &RenderRequest<'_>, clouds: &[DrawnCloud]) -> Result<Vec<u8>, RenderError> {
    let clouds: Vec<_> =
        clouds.iter().map(|c| (c.origin, c.n_surfels, c.chunk_len, &c.generations)).collect();
    rmp_serde::to_vec(&(&request.view, &request.scene.surface, clouds))
        .map_err(|error| RenderError::Host(error.to_string()))
}
