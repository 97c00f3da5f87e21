//! What an entry point needs bound, by variable name.

use crate::shader_compiler::compose::{Composed, ShaderError};
use naga::{AddressSpace, ImageClass, ImageDimension, StorageAccess, TypeInner};

/// One entry point and the resources it uses.
#[derive(Clone, Debug)]
pub(crate) struct EntryPoint {
    pub(crate) bindings: Vec<Binding>,
    pub(crate) workgroup_size: [u32; 3],
}

/// One resource variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Binding {
    /// Name as written; `module::name` for the host's modules.
    pub(crate) name: String,
    /// Number in group 0.
    pub(crate) number: u32,
    pub(crate) kind: BindingKind,
    /// Members of a uniform that is a structure.
    pub(crate) members: Vec<UniformMember>,
}

/// A member of a uniform's structure.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct UniformMember {
    pub(crate) name: String,
    /// The type as WGSL writes it; of types that are neither numbers, vectors nor matrices, something that
    /// no type is called.
    pub(crate) kind: String,
    /// Bytes from the start of the structure.
    pub(crate) offset: usize,
}

/// What a variable is bound to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BindingKind {
    /// A uniform of this many bytes.
    Uniform { size: u64 },
    /// A storage buffer with at least this many bytes.
    Storage { writable: bool, min_size: u64 },
    /// A texture that is read.
    Texture { sample: wgpu::TextureSampleType, dimension: wgpu::TextureViewDimension },
    /// A texture that is written.
    StorageTexture {
        format: wgpu::TextureFormat,
        access: wgpu::StorageTextureAccess,
        dimension: wgpu::TextureViewDimension,
    },
    /// A sampler.
    Sampler { comparison: bool },
}

impl BindingKind {
    /// Whether a pass with this binding changes the resource.
    pub(crate) fn writes(&self) -> bool {
        matches!(self, Self::Storage { writable: true, .. } | Self::StorageTexture { .. })
    }

    /// What the variable wants, for messages.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Uniform { size } => format!("a uniform of {size} bytes"),
            Self::Storage { writable: true, .. } => "a writable storage buffer".to_owned(),
            Self::Storage { .. } => "a storage buffer".to_owned(),
            Self::Texture { sample, .. } => match sample {
                wgpu::TextureSampleType::Float { .. } => "a texture of floats".to_owned(),
                wgpu::TextureSampleType::Depth => "a depth texture".to_owned(),
                wgpu::TextureSampleType::Sint | wgpu::TextureSampleType::Uint => {
                    "a texture of whole numbers".to_owned()
                }
            },
            Self::StorageTexture { format, .. } => format!("a storage texture of {format:?}"),
            Self::Sampler { .. } => "a sampler".to_owned(),
        }
    }

    pub(crate) fn layout(&self, filterable: bool) -> wgpu::BindingType {
        match *self {
            Self::Uniform { size } => wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: std::num::NonZeroU64::new(size),
            },
            Self::Storage { writable, .. } => wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: !writable },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            Self::Texture { sample, dimension } => wgpu::BindingType::Texture {
                sample_type: match sample {
                    wgpu::TextureSampleType::Float { .. } => {
                        wgpu::TextureSampleType::Float { filterable }
                    }
                    other => other,
                },
                view_dimension: dimension,
                multisampled: false,
            },
            Self::StorageTexture { format, access, dimension } => {
                wgpu::BindingType::StorageTexture { access, format, view_dimension: dimension }
            }
            Self::Sampler { comparison: true } => {
                wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison)
            }
            Self::Sampler { comparison: false } if filterable => {
                wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)
            }
            Self::Sampler { comparison: false } => {
                wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)
            }
        }
    }
}

/// The resources that an entry point uses, through every function it calls.
///
/// # Errors
/// Where there is no such entry point of this stage, or it uses a kind of resource that graphs
/// cannot bind.
pub(crate) fn reflect(
    composed: &Composed,
    stage: naga::ShaderStage,
    name: &str,
) -> Result<EntryPoint, ShaderError> {
    let module = &composed.module;
    let found = module.entry_points.iter().position(|e| e.stage == stage && e.name == name);
    let Some(index) = found else {
        let there: Vec<_> = module
            .entry_points
            .iter()
            .filter(|entry| entry.stage == stage)
            .map(|entry| format!("`{}`", entry.name))
            .collect();
        let there = if there.is_empty() { "none".to_owned() } else { there.join(", ") };
        return Err(ShaderError::new(format!(
            "no {stage:?} entry point is called `{name}`; there are: {there}"
        )));
    };
    let usage = composed.info.get_entry_point(index);
    let mut bindings = Vec::new();
    for (handle, variable) in module.global_variables.iter() {
        if usage[handle].is_empty() {
            continue;
        }
        if variable.space == AddressSpace::WorkGroup && stage != naga::ShaderStage::Compute {
            let name = variable.name.clone().unwrap_or_default();
            return Err(ShaderError::new(format!(
                "`{name}` is shared by a workgroup, which only compute passes have"
            )));
        }
        let Some(number) = variable.binding.map(|binding| binding.binding) else { continue };
        let name = variable.name.clone().unwrap_or_default();
        let kind = binding_kind(module, variable)
            .map_err(|what| ShaderError::new(format!("variable `{name}` is {what}")))?;
        let members = match kind {
            BindingKind::Uniform { .. } => members_of(module, variable.ty),
            _ => Vec::new(),
        };
        bindings.push(Binding { name, number, kind, members });
    }
    Ok(EntryPoint { bindings, workgroup_size: module.entry_points[index].workgroup_size })
}

/// The members of a structure; none of other types.
fn members_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> Vec<UniformMember> {
    let TypeInner::Struct { members, .. } = &module.types[ty].inner else { return Vec::new() };
    members
        .iter()
        .map(|member| UniformMember {
            name: member.name.clone().unwrap_or_default(),
            kind: type_word(&module.types[member.ty].inner),
            offset: member.offset as usize,
        })
        .collect()
}

/// A type of 32-bit numbers as WGSL writes it.
fn type_word(inner: &TypeInner) -> String {
    let scalar = |scalar: naga::Scalar| match (scalar.kind, scalar.width) {
        (naga::ScalarKind::Float, 4) => "f32",
        (naga::ScalarKind::Uint, 4) => "u32",
        (naga::ScalarKind::Sint, 4) => "i32",
        _ => "a number of another width",
    };
    match inner {
        TypeInner::Scalar(of) => scalar(*of).to_owned(),
        TypeInner::Vector { size, scalar: of } => format!("vec{}<{}>", *size as u8, scalar(*of)),
        TypeInner::Matrix { columns, rows, scalar: of } => {
            format!("mat{}x{}<{}>", *columns as u8, *rows as u8, scalar(*of))
        }
        _ => "an array or structure".to_owned(),
    }
}

fn binding_kind(
    module: &naga::Module,
    variable: &naga::GlobalVariable,
) -> Result<BindingKind, String> {
    let inner = &module.types[variable.ty].inner;
    match variable.space {
        AddressSpace::Uniform => {
            Ok(BindingKind::Uniform { size: u64::from(inner.size(module.to_ctx())) })
        }
        AddressSpace::Storage { access } => Ok(BindingKind::Storage {
            writable: access.contains(StorageAccess::STORE),
            min_size: u64::from(inner.size(module.to_ctx())),
        }),
        _ => match inner {
            TypeInner::Sampler { comparison } => {
                Ok(BindingKind::Sampler { comparison: *comparison })
            }
            TypeInner::Image { dim, arrayed, class } => image_kind(*dim, *arrayed, *class),
            _ => Err("of a type that graphs cannot bind".to_owned()),
        },
    }
}

fn image_kind(
    dim: ImageDimension,
    arrayed: bool,
    class: ImageClass,
) -> Result<BindingKind, String> {
    let dimension = match (dim, arrayed) {
        (ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
        (ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
        (ImageDimension::D3, false) => wgpu::TextureViewDimension::D3,
        _ => return Err("a one-dimensional or cube texture; use 2D, 2D array or 3D".to_owned()),
    };
    match class {
        ImageClass::Sampled { kind, multi: false } => {
            let sample = match kind {
                naga::ScalarKind::Float => wgpu::TextureSampleType::Float { filterable: false },
                naga::ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                naga::ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                _ => return Err("a texture of a kind that cannot be sampled".to_owned()),
            };
            Ok(BindingKind::Texture { sample, dimension })
        }
        ImageClass::Depth { multi: false } => {
            Ok(BindingKind::Texture { sample: wgpu::TextureSampleType::Depth, dimension })
        }
        ImageClass::Storage { format, access } => Ok(BindingKind::StorageTexture {
            format: storage_format(format)?,
            access: if access.contains(StorageAccess::LOAD) && access.contains(StorageAccess::STORE)
            {
                wgpu::StorageTextureAccess::ReadWrite
            } else if access.contains(StorageAccess::STORE) {
                wgpu::StorageTextureAccess::WriteOnly
            } else {
                wgpu::StorageTextureAccess::ReadOnly
            },
            dimension,
        }),
        _ => Err("a multisampled or external texture".to_owned()),
    }
}

fn storage_format(format: naga::StorageFormat) -> Result<wgpu::TextureFormat, String> {
    Ok(match format {
        naga::StorageFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        naga::StorageFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
        naga::StorageFormat::Rg32Float => wgpu::TextureFormat::Rg32Float,
        naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        naga::StorageFormat::R32Uint => wgpu::TextureFormat::R32Uint,
        naga::StorageFormat::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
        other => return Err(format!("a storage texture of {other:?}, which graphs do not have")),
    })
}
