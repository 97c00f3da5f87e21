//! A graph's structure, checked and with its shaders reflected; made once per structure.

use super::RenderError;
use super::pipelines::{Draw, DrawKind, Pipeline, Pipelines, Shader};
use crate::gpu::Gpu;
use crate::shader::reflect;
use std::cell::OnceCell;
use std::rc::Rc;
use surfelshop_api::graph::{Extent, Format, Lifetime, Pass, Structure, SurfaceMode, Target, Work};

pub(crate) const HOST_VIEW: &str = "surfelshop::view::view";
pub(crate) const HOST_LIGHTS: &str = "surfelshop::light::lights";
pub(crate) const HOST_ENVIRONMENT: &str = "surfelshop::environment::environment";
pub(crate) const HOST_ENVIRONMENT_MAP: &str = "surfelshop::environment::environment_map";
pub(crate) const HOST_ENVIRONMENT_SAMPLER: &str = "surfelshop::environment::environment_sampler";
pub(crate) const HOST_SURFACE: &str = "surfelshop::surface::surface_packed";
pub(crate) const HOST_MATERIAL: &str = "surfelshop::surface::surface_material";

/// A resource as passes depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Node {
    Texture(usize),
    Buffer(usize),
}

/// A pass that may run.
pub(crate) struct Planned {
    pub(crate) shader: Rc<Shader>,
    /// The entry point; the host's wrapper for shading functions.
    pub(crate) entry: String,
    pub(crate) reads: Vec<Node>,
    pub(crate) writes: Vec<Node>,
    /// The surface it reads, where it reads one.
    pub(crate) surface: Option<SurfaceMode>,
    /// Whether it reads materials.
    pub(crate) material: bool,
    /// Whether it reads the environment.
    pub(crate) environment: bool,
    pub(crate) workgroup_size: [u32; 3],
    /// Whether it runs as a compute pass: compute passes, and shading passes on devices that
    /// cannot draw into the target's format.
    pub(crate) computes: bool,
    pipeline: OnceCell<Rc<Pipeline>>,
}

/// A checked graph.
pub(crate) struct Plan {
    pub(crate) structure: Structure,
    pub(crate) passes: Vec<Planned>,
    /// Size of the view it was checked for.
    pub(crate) size: [u32; 2],
}

/// The entry point generated around shading functions.
const SHADING_ENTRY: &str = "surfelshop_shade";
/// The texture that the entry point stores into where it is a compute one.
pub(crate) const SHADING_TARGET: &str = "surfelshop_target";

impl Plan {
    /// Checks a structure for a view of this size.
    ///
    /// # Errors
    /// The first rule it breaks, with pass and variable.
    pub(crate) fn new(
        structure: Structure,
        size: [u32; 2],
        gpu: &Gpu,
        pipelines: &mut Pipelines,
    ) -> Result<Self, RenderError> {
        let mut plan = Self { structure, passes: Vec::new(), size };
        plan.check_resources(&gpu.device.limits())?;
        for i in 0..plan.structure.passes.len() {
            let pass = &plan.structure.passes[i];
            let planned = plan
                .plan_pass(pass, gpu, pipelines)
                .map_err(|message| RenderError::pass(&pass.name, message))?;
            plan.passes.push(planned);
        }
        for (output, texture) in &plan.structure.outputs {
            plan.check_output(*texture)
                .map_err(|what| RenderError::Graph(format!("output `{}` {what}", output.name())))?;
        }
        Ok(plan)
    }

    /// Width, height and slices of a texture for this view.
    pub(crate) fn extent(&self, texture: usize) -> [u32; 3] {
        match self.structure.textures[texture].extent {
            Extent::Fixed(size) => size,
            Extent::View { divisor } => {
                let d = divisor.max(1);
                [self.size[0].div_ceil(d), self.size[1].div_ceil(d), 1]
            }
        }
    }

    fn plan_pass(
        &self,
        pass: &Pass,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
    ) -> Result<Planned, String> {
        let mut stage = naga::ShaderStage::Fragment;
        let (source, entry, surface) = match &pass.work {
            Work::Shading { surface, target, .. } => {
                let texture = self.structure.textures.get(target.index());
                let format = texture.map_or(Format::Rgba32Float, |texture| texture.format);
                if !gpu.draws(wgpu_format(format)) {
                    stage = naga::ShaderStage::Compute;
                }
                (shading_source(pass, format, stage)?, SHADING_ENTRY.to_owned(), *surface)
            }
            Work::Fullscreen { surface, .. } => (pass.wgsl.clone(), pass.entry.clone(), *surface),
            Work::Compute { surface, .. } => {
                stage = naga::ShaderStage::Compute;
                (pass.wgsl.clone(), pass.entry.clone(), *surface)
            }
        };
        let shader = pipelines.shader(&source, &[])?;
        let point = reflect(&shader.composed, stage, &entry).map_err(|error| error.message)?;
        self.check_names(pass, &shader)?;
        let mut planned = Planned {
            shader,
            entry,
            reads: Vec::new(),
            writes: Vec::new(),
            surface: None,
            material: false,
            environment: false,
            workgroup_size: point.workgroup_size,
            computes: stage == naga::ShaderStage::Compute,
            pipeline: OnceCell::new(),
        };
        for binding in &point.bindings {
            self.check_binding(pass, binding, surface, &mut planned)?;
        }
        self.check_targets(pass, gpu, &mut planned)?;
        Ok(planned)
    }

    /// The pipeline of a pass, compiled when first needed.
    pub(crate) fn pipeline(
        &self,
        index: usize,
        pipelines: &mut Pipelines,
    ) -> Result<Rc<Pipeline>, RenderError> {
        let (pass, planned) = (&self.structure.passes[index], &self.passes[index]);
        if let Some(known) = planned.pipeline.get() {
            return Ok(known.clone());
        }
        let made = match planned.computes {
            true => pipelines.compute(&pass.name, &planned.shader, &planned.entry, &pass.constants),
            false => {
                let formats: Vec<_> = targets_of(pass)
                    .iter()
                    .map(|t| wgpu_format(self.structure.textures[t.texture.index()].format))
                    .collect();
                pipelines.shader(crate::surfels::RESOLVE, &[]).and_then(|screen| {
                    pipelines.draw(&Draw {
                        label: &pass.name,
                        vertex: (&screen, "cover_screen"),
                        fragment: (&planned.shader, &planned.entry),
                        constants: &pass.constants,
                        formats: &formats,
                        kind: DrawKind::Fullscreen,
                    })
                })
            }
        };
        let made = made.map_err(|message| RenderError::pass(&pass.name, message))?;
        Ok(planned.pipeline.get_or_init(|| made).clone())
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

/// The textures a pass draws into.
pub(crate) fn targets_of(pass: &Pass) -> Vec<Target> {
    match &pass.work {
        Work::Shading { target, .. } => vec![(*target).into()],
        Work::Fullscreen { targets, .. } => targets.clone(),
        Work::Compute { .. } => Vec::new(),
    }
}

/// The words that follow `fn` in a shader, comments included; enough to find a misspelt name.
fn functions_of(wgsl: &str) -> impl Iterator<Item = &str> {
    let mut words = wgsl.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    std::iter::from_fn(move || {
        words.find(|word| *word == "fn")?;
        words.find(|word| !word.is_empty())
    })
}

/// The author's text with an entry point that calls their function for each covered pixel.
fn shading_source(pass: &Pass, format: Format, stage: naga::ShaderStage) -> Result<String, String> {
    let function = &pass.entry;
    check_function(pass, function)?;
    let elsewhere = match &pass.work {
        Work::Shading { elsewhere: Some(elsewhere), .. } => {
            check_function(pass, elsewhere)?;
            format!("{elsewhere}(vec2<u32>(s.pixel))")
        }
        _ => "vec4(0.0)".to_owned(),
    };
    // Two more loads are for those who want them.
    let variance = match pass.wgsl.contains("normal_variance") {
        true => "s.normal_variance = surfelshop_surface::normal_variance_at(s);",
        false => "",
    };
    let entry = match stage {
        naga::ShaderStage::Compute => {
            let texel = match format {
                Format::Rgba8Unorm => "rgba8unorm",
                Format::Rgba16Float => "rgba16float",
                Format::R32Float => "r32float",
                Format::Rg32Float => "rg32float",
                Format::Rgba32Float => "rgba32float",
                Format::R32Uint | Format::Rgba32Uint | Format::Depth32Float => {
                    return Err(format!("a shading pass cannot write {format:?}"));
                }
            };
            format!(
                "var {SHADING_TARGET}: texture_storage_2d<{texel}, write>;\n\
                 @compute @workgroup_size(8, 8)\n\
                 fn {SHADING_ENTRY}(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
                     if any(id.xy >= textureDimensions({SHADING_TARGET})) {{ return; }}\n\
                     var s = surfelshop_surface::surface_at(id.xy);\n\
                     {variance}\n\
                     var color = vec4(0.0);\n\
                     if s.covered {{ color = {function}(s); }} else {{ color = {elsewhere}; }}\n\
                     textureStore({SHADING_TARGET}, id.xy, color);\n\
                 }}\n"
            )
        }
        _ => format!(
            "@fragment\n\
             fn {SHADING_ENTRY}(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {{\n\
                 var s = surfelshop_surface::surface_at(vec2<u32>(p.xy));\n\
                 {variance}\n\
                 if !s.covered {{ return {elsewhere}; }}\n\
                 return {function}(s);\n\
             }}\n"
        ),
    };
    Ok(format!("{}\n#import surfelshop::surface as surfelshop_surface\n{entry}", pass.wgsl))
}

fn check_function(pass: &Pass, function: &str) -> Result<(), String> {
    let plain = function.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if function.is_empty() || !plain {
        return Err(format!("`{function}` is no name of a WGSL function"));
    }
    let functions: Vec<&str> = functions_of(&pass.wgsl).collect();
    if functions.contains(&function) {
        return Ok(());
    }
    let list = super::check::list(&functions);
    Err(format!("the shader has no function `{function}`; it has: {list}"))
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
