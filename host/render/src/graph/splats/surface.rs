//! How far the surface of surfels is, pixel by pixel: what splats are hidden by.

use crate::graph::bind;
use crate::graph::execute::Variables;
use crate::graph::host_binding::HostBinding;
use crate::graph::pipeline_desc::Stage;
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::PassScratch;
use crate::graph::recorder::Recorder;
use crate::graph::variants::Settings;

const SURFACE_DEPTHS: &str = include_str!("surface_depths.wgsl");

/// Distances of the surface along the viewing axis, in units of drawing, by pixel; 0 where nothing is.
///
/// # Errors
/// Where the pipeline cannot be made or bound.
pub(super) fn depths(
    variables: &Variables<'_>,
    size: [u32; 2],
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<wgpu::Buffer, String> {
    let shader = pipelines.shader(SURFACE_DEPTHS, &[])?;
    let name = "host: distances for splats";
    let pipeline =
        pipelines.compute(name, &shader, "surface_depths", &Settings::default())?.pipeline;
    let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let depths = scratch.take(recorder.gpu, name, bytes, usage);
    let group = bind(recorder.gpu, &pipeline, |name| match name {
        "depths" => Some(depths.as_entire_binding()),
        _ if HostBinding::of(name) == Some(HostBinding::Surface) => variables.whole_surface(),
        _ => variables.resource(name),
    })?;
    recorder.compute(name, |pass| {
        if let Stage::Compute(stage) = &pipeline.stage {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(size[0].div_ceil(8), size[1].div_ceil(8), 1);
        }
    });
    Ok(depths)
}
