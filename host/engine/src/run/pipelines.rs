//! Pipelines by content: equal shaders, constants and formats are compiled once.

use super::RenderError;
use crate::shader::{Binding, BindingKind, Composed, Library, on_large_stack, reflect};
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;
use surfelshop_api::graph::Module;

/// How many things were compiled since the engine was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct CompileCounts {
    /// Shader texts composed and checked.
    pub modules: u32,
    /// Pipelines made.
    pub pipelines: u32,
}

/// A shader text, checked, with the module on the device.
pub(crate) struct Shader {
    pub(crate) composed: Composed,
    module: wgpu::ShaderModule,
    /// Distinguishes shaders in pipeline keys.
    serial: u64,
}

/// A pipeline and what it wants bound, in the order of the layout.
pub(crate) struct Pipeline {
    pub(crate) stage: Stage,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) bindings: Vec<Binding>,
}

pub(crate) enum Stage {
    Render(wgpu::RenderPipeline),
    Compute(wgpu::ComputePipeline),
}

/// What a draw does with depth and with what is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum DrawKind {
    /// One triangle over the whole target.
    Fullscreen,
    /// The same with a depth of its own, over whatever is there.
    SeededSurfels,
    /// Surfel quads; nearest wins, depth is written.
    NearestSurfels,
    /// Surfel quads added up where they pass the depth test.
    AddedSurfels,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct RenderKey {
    vertex: (u64, String),
    fragment: (u64, String),
    constants: Vec<(String, u64)>,
    formats: Vec<wgpu::TextureFormat>,
    kind: DrawKind,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct ComputeKey {
    shader: (u64, String),
    constants: Vec<(String, u64)>,
}

/// A fragment stage to be drawn.
pub(crate) struct Draw<'a> {
    pub(crate) label: &'a str,
    pub(crate) vertex: (&'a Shader, &'a str),
    pub(crate) fragment: (&'a Shader, &'a str),
    pub(crate) constants: &'a BTreeMap<String, f64>,
    pub(crate) formats: &'a [wgpu::TextureFormat],
    pub(crate) kind: DrawKind,
}

/// A text, the modules it brings along and the names set for `#ifdef`.
type ShaderKey = (String, Vec<Module>, Vec<String>);

/// All shaders and pipelines of a device.
pub(crate) struct Pipelines {
    device: wgpu::Device,
    library: Library,
    shaders: HashMap<ShaderKey, Result<Rc<Shader>, String>>,
    render: HashMap<RenderKey, Rc<Pipeline>>,
    compute: HashMap<ComputeKey, Rc<Pipeline>>,
    pub(crate) counts: CompileCounts,
}

impl Pipelines {
    pub(crate) fn new(device: wgpu::Device) -> Result<Self, RenderError> {
        let library = Library::new().map_err(|error| RenderError::Host(error.message))?;
        Ok(Self {
            device,
            library,
            shaders: HashMap::new(),
            render: HashMap::new(),
            compute: HashMap::new(),
            counts: CompileCounts::default(),
        })
    }

    /// The checked shader of this text; the same text is composed once, mistakes included.
    pub(crate) fn shader(&mut self, source: &str, defines: &[&str]) -> Result<Rc<Shader>, String> {
        self.shader_with(source, &[], defines)
    }

    /// The same of a text that brings modules along.
    pub(crate) fn shader_with(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Rc<Shader>, String> {
        let defined = defines.iter().map(|name| (*name).to_owned()).collect();
        let key = (source.to_owned(), modules.to_vec(), defined);
        if let Some(known) = self.shaders.get(&key) {
            return known.clone();
        }
        self.counts.modules += 1;
        let made = self.make_shader(source, modules, defines).map(Rc::new);
        self.shaders.insert(key, made.clone());
        made
    }

    fn make_shader(
        &mut self,
        source: &str,
        modules: &[Module],
        defines: &[&str],
    ) -> Result<Shader, String> {
        let serial = u64::from(self.counts.modules);
        let (library, device) = (&mut self.library, &self.device);
        on_large_stack(|| {
            let composed = library.compose(source, modules, defines);
            let composed = composed.map_err(|error| error.message)?;
            let module = checked(device, || {
                device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: None,
                    source: wgpu::ShaderSource::Naga(Cow::Owned(composed.module.clone())),
                })
            })?;
            Ok(Shader { composed, module, serial })
        })?
    }

    /// The pipeline of a draw.
    pub(crate) fn draw(&mut self, draw: &Draw<'_>) -> Result<Rc<Pipeline>, String> {
        let key = RenderKey {
            vertex: (draw.vertex.0.serial, draw.vertex.1.to_owned()),
            fragment: (draw.fragment.0.serial, draw.fragment.1.to_owned()),
            constants: bits_of(draw.constants),
            formats: draw.formats.to_vec(),
            kind: draw.kind,
        };
        if let Some(known) = self.render.get(&key) {
            return Ok(known.clone());
        }
        let made = Rc::new(on_large_stack(|| make_draw(&self.device, draw))??);
        self.counts.pipelines += 1;
        self.render.insert(key, made.clone());
        Ok(made)
    }

    /// The pipeline of a compute entry point.
    pub(crate) fn compute(
        &mut self,
        label: &str,
        shader: &Shader,
        entry: &str,
        constants: &BTreeMap<String, f64>,
    ) -> Result<Rc<Pipeline>, String> {
        let key =
            ComputeKey { shader: (shader.serial, entry.to_owned()), constants: bits_of(constants) };
        if let Some(known) = self.compute.get(&key) {
            return Ok(known.clone());
        }
        let point = reflect(&shader.composed, naga::ShaderStage::Compute, entry)
            .map_err(|error| error.message)?;
        let layout = layout(&self.device, label, &point.bindings, wgpu::ShaderStages::COMPUTE);
        let pipeline_layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pairs = borrowed(constants);
        let device = &self.device;
        let create = || {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(label),
                layout: Some(&pipeline_layout),
                module: &shader.module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &pairs,
                    ..Default::default()
                },
                cache: None,
            })
        };
        let stage = on_large_stack(|| checked(device, create))??;
        self.counts.pipelines += 1;
        let made =
            Rc::new(Pipeline { stage: Stage::Compute(stage), layout, bindings: point.bindings });
        self.compute.insert(key, made.clone());
        Ok(made)
    }
}

fn make_draw(device: &wgpu::Device, draw: &Draw<'_>) -> Result<Pipeline, String> {
    let same_module = draw.vertex.0.serial == draw.fragment.0.serial;
    let vertex = reflect(&draw.vertex.0.composed, naga::ShaderStage::Vertex, draw.vertex.1)
        .map_err(|error| error.message)?;
    let fragment = reflect(&draw.fragment.0.composed, naga::ShaderStage::Fragment, draw.fragment.1)
        .map_err(|error| error.message)?;
    if !same_module && !vertex.bindings.is_empty() {
        return Err("a vertex stage of another module cannot have bindings".to_owned());
    }
    let mut bindings = vertex.bindings;
    for binding in fragment.bindings {
        if !bindings.contains(&binding) {
            bindings.push(binding);
        }
    }
    let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let layout = layout(device, draw.label, &bindings, visibility);
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(draw.label),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let constants = borrowed(draw.constants);
    let options = wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
    let blend = (draw.kind == DrawKind::AddedSurfels).then_some(ADD);
    let targets: Vec<_> = draw
        .formats
        .iter()
        .map(|&format| {
            Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })
        })
        .collect();
    let stage = checked(device, || {
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(draw.label),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &draw.vertex.0.module,
                entry_point: Some(draw.vertex.1),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState {
                topology: match draw.kind {
                    DrawKind::Fullscreen | DrawKind::SeededSurfels => {
                        wgpu::PrimitiveTopology::TriangleList
                    }
                    _ => wgpu::PrimitiveTopology::TriangleStrip,
                },
                ..Default::default()
            },
            depth_stencil: depth_state(draw.kind),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &draw.fragment.0.module,
                entry_point: Some(draw.fragment.1),
                compilation_options: options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    })?;
    Ok(Pipeline { stage: Stage::Render(stage), layout, bindings })
}

fn layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[Binding],
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    // Float textures are bound as filterable where a sampler is there to filter them.
    let filterable = bindings.iter().any(|b| matches!(b.kind, BindingKind::Sampler { .. }));
    let entries: Vec<_> = bindings
        .iter()
        .map(|binding| wgpu::BindGroupLayoutEntry {
            binding: binding.number,
            // Writable storage is only allowed behind the vertex stage.
            visibility: if binding.kind.writes() {
                visibility - wgpu::ShaderStages::VERTEX
            } else {
                visibility
            },
            ty: binding.kind.layout(filterable),
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

const ADD: wgpu::BlendState = {
    let component = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: component, alpha: component }
};

fn depth_state(kind: DrawKind) -> Option<wgpu::DepthStencilState> {
    let (compare, write) = match kind {
        DrawKind::Fullscreen => return None,
        DrawKind::SeededSurfels => (wgpu::CompareFunction::Always, true),
        DrawKind::NearestSurfels => (wgpu::CompareFunction::Greater, true),
        DrawKind::AddedSurfels => (wgpu::CompareFunction::GreaterEqual, false),
    };
    Some(wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(write),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    })
}

fn bits_of(constants: &BTreeMap<String, f64>) -> Vec<(String, u64)> {
    constants.iter().map(|(name, value)| (name.clone(), value.to_bits())).collect()
}

fn borrowed(constants: &BTreeMap<String, f64>) -> Vec<(&str, f64)> {
    constants.iter().map(|(name, value)| (name.as_str(), *value)).collect()
}

/// Runs something that reports its failure through the device's error scopes.
pub(crate) fn checked<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T, String> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    let errors = [
        pollster::block_on(validation.pop()),
        pollster::block_on(internal.pop()),
        pollster::block_on(memory.pop()),
    ];
    match errors.into_iter().flatten().next() {
        None => Ok(made),
        Some(error) => Err(one_line(&error)),
    }
}

/// A driver's report as one line, outermost context first.
fn one_line(error: &wgpu::Error) -> String {
    let mut parts = Vec::new();
    let mut cause: Option<&dyn std::error::Error> = Some(error);
    while let Some(inner) = cause {
        let text = inner.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
        if !parts.iter().any(|part: &String| part.contains(&text)) {
            parts.push(text);
        }
        cause = inner.source();
    }
    parts.join(": ")
}
