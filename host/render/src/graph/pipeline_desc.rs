//! What a pipeline is made of, and making it.

use crate::graph::variants::Settings;
use crate::shader_compiler::{Binding, BindingKind, Composed, reflect};
use std::sync::Arc;

/// A shader text, checked, with the module on the device.
pub(crate) struct Shader {
    pub(crate) composed: Composed,
    pub(super) module: wgpu::ShaderModule,
    /// Distinguishes shaders in pipeline keys.
    pub(super) serial: u64,
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
    /// Quads of splats, each over those that were drawn before.
    SplatsOver,
    /// The same, added up.
    AddedSplats,
    /// The same, the last one instead of others.
    ReplacedSplats,
    /// The same with depths of their own; the nearest wins, and depth is written.
    NearestSplats,
}

/// An entry point of a shader.
pub(super) type Entry = (Arc<Shader>, String);

/// What a pipeline is made of; it can be made on any thread.
pub(super) struct Recipe {
    pub(super) label: String,
    pub(super) settings: Settings,
    pub(super) work: Work,
}

pub(super) enum Work {
    Draw { vertex: Entry, fragment: Entry, formats: Vec<wgpu::TextureFormat>, kind: DrawKind },
    Compute(Entry),
}

impl Recipe {
    /// Makes it; to be called on a large stack.
    ///
    /// # Errors
    /// Where the device refuses it.
    pub(super) fn make(&self, device: &wgpu::Device) -> Result<Pipeline, String> {
        match &self.work {
            Work::Draw { vertex, fragment, formats, kind } => {
                self.make_draw(device, [vertex, fragment], formats, *kind)
            }
            Work::Compute(entry) => self.make_compute(device, entry),
        }
    }

    /// The layouts of what is bound: what the device does not bind is told here, and not by all that is made of it.
    fn layouts(
        &self,
        device: &wgpu::Device,
        bindings: &[Binding],
        visibility: wgpu::ShaderStages,
    ) -> Result<(wgpu::BindGroupLayout, wgpu::PipelineLayout), String> {
        let layout = checked(device, || layout(device, &self.label, bindings, visibility))?;
        let of_pipeline = checked(device, || {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(&self.label),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            })
        })?;
        Ok((layout, of_pipeline))
    }

    fn make_compute(
        &self,
        device: &wgpu::Device,
        (shader, entry): &Entry,
    ) -> Result<Pipeline, String> {
        let point = reflect(&shader.composed, naga::ShaderStage::Compute, entry)
            .map_err(|error| error.message)?;
        let (layout, pipeline_layout) =
            self.layouts(device, &point.bindings, wgpu::ShaderStages::COMPUTE)?;
        let values = self.settings.values();
        let stage = checked(device, || {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&self.label),
                layout: Some(&pipeline_layout),
                module: &shader.module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &values,
                    ..Default::default()
                },
                cache: None,
            })
        })?;
        Ok(Pipeline { stage: Stage::Compute(stage), layout, bindings: point.bindings })
    }

    fn make_draw(
        &self,
        device: &wgpu::Device,
        [vertex_entry, fragment_entry]: [&Entry; 2],
        formats: &[wgpu::TextureFormat],
        kind: DrawKind,
    ) -> Result<Pipeline, String> {
        let same_module = vertex_entry.0.serial == fragment_entry.0.serial;
        let vertex = reflect(&vertex_entry.0.composed, naga::ShaderStage::Vertex, &vertex_entry.1)
            .map_err(|error| error.message)?;
        let fragment =
            reflect(&fragment_entry.0.composed, naga::ShaderStage::Fragment, &fragment_entry.1)
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
        let (layout, pipeline_layout) = self.layouts(device, &bindings, visibility)?;
        let constants = self.settings.values();
        let options =
            wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() };
        let blend = match kind {
            DrawKind::AddedSurfels | DrawKind::AddedSplats => Some(ADD),
            DrawKind::SplatsOver => Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            _ => None,
        };
        let targets: Vec<_> = formats
            .iter()
            .map(|&format| {
                Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })
            })
            .collect();
        let stage = checked(device, || {
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(&self.label),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &vertex_entry.0.module,
                    entry_point: Some(&vertex_entry.1),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState {
                    topology: match kind {
                        DrawKind::Fullscreen | DrawKind::SeededSurfels => {
                            wgpu::PrimitiveTopology::TriangleList
                        }
                        _ => wgpu::PrimitiveTopology::TriangleStrip,
                    },
                    ..Default::default()
                },
                depth_stencil: depth_state(kind),
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &fragment_entry.0.module,
                    entry_point: Some(&fragment_entry.1),
                    compilation_options: options,
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            })
        })?;
        Ok(Pipeline { stage: Stage::Render(stage), layout, bindings })
    }
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
        DrawKind::Fullscreen
        | DrawKind::SplatsOver
        | DrawKind::AddedSplats
        | DrawKind::ReplacedSplats => return None,
        DrawKind::SeededSurfels => (wgpu::CompareFunction::Always, true),
        DrawKind::NearestSurfels | DrawKind::NearestSplats => {
            (wgpu::CompareFunction::Greater, true)
        }
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
