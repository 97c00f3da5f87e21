//! Checks, compiles, culls, runs and times graphs.

mod alternatives;
mod background;
mod check;
mod execute;
mod host_binding;
mod limits;
mod live_passes;
mod pipeline_desc;
mod pipelines;
mod plan;
mod primitives;
mod readback;
mod recorder;
mod resources;
mod shading;
mod splats;
mod uniform_layout;
mod variants;

pub(crate) use execute::{Frame, execute, touched};
pub(crate) use host_binding::{HostBinding, HostResources, SceneLights, SurfelShading};
pub(crate) use limits::{MAX_GRAPH_BYTES, MAX_RESOURCE_BYTES, confines};
pub(crate) use live_passes::{LivePasses, SurfaceNeeds, Written, needed};
pub(crate) use pipeline_desc::{DrawKind, Pipeline, Stage, checked};
pub use pipelines::CompileCounts;
pub(crate) use pipelines::{Draw, Pipelines};
pub(crate) use plan::{MadeFor, Node, PassCamera, Plan};
pub(crate) use primitives::PassScratch;
pub(crate) use readback::{Pending, copy, copy_buffer, map};
pub(crate) use recorder::{Attachment, Recorder};
pub use recorder::{PassReport, PassState};
pub(crate) use resources::{BufferPart, FrameResources, Lending, Resources, texels, texture_bytes};
pub(crate) use splats::SplatDrawing;
pub(crate) use variants::Settings;

use thiserror::Error;

/// Why a frame could not be rendered.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RenderError {
    /// The plugin failed while it described the frame.
    #[error("{0}")]
    Plugin(surfelshop_runtime::boundary::Fault),
    /// The graph breaks a rule.
    #[error("graph: {0}")]
    Graph(String),
    /// A pass of the graph cannot run.
    #[error("pass `{pass}`: {message}")]
    Pass {
        /// The pass's name.
        pass: String,
        /// What is wrong, naming the variable where one is concerned.
        message: String,
    },
    /// An output was asked for that the renderer does not offer.
    #[error("the renderer offers no output `{wanted}`; it offers {offered}")]
    NoOutput {
        /// The output asked for.
        wanted: String,
        /// The outputs there are.
        offered: String,
    },
    /// No cloud has the columns that the renderer reads.
    #[error("{0}")]
    Needs(String),
    /// A cloud cannot be drawn.
    #[error("the cloud cannot be drawn: {0}")]
    Cloud(String),
    /// The light around the scene cannot be used.
    #[error("the environment cannot be used: {0}")]
    Environment(String),
    /// The device failed.
    #[error("graphics device: {0}")]
    Device(String),
    /// The device is lost: every frame fails until there is a new engine on a new device.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    /// The device was at work on a sandboxed plugin's graph for longer than it may be.
    #[error("{message}")]
    Overran {
        /// How long it may be.
        limit: std::time::Duration,
        /// What was running.
        message: String,
    },
    /// Somebody wanted no more of the frame, which was left.
    #[error("the picture was not wanted any more")]
    Stopped,
    /// One of the host's own shaders failed.
    #[error("internal shader: {0}")]
    Host(String),
}

impl RenderError {
    pub(crate) fn pass(pass: &str, message: impl Into<String>) -> Self {
        Self::Pass { pass: pass.to_owned(), message: message.into() }
    }
}

/// Binds a pipeline's variables by name.
///
/// # Errors
/// Where `find` knows no resource for a variable.
pub(crate) fn bind<'a>(
    gpu: &crate::gpu::Gpu,
    pipeline: &Pipeline,
    mut find: impl FnMut(&str) -> Option<wgpu::BindingResource<'a>>,
) -> Result<wgpu::BindGroup, String> {
    let entries = pipeline
        .bindings
        .iter()
        .map(|binding| {
            let resource = find(&binding.name)
                .ok_or_else(|| format!("variable `{}` is not bound", binding.name))?;
            Ok(wgpu::BindGroupEntry { binding: binding.number, resource })
        })
        .collect::<Result<Vec<_>, String>>()?;
    Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.layout,
        entries: &entries,
    }))
}
