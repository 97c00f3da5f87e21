//! A graph's structure, checked and with its shaders reflected; made once per structure.

use super::RenderError;
use super::pipelines::{Draw, DrawKind, Pipeline, Pipelines, Shader};
use crate::gpu::Gpu;
use crate::shader::{Binding, BindingKind, reflect};
use std::cell::OnceCell;
use std::rc::Rc;
use surfelshop_api::graph::{
    Extent, Format, Lifetime, Pass, Resource, Structure, SurfaceMode, Target, TextureId, Work,
};

pub(crate) const HOST_VIEW: &str = "surfelshop::view::view";
pub(crate) const HOST_LIGHTS: &str = "surfelshop::light::lights";
pub(crate) const HOST_SURFACE: &str = "surfelshop::surface::surface_packed";
pub(crate) const HOST_MATERIAL: &str = "surfelshop::surface::surface_material";

/// Most bytes of one texture or buffer of a graph.
const MAX_RESOURCE_BYTES: u64 = 1 << 30;
/// Most bytes of all textures and buffers of a graph.
const MAX_GRAPH_BYTES: u64 = 4 << 30;
/// Most workgroups per direction that WebGPU promises.
const MAX_GROUPS: u32 = 65_535;

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

    fn check_resources(&self, limits: &wgpu::Limits) -> Result<(), RenderError> {
        let mut total = 0u64;
        for (i, texture) in self.structure.textures.iter().enumerate() {
            let refuse = |what: String| {
                Err(RenderError::Graph(format!("texture `{}` {what}", texture.label)))
            };
            let [w, h, d] = self.extent(i);
            let largest = if texture.volume {
                limits.max_texture_dimension_3d
            } else {
                limits.max_texture_dimension_2d
            };
            if w == 0 || h == 0 || d == 0 {
                return refuse(format!("is {w} x {h} x {d}; each must be at least 1"));
            }
            if w.max(h) > largest || d > largest.max(limits.max_texture_array_layers) {
                return refuse(format!("is {w} x {h} x {d}; the device allows {largest}"));
            }
            if texture.mips == 0 || texture.mips > 32 - w.max(h).leading_zeros() {
                return refuse(format!("of {w} x {h} cannot have {} mip levels", texture.mips));
            }
            let texels = u64::from(w) * u64::from(h) * u64::from(d);
            let bytes = texels.saturating_mul(u64::from(texture.format.bytes_per_texel()));
            if bytes > MAX_RESOURCE_BYTES {
                return refuse(format!(
                    "has {bytes} bytes; at most {MAX_RESOURCE_BYTES} are given"
                ));
            }
            total = total.saturating_add(bytes);
        }
        for buffer in &self.structure.buffers {
            let most = limits.max_storage_buffer_binding_size.min(MAX_RESOURCE_BYTES);
            if buffer.size < 4 || buffer.size > most {
                return Err(RenderError::Graph(format!(
                    "buffer `{}` has {} bytes; 4 to {most} are allowed",
                    buffer.label, buffer.size
                )));
            }
            total = total.saturating_add(buffer.size);
        }
        if total > MAX_GRAPH_BYTES {
            return Err(RenderError::Graph(format!(
                "its textures and buffers have {total} bytes; at most {MAX_GRAPH_BYTES} are given"
            )));
        }
        Ok(())
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
            Work::Shading { surface, target } => {
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

    /// Names that the pass mentions and the shader does not have.
    fn check_names(&self, pass: &Pass, shader: &Shader) -> Result<(), String> {
        let module = &shader.composed.module;
        let variables: Vec<&str> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| variable.name.as_deref())
            .filter(|name| !name.starts_with("surfelshop::"))
            .collect();
        for name in pass.bindings.keys() {
            if !variables.contains(&name.as_str()) {
                return Err(format!(
                    "nothing in the shader is called `{name}`; its variables are: {}",
                    list(&variables)
                ));
            }
        }
        let constants: Vec<&str> =
            module.overrides.iter().filter_map(|(_, constant)| constant.name.as_deref()).collect();
        for name in pass.constants.keys() {
            if !constants.contains(&name.as_str()) {
                return Err(format!(
                    "the shader has no override constant `{name}`; it has: {}",
                    list(&constants)
                ));
            }
        }
        Ok(())
    }

    fn check_binding(
        &self,
        pass: &Pass,
        binding: &Binding,
        surface: SurfaceMode,
        planned: &mut Planned,
    ) -> Result<(), String> {
        match binding.name.as_str() {
            HOST_VIEW | HOST_LIGHTS | SHADING_TARGET => return Ok(()),
            HOST_SURFACE => {
                planned.surface = Some(surface);
                return Ok(());
            }
            HOST_MATERIAL => {
                planned.material = true;
                return Ok(());
            }
            _ => {}
        }
        let name = &binding.name;
        let Some(resource) = pass.bindings.get(name) else {
            return Err(format!("`{name}` ({}) is not bound", binding.kind.describe()));
        };
        let node = self.check_resource(name, &binding.kind, resource)?;
        if let Some(node) = node {
            if binding.kind.writes() {
                planned.writes.push(node);
                // What a storage resource held before may be part of what it holds after.
                planned.reads.push(node);
            } else {
                planned.reads.push(node);
            }
        }
        Ok(())
    }

    /// Whether a resource fits a variable; its node, where passes can depend on it.
    fn check_resource(
        &self,
        name: &str,
        kind: &BindingKind,
        resource: &Resource,
    ) -> Result<Option<Node>, String> {
        let unknown = |what: &str| format!("`{name}` is bound to {what} the graph does not have");
        let wrong =
            |found: &str| format!("`{name}` is {} in the shader, {found} given", kind.describe());
        match (*resource, kind) {
            (Resource::Uniform(id), BindingKind::Uniform { size }) => {
                let span = self.structure.uniforms.get(id.index());
                let given = span.ok_or_else(|| unknown("a uniform"))?.len;
                if given != *size {
                    return Err(format!("`{name}` is {size} bytes in the shader, {given} given"));
                }
                Ok(None)
            }
            (Resource::Buffer(id), BindingKind::Storage { min_size, .. }) => {
                let buffer = self.structure.buffers.get(id.index());
                let given = buffer.ok_or_else(|| unknown("a buffer"))?.size;
                if given < *min_size {
                    return Err(format!(
                        "`{name}` needs at least {min_size} bytes in the shader, {given} given"
                    ));
                }
                Ok(Some(Node::Buffer(id.index())))
            }
            (Resource::Texture { id, mip }, BindingKind::Texture { sample, .. }) => {
                let texture = self.structure.textures.get(id.index());
                let texture = texture.ok_or_else(|| unknown("a texture"))?;
                if mip.is_some_and(|mip| mip >= texture.mips) {
                    return Err(format!("`{name}` is bound to a mip level the texture lacks"));
                }
                let fits = match sample {
                    wgpu::TextureSampleType::Uint => is_uint(texture.format),
                    wgpu::TextureSampleType::Depth => texture.format == Format::Depth32Float,
                    wgpu::TextureSampleType::Sint => false,
                    wgpu::TextureSampleType::Float { .. } => !is_uint(texture.format),
                };
                if !fits {
                    return Err(wrong(&format!("a texture of {:?}", texture.format)));
                }
                Ok(Some(Node::Texture(id.index())))
            }
            (Resource::Texture { id, .. }, BindingKind::StorageTexture { format, .. }) => {
                let texture = self.structure.textures.get(id.index());
                let texture = texture.ok_or_else(|| unknown("a texture"))?;
                if wgpu_format(texture.format) != *format {
                    return Err(wrong(&format!("a texture of {:?}", texture.format)));
                }
                Ok(Some(Node::Texture(id.index())))
            }
            (Resource::Sampler(_), BindingKind::Sampler { comparison: false }) => Ok(None),
            (Resource::Uniform(_), _) => Err(wrong("a uniform")),
            (Resource::Buffer(_), _) => Err(wrong("a storage buffer")),
            (Resource::Texture { .. }, _) => Err(wrong("a texture")),
            (Resource::Sampler(_), _) => Err(wrong("a sampler")),
        }
    }

    fn check_targets(&self, pass: &Pass, gpu: &Gpu, planned: &mut Planned) -> Result<(), String> {
        let targets = targets_of(pass);
        match &pass.work {
            Work::Compute { groups, .. } => {
                if let surfelshop_api::graph::Groups::Fixed(groups) = groups
                    && groups.iter().any(|n| *n > MAX_GROUPS)
                {
                    return Err(format!("{groups:?} workgroups; at most {MAX_GROUPS} each way"));
                }
                return Ok(());
            }
            _ if targets.is_empty() => return Err("it draws into no texture".to_owned()),
            _ => {}
        }
        let mut size = None;
        for target in &targets {
            let index = target.texture.index();
            let Some(texture) = self.structure.textures.get(index) else {
                return Err("it draws into a texture the graph does not have".to_owned());
            };
            let [w, h, d] = self.extent(index);
            if target.mip >= texture.mips || target.layer >= d {
                return Err(format!(
                    "texture `{}` has no mip level {} of layer {}",
                    texture.label, target.mip, target.layer
                ));
            }
            if texture.format == Format::Depth32Float {
                return Err(format!(
                    "texture `{}` holds depth and cannot be drawn into",
                    texture.label
                ));
            }
            let here = [(w >> target.mip).max(1), (h >> target.mip).max(1)];
            if size.is_some_and(|size| size != here) {
                return Err("its targets differ in size".to_owned());
            }
            size = Some(here);
            if matches!(pass.work, Work::Shading { .. }) && here != self.size {
                return Err(format!(
                    "texture `{}` is {} x {}; a shading pass draws into the view's size, {} x {}",
                    texture.label, here[0], here[1], self.size[0], self.size[1]
                ));
            }
            if !planned.computes && !gpu.draws(wgpu_format(texture.format)) {
                return Err(format!(
                    "this graphics adapter cannot draw into textures of {:?}, as `{}` is; write \
                     it from a compute pass, or use rgba16float",
                    texture.format, texture.label
                ));
            }
            let node = Node::Texture(index);
            if planned.reads.contains(&node) && texture.mips == 1 && d == 1 {
                return Err(format!("it reads and draws into texture `{}`", texture.label));
            }
            planned.writes.push(node);
        }
        Ok(())
    }

    fn check_output(&self, id: TextureId) -> Result<(), String> {
        let texture = self.structure.textures.get(id.index()).ok_or("names no texture")?;
        let [w, h, d] = self.extent(id.index());
        if [w, h] != self.size || d != 1 {
            return Err(format!(
                "is {w} x {h} x {d}; outputs have the view's size, {} x {}",
                self.size[0], self.size[1]
            ));
        }
        if texture.format == Format::Depth32Float {
            return Err("has the format depth32float; use r32float".to_owned());
        }
        Ok(())
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

/// The author's text with an entry point that calls their function for each covered pixel.
fn shading_source(pass: &Pass, format: Format, stage: naga::ShaderStage) -> Result<String, String> {
    let function = &pass.entry;
    let plain = function.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if function.is_empty() || !plain {
        return Err(format!("`{function}` is no name of a WGSL function"));
    }
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
                     let s = surfelshop_surface::surface_at(id.xy);\n\
                     var color = vec4(0.0);\n\
                     if s.covered {{ color = {function}(s); }}\n\
                     textureStore({SHADING_TARGET}, id.xy, color);\n\
                 }}\n"
            )
        }
        _ => format!(
            "@fragment\n\
             fn {SHADING_ENTRY}(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {{\n\
                 let s = surfelshop_surface::surface_at(vec2<u32>(p.xy));\n\
                 if !s.covered {{ return vec4(0.0); }}\n\
                 return {function}(s);\n\
             }}\n"
        ),
    };
    Ok(format!("{}\n#import surfelshop::surface as surfelshop_surface\n{entry}", pass.wgsl))
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn is_uint(format: Format) -> bool {
    matches!(format, Format::R32Uint | Format::Rgba32Uint)
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
