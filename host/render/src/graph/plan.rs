//! A graph's structure, checked and with its shaders reflected; made once per structure.

use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::graph::alternatives::{Chosen, choose};
use crate::graph::host_binding::SceneLights;
use crate::graph::limits::loop_units;
use crate::graph::pipeline_desc::{DrawKind, Pipeline, Shader};
use crate::graph::pipelines::{Draw, Pipelines, ReadyPipeline};
use crate::graph::shading::{SHADING_ENTRY, SURFEL_ENTRY, pixel_source, surfel_source, unfit};
use crate::graph::splats::{COMPOSE_PER_PIXEL, SPLAT_ENTRY, check_footprint, splat_source};
use crate::graph::uniform_layout::UniformLayout;
use crate::graph::variants::Settings;
use crate::shader_compiler::{EntryPoint, SurfaceMembers, members_read, reflect};
use crate::shader_features::ShaderFeature;
use std::cell::{Cell, OnceCell};
use std::collections::BTreeMap;
use std::sync::Arc;
use surfelshop_api::graph::{Extent, Format, Lifetime, Pass, Structure, SurfaceMode, Target, Work};

/// The vertex shader of passes that cover the picture.
const COVER_SCREEN: &str = include_str!("cover_screen.wgsl");

/// A resource as passes depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Node {
    Texture(usize),
    Buffer(usize),
}

/// Where a pass looks from: the view's own camera, or one of the graph's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum PassCamera {
    #[default]
    View,
    Camera(usize),
}

impl PassCamera {
    pub(crate) fn of(pass: &Pass) -> Self {
        pass.camera.map_or(Self::View, |camera| Self::Camera(camera.index()))
    }
}

/// A pass that may run.
pub(crate) struct Planned {
    pub(crate) seat: PassCamera,
    pub(crate) shader: Arc<Shader>,
    /// The entry point; the host's wrapper for shading functions.
    pub(crate) entry: String,
    pub(crate) reads: Vec<Node>,
    pub(crate) writes: Vec<Node>,
    /// The surface it reads, where it reads one.
    pub(crate) surface: Option<SurfaceMode>,
    /// What it reads of that.
    pub(crate) members: SurfaceMembers,
    /// Whether it reads materials.
    pub(crate) material: bool,
    /// Whether it reads which cloud a pixel shows.
    pub(crate) object: bool,
    /// Whether it reads the environment.
    pub(crate) environment: bool,
    /// A variable of the host that it reads.
    pub(crate) of_host: Option<String>,
    pub(crate) workgroup_size: [u32; 3],
    /// Whether it runs as a compute pass: compute passes, and shading passes on devices that
    /// cannot draw into the target's format.
    pub(crate) computes: bool,
    /// Values of its `override` constants.
    pub(crate) settings: Settings,
    pipeline: OnceCell<Arc<Pipeline>>,
    /// Whether it was last drawn by a variant that stands in for its own.
    pub(crate) stood_in: Cell<bool>,
    /// What shades surfels one by one, where that is asked for.
    pub(crate) surfels: Option<Arc<Shader>>,
    /// What puts splats together where a function of the pass tells each pixel.
    pub(crate) per_pixel: Option<Arc<Shader>>,
    /// Uniforms that are given by name, by variable.
    pub(crate) layouts: BTreeMap<String, UniformLayout>,
    /// What it runs instead of, and why, in words.
    pub(crate) instead_of: Option<String>,
}

impl Planned {
    /// A pass of which nothing is known but its shader.
    pub(super) fn new(pass: &Pass, shader: Arc<Shader>, entry: String) -> Self {
        Self {
            seat: PassCamera::of(pass),
            shader,
            entry,
            reads: Vec::new(),
            writes: Vec::new(),
            surface: None,
            members: SurfaceMembers::default(),
            material: false,
            object: false,
            environment: false,
            of_host: None,
            workgroup_size: [1; 3],
            computes: false,
            settings: Settings::of(pass),
            pipeline: OnceCell::new(),
            stood_in: Cell::new(false),
            surfels: None,
            per_pixel: None,
            layouts: BTreeMap::new(),
            instead_of: None,
        }
    }

    /// Values of those constants that one of its shaders has.
    pub(crate) fn settings_of(&self, shader: &Shader) -> Settings {
        let overrides = &shader.composed.module.overrides;
        let known = |name: &str| overrides.iter().any(|(_, o)| o.name.as_deref() == Some(name));
        self.settings.only(known)
    }
}

/// A checked graph.
pub(crate) struct Plan {
    pub(crate) structure: Structure,
    pub(crate) passes: Vec<Planned>,
    /// What it was checked for.
    pub(crate) made_for: MadeFor,
}

/// What a plan holds for, besides the structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MadeFor {
    /// Size of the view.
    pub(crate) size: [u32; 2],
    /// Whether the graph comes from a sandboxed plugin.
    pub(crate) is_sandboxed: bool,
    /// The scene's lights.
    pub(crate) lights: SceneLights,
}

impl Plan {
    /// Whether a pass shades surfels one by one: these are the device's, which has their columns, and
    /// drawn as quads.
    pub(crate) fn shades_surfels(&self) -> bool {
        self.passes.iter().any(|pass| pass.surfels.is_some())
    }

    /// Whether every pass that looks at surfels takes merged ones.
    pub(crate) fn takes_merged_surfels(&self) -> bool {
        let mut passes = self.structure.passes.iter().zip(&self.passes);
        passes.all(|(pass, planned)| pass.merges || planned.surface.is_none())
    }
}

impl Plan {
    /// Checks a structure.
    ///
    /// # Errors
    /// The first rule it breaks, with pass and variable.
    pub(crate) fn new(
        structure: Structure,
        made_for: MadeFor,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
    ) -> Result<Self, RenderError> {
        let is_sandboxed = made_for.is_sandboxed;
        let mut plan = Self { structure, passes: Vec::new(), made_for };
        plan.check_resources(&gpu.device.limits())?;
        pipelines.loop_units = is_sandboxed.then(|| loop_units(gpu));
        let planned = plan.add_passes(gpu, pipelines);
        pipelines.loop_units = None;
        planned?;
        if is_sandboxed {
            plan.check_sandboxed(gpu)?;
        }
        Ok(plan)
    }

    /// Plans all passes.
    fn add_passes(&mut self, gpu: &Gpu, pipelines: &mut Pipelines) -> Result<(), RenderError> {
        let plan = self;
        for i in 0..plan.structure.passes.len() {
            let Chosen { pass, instead_of, others } = choose(&plan.structure.passes[i], gpu)?;
            let mut plan_one = |pass: &Pass| {
                plan.plan_pass(pass, gpu, pipelines)
                    .map_err(|message| RenderError::pass(&pass.name, message))
            };
            let planned = Planned { instead_of, ..plan_one(&pass)? };
            // They run on other devices, and their mistakes are to be seen here.
            others.iter().try_for_each(|other| plan_one(other).map(|_| ()))?;
            plan.structure.passes[i] = pass;
            plan.passes.push(planned);
        }
        for (output, texture) in &plan.structure.outputs {
            plan.check_output(*texture)
                .map_err(|what| RenderError::Graph(format!("output `{}` {what}", output.name())))?;
        }
        Ok(())
    }

    /// Width, height and slices of a texture for this view.
    pub(crate) fn extent(&self, texture: usize) -> [u32; 3] {
        match self.structure.textures[texture].extent {
            Extent::Fixed(size) => size,
            Extent::View { divisor } => {
                let (d, [width, height]) = (divisor.max(1), self.made_for.size);
                [width.div_ceil(d), height.div_ceil(d), 1]
            }
        }
    }

    /// Width and height in pixels of what a pass looks at.
    pub(crate) fn size_of(&self, pass: &Pass) -> [u32; 2] {
        let camera = match PassCamera::of(pass) {
            PassCamera::View => None,
            PassCamera::Camera(i) => self.structure.cameras.get(i),
        };
        camera.map_or(self.made_for.size, |camera| camera.size_px)
    }

    fn plan_pass(
        &self,
        pass: &Pass,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
    ) -> Result<Planned, String> {
        self.check_camera(pass)?;
        let mut stage = naga::ShaderStage::Fragment;
        let (source, entry, surface) = match &pass.work {
            Work::Shading { surface, target, .. } => {
                let texture = self.structure.textures.get(target.index());
                let format = texture.map_or(Format::Rgba32Float, |texture| texture.format);
                if !gpu.draws(wgpu_format(format)) {
                    stage = naga::ShaderStage::Compute;
                }
                (pixel_source(pass, format, stage)?, SHADING_ENTRY.to_owned(), *surface)
            }
            Work::Fullscreen { surface, .. } => (pass.wgsl.clone(), pass.entry.clone(), *surface),
            Work::Compute { surface, .. } => {
                stage = naga::ShaderStage::Compute;
                (pass.wgsl.clone(), pass.entry.clone(), *surface)
            }
            Work::Splats(splats) => {
                stage = naga::ShaderStage::Compute;
                let source = splat_source(pass, splats.targets.len())?;
                (source, SPLAT_ENTRY.to_owned(), splats.surface)
            }
            Work::Sort(_) | Work::Scan(_) => return self.plan_primitive(pass, gpu, pipelines),
        };
        let needs = defines_of(pass);
        let shader = pipelines
            .shader_with(&source, &pass.modules, &needs)
            .map_err(|message| unfit(pass, &message).unwrap_or(message))?;
        let point = reflect(&shader.composed, stage, &entry).map_err(|error| error.message)?;
        if let Work::Splats(splats) = &pass.work {
            check_footprint(splats, &shader.composed.module)?;
        }
        self.check_names(pass, &shader)?;
        let computes = stage == naga::ShaderStage::Compute;
        let EntryPoint { bindings, workgroup_size } = point;
        self.check_bound(&bindings, &gpu.device.limits())?;
        let settings = Settings::of(pass).with(&self.made_for.lights.features());
        let planned = Planned::new(pass, shader, entry);
        let mut planned = Planned { workgroup_size, computes, settings, ..planned };
        for binding in &bindings {
            self.check_binding(pass, binding, surface, gpu, &mut planned)?;
        }
        let flags = planned.settings.flags();
        planned.members = members_read(&planned.shader.composed, stage, &planned.entry, &flags);
        if matches!(pass.work, Work::Shading { per_surfel: true, .. }) {
            let shader = pipelines.shader_with(&surfel_source(pass), &pass.modules, &needs)?;
            let stage = naga::ShaderStage::Compute;
            let point =
                reflect(&shader.composed, stage, SURFEL_ENTRY).map_err(|error| error.message)?;
            for binding in &point.bindings {
                self.check_binding(pass, binding, surface, gpu, &mut planned)?;
            }
            let of_surfels = members_read(&shader.composed, stage, SURFEL_ENTRY, &flags);
            // What pixels show as albedo is then what surfels radiate, and no column.
            let ao = of_surfels.ao || planned.members.ao;
            planned.members = SurfaceMembers { ao, ..of_surfels };
            // It has a surface of its own, for which the nearest surfels must be known.
            planned.surface = None;
            planned.surfels = Some(shader);
        }
        if let Work::Splats(splats) = &pass.work {
            self.plan_per_pixel(pass, splats, gpu, pipelines, &mut planned)?;
        }
        self.check_targets(pass, gpu, &mut planned)?;
        Ok(planned)
    }

    /// The pipeline of a pass, compiled when first needed.
    pub(crate) fn pipeline(
        &self,
        index: usize,
        pipelines: &mut Pipelines,
    ) -> Result<Arc<Pipeline>, RenderError> {
        let (pass, planned) = (&self.structure.passes[index], &self.passes[index]);
        if let Some(known) = planned.pipeline.get() {
            return Ok(known.clone());
        }
        let settings = &planned.settings_of(&planned.shader);
        let made = match planned.computes {
            true => pipelines.compute(&pass.name, &planned.shader, &planned.entry, settings),
            false => {
                let formats: Vec<_> = targets_of(pass)
                    .iter()
                    .map(|t| wgpu_format(self.structure.textures[t.texture.index()].format))
                    .collect();
                pipelines.shader(COVER_SCREEN, &[]).and_then(|screen| {
                    pipelines.draw(&Draw {
                        label: &pass.name,
                        vertex: (&screen, "cover_screen"),
                        fragment: (&planned.shader, &planned.entry),
                        settings,
                        formats: &formats,
                        kind: DrawKind::Fullscreen,
                    })
                })
            }
        };
        let ReadyPipeline { pipeline, is_it } =
            made.map_err(|message| RenderError::pass(&pass.name, message))?;
        planned.stood_in.set(!is_it);
        if is_it {
            return Ok(planned.pipeline.get_or_init(|| pipeline).clone());
        }
        Ok(pipeline)
    }

    /// The pipeline that shades surfels one by one.
    pub(crate) fn surfel_pipeline(
        &self,
        index: usize,
        shader: &Arc<Shader>,
        pipelines: &mut Pipelines,
    ) -> Result<Arc<Pipeline>, RenderError> {
        self.second_pipeline(index, shader, SURFEL_ENTRY, pipelines)
    }

    /// The pipeline that puts splats together by a function of the pass; none where it has no such function.
    pub(crate) fn per_pixel_pipeline(
        &self,
        index: usize,
        pipelines: &mut Pipelines,
    ) -> Result<Option<Arc<Pipeline>>, RenderError> {
        let shader = self.passes[index].per_pixel.as_ref();
        let made = |shader| self.second_pipeline(index, shader, COMPOSE_PER_PIXEL, pipelines);
        shader.map(made).transpose()
    }

    /// A pipeline of a pass besides its own.
    fn second_pipeline(
        &self,
        index: usize,
        shader: &Arc<Shader>,
        entry: &str,
        pipelines: &mut Pipelines,
    ) -> Result<Arc<Pipeline>, RenderError> {
        let pass = &self.structure.passes[index];
        let settings = self.passes[index].settings_of(shader);
        let made = pipelines.compute(&pass.name, shader, entry, &settings);
        let ReadyPipeline { pipeline, is_it } =
            made.map_err(|message| RenderError::pass(&pass.name, message))?;
        let planned = &self.passes[index];
        planned.stood_in.set(!is_it || planned.pipeline.get().is_none());
        Ok(pipeline)
    }

    /// Whether a resource outlives the frame.
    pub(crate) fn persistent(&self, node: Node) -> bool {
        let lifetime = match node {
            Node::Texture(i) => &self.structure.textures[i].lifetime,
            Node::Buffer(i) => &self.structure.buffers[i].lifetime,
        };
        matches!(lifetime, Lifetime::Persistent { .. })
    }
}

/// The textures that the device draws into in a pass.
pub(crate) fn targets_of(pass: &Pass) -> Vec<Target> {
    match &pass.work {
        Work::Shading { target, .. } => vec![(*target).into()],
        Work::Fullscreen { targets, .. } => targets.clone(),
        Work::Compute { .. } | Work::Splats(_) | Work::Sort(_) | Work::Scan(_) => Vec::new(),
    }
}

/// The names that are set while the shader of a pass is composed, by what it needs.
pub(super) fn defines_of(pass: &Pass) -> Vec<&'static str> {
    let features = pass.needs.iter().filter_map(|word| ShaderFeature::of_word(word));
    features.map(|feature| feature.define).collect()
}

/// The device's name of a format.
pub(crate) fn wgpu_format(format: Format) -> wgpu::TextureFormat {
    match format {
        Format::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        Format::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        Format::R32Float => wgpu::TextureFormat::R32Float,
        Format::Rg32Float => wgpu::TextureFormat::Rg32Float,
        Format::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        Format::R32Uint => wgpu::TextureFormat::R32Uint,
        Format::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
        Format::Depth32Float => wgpu::TextureFormat::Depth32Float,
    }
}
