//! The rules a graph must keep; each refusal names what was expected and what was found.

use crate::gpu::Gpu;
use crate::graph::host_binding::HostBinding;
use crate::graph::pipeline_desc::Shader;
use crate::graph::plan::{Node, Plan, Planned, targets_of, wgpu_format};
use crate::graph::shading::{SHADING_TARGET, SURFEL_RADIANCE, SURFEL_RECORDS, list};
use crate::graph::splats::{SPLAT_FOOTPRINTS, SPLAT_PAYLOADS, SPLAT_RANGE};
use crate::graph::uniform_layout::UniformLayout;
use crate::shader_compiler::{Binding, BindingKind};
use naga::{Scalar, TypeInner};
use surfelshop_api::graph::{Format, Groups, Module, Pass, Resource, SurfaceMode, TextureId, Work};

/// Most workgroups per direction that WebGPU promises.
const MAX_GROUPS: u32 = 65_535;
/// Most workgroups of a pass: sixteen times those that give each pixel of the largest picture,
/// 16,384 on a side, one invocation in groups of 64.
const MAX_ALL_GROUPS: u64 = 1 << 26;

/// Variables of the entry points that the host writes around an author's function.
const OF_ENTRY_POINTS: [&str; 6] = [
    SHADING_TARGET,
    SURFEL_RECORDS,
    SURFEL_RADIANCE,
    SPLAT_FOOTPRINTS,
    SPLAT_PAYLOADS,
    SPLAT_RANGE,
];

impl Plan {
    /// Whether the camera of a pass is one of the graph's.
    pub(super) fn check_camera(&self, pass: &Pass) -> Result<(), String> {
        let n_cameras = self.structure.cameras.len();
        match pass.camera {
            Some(camera) if camera.index() >= n_cameras => {
                let number = camera.index();
                Err(format!("it looks from camera {number}; the graph has {n_cameras} of them"))
            }
            _ => Ok(()),
        }
    }

    /// Names that the pass mentions and the shader does not have.
    pub(super) fn check_names(&self, pass: &Pass, shader: &Shader) -> Result<(), String> {
        let module = &shader.composed.module;
        let variables: Vec<&str> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| variable.name.as_deref())
            .filter(|name| HostBinding::of(name).is_none())
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
        for name in pass.constants.keys().chain(pass.features.keys()) {
            if !constants.contains(&name.as_str()) {
                return Err(format!(
                    "the shader has no override constant `{name}`; it has: {}",
                    list(&constants)
                ));
            }
        }
        for name in pass.features.keys() {
            if pass.constants.contains_key(name) {
                return Err(format!("`{name}` is set as a constant and as a feature; set it once"));
            }
            let mut overrides = module.overrides.iter().map(|(_, constant)| constant);
            let is_bool = overrides.any(|constant| {
                let ty = &module.types[constant.ty].inner;
                constant.name.as_ref() == Some(name) && *ty == TypeInner::Scalar(Scalar::BOOL)
            });
            if !is_bool {
                return Err(format!(
                    "the feature `{name}` is no `override` of type `bool`; a number is a constant"
                ));
            }
        }
        Ok(())
    }

    pub(super) fn check_binding(
        &self,
        pass: &Pass,
        binding: &Binding,
        surface: SurfaceMode,
        gpu: &Gpu,
        planned: &mut Planned,
    ) -> Result<(), String> {
        let given = HostBinding::of(&binding.name);
        if given == Some(HostBinding::Spent) {
            return Ok(());
        }
        if let Some(given) = given {
            planned.of_host.get_or_insert_with(|| binding.name.clone());
            match given {
                HostBinding::View | HostBinding::Lights | HostBinding::Spent => {}
                HostBinding::Environment
                | HostBinding::EnvironmentMap
                | HostBinding::EnvironmentSampler => planned.environment = true,
                HostBinding::Surface => planned.surface = Some(surface),
                HostBinding::Material => planned.material = true,
                HostBinding::Object => planned.object = true,
            }
            return Ok(());
        }
        if OF_ENTRY_POINTS.contains(&binding.name.as_str()) {
            return Ok(());
        }
        let name = &binding.name;
        let Some(resource) = pass.bindings.get(name) else {
            // A module's file is what its author knows.
            let of = |module: &&Module| {
                name.strip_prefix(module.path.as_str()).is_some_and(|rest| rest.starts_with("::"))
            };
            let file = pass.modules.iter().find(of).map(|module| format!("{}: ", module.file));
            let (file, kind) = (file.unwrap_or_default(), binding.kind.describe());
            return Err(format!("{file}`{name}` ({kind}) is not bound"));
        };
        if let BindingKind::StorageTexture { dimension: wgpu::TextureViewDimension::D3, .. } =
            binding.kind
            && !gpu.stores_into_volumes()
        {
            return Err(format!(
                "`{name}` stores into a volume, which OpenGL cannot do here; use Vulkan, Metal or \
                 Direct3D, or do without"
            ));
        }
        if let (Resource::Uniform(id), BindingKind::Uniform { size }) = (*resource, binding.kind)
            && id.index() < self.structure.uniforms.len()
            && let Some(given) = self.structure.members.get(&(id.index() as u32))
        {
            let layout = UniformLayout::new(id.index(), given, &binding.members, size);
            let layout = layout.map_err(|message| format!("`{name}`: {message}"))?;
            planned.layouts.insert(name.clone(), layout);
            return Ok(());
        }
        check_stored(name, &binding.kind, gpu)?;
        let node = self.check_resource(name, &binding.kind, resource)?;
        if let Some(node) = node {
            let used_already = planned.writes.contains(&node)
                || (binding.kind.writes() && planned.reads.contains(&node));
            if used_already {
                return Err(format!("`{name}` stores into what the pass reads by another name"));
            }
            if binding.kind.writes() {
                self.check_written(name, node)?;
                planned.writes.push(node);
                // What a storage resource held before may be part of what it holds after.
                planned.reads.push(node);
            } else {
                planned.reads.push(node);
            }
        }
        Ok(())
    }

    /// Whether a pass may write a resource.
    fn check_written(&self, name: &str, node: Node) -> Result<(), String> {
        let Node::Buffer(i) = node else { return Ok(()) };
        let buffer = &self.structure.buffers[i];
        let holds = match buffer {
            _ if buffer.surfels.is_some() => "the scene's surfels",
            _ if buffer.columns.is_some() => "columns of clouds",
            _ if buffer.resident.is_some() => "resident bytes",
            _ => return Ok(()),
        };
        Err(format!("`{name}` holds {holds} and is only read"))
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
            (Resource::Texture { id, mip }, BindingKind::Texture { sample, dimension }) => {
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
                self.check_dimension(name, id, *dimension)?;
                Ok(Some(Node::Texture(id.index())))
            }
            (
                Resource::Texture { id, mip },
                BindingKind::StorageTexture { format, dimension, .. },
            ) => {
                let texture = self.structure.textures.get(id.index());
                let texture = texture.ok_or_else(|| unknown("a texture"))?;
                if wgpu_format(texture.format) != *format {
                    return Err(wrong(&format!("a texture of {:?}", texture.format)));
                }
                if mip.unwrap_or(0) >= texture.mips || (mip.is_none() && texture.mips > 1) {
                    return Err(format!(
                        "`{name}` stores into one mip level; the texture has {}, {} bound",
                        texture.mips,
                        mip.map_or("all".to_owned(), |mip| format!("number {mip}"))
                    ));
                }
                self.check_dimension(name, id, *dimension)?;
                Ok(Some(Node::Texture(id.index())))
            }
            (Resource::Sampler(_), BindingKind::Sampler { comparison: false }) => Ok(None),
            (Resource::Uniform(_), _) => Err(wrong("a uniform")),
            (Resource::Buffer(_), _) => Err(wrong("a storage buffer")),
            (Resource::Texture { .. }, _) => Err(wrong("a texture")),
            (Resource::Sampler(_), _) => Err(wrong("a sampler")),
        }
    }

    /// Whether a texture has the shape a variable declares.
    fn check_dimension(
        &self,
        name: &str,
        id: TextureId,
        declared: wgpu::TextureViewDimension,
    ) -> Result<(), String> {
        let texture = &self.structure.textures[id.index()];
        let found = match (texture.volume, self.extent(id.index())[2]) {
            (true, _) => wgpu::TextureViewDimension::D3,
            (false, 1) => wgpu::TextureViewDimension::D2,
            (false, _) => wgpu::TextureViewDimension::D2Array,
        };
        if found == declared {
            return Ok(());
        }
        Err(format!("`{name}` is {declared:?} in the shader, a texture of {found:?} given"))
    }

    pub(super) fn check_targets(
        &self,
        pass: &Pass,
        gpu: &Gpu,
        planned: &mut Planned,
    ) -> Result<(), String> {
        let targets = targets_of(pass);
        match &pass.work {
            Work::Compute { groups, .. } => {
                if let Groups::Counted { buffer, offset, at_most } = groups {
                    return self.check_counted((*buffer, *offset), *at_most, gpu, planned);
                }
                if let Groups::Fixed(groups) = groups {
                    let all = groups.iter().fold(1u64, |n, g| n.saturating_mul(u64::from(*g)));
                    if groups.iter().any(|n| *n > MAX_GROUPS) || all > MAX_ALL_GROUPS {
                        return Err(format!(
                            "{groups:?} workgroups; at most {MAX_GROUPS} each way and \
                             {MAX_ALL_GROUPS} in all"
                        ));
                    }
                }
                return Ok(());
            }
            Work::Splats(splats) => return self.check_splats(pass, splats, planned),
            Work::Sort(_) | Work::Scan(_) => return Ok(()),
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
            let seen = self.size_of(pass);
            if matches!(pass.work, Work::Shading { .. }) && here != seen {
                let whose = if pass.camera.is_some() { "its camera" } else { "the view" };
                return Err(format!(
                    "texture `{}` is {} x {}; a shading pass draws into {whose}'s size, {} x {}",
                    texture.label, here[0], here[1], seen[0], seen[1]
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

    pub(super) fn check_output(&self, id: TextureId) -> Result<(), String> {
        let texture = self.structure.textures.get(id.index()).ok_or("names no texture")?;
        let [w, h, d] = self.extent(id.index());
        let size = self.made_for.size;
        if [w, h] != size || d != 1 {
            return Err(format!(
                "is {w} x {h} x {d}; outputs have the view's size, {} x {}",
                size[0], size[1]
            ));
        }
        if texture.format == Format::Depth32Float {
            return Err("has the format depth32float; use r32float".to_owned());
        }
        Ok(())
    }
}

/// Whether the device lets a texture be stored into, and read, as a variable says.
fn check_stored(name: &str, kind: &BindingKind, gpu: &Gpu) -> Result<(), String> {
    let BindingKind::StorageTexture { format, access, .. } = *kind else { return Ok(()) };
    if gpu.stores(format, access) {
        return Ok(());
    }
    let how = match access {
        wgpu::StorageTextureAccess::ReadWrite => "read and stored into",
        wgpu::StorageTextureAccess::ReadOnly => "read as storage",
        _ => "stored into",
    };
    Err(format!(
        "`{name}` is {}, which this device does not let be {how}; r32float and r32uint can be both, others read as \
         a texture in another pass",
        kind.describe()
    ))
}

fn is_uint(format: Format) -> bool {
    matches!(format, Format::R32Uint | Format::Rgba32Uint)
}
