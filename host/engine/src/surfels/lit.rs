//! Surfels that are shaded one by one and then blended: a surface whose albedo is their radiance.

use super::drawing::Drawing;
use super::surface::{Surface, SurfaceInput, packed_texture};
use crate::run::{Pipeline, Pipelines, Recorder, Stage};
use std::collections::BTreeMap;

const DISC: &str = include_str!("../../../../shaders/host/disc.wgsl");
const RECORDS: &str = include_str!("../../../../shaders/host/records.wgsl");

/// Bytes of a record, and of a surfel's radiance.
const RECORD_BYTES: u64 = 32;
const RADIANCE_BYTES: u64 = 16;

/// A shading function that is called for each surfel.
pub(crate) struct SurfelShading<'a> {
    pub(crate) name: &'a str,
    pub(crate) pipeline: &'a Pipeline,
    /// Binds it to the records of a chunk and to where their radiance goes.
    pub(crate) bind: &'a dyn Fn(&wgpu::Buffer, &wgpu::Buffer) -> Result<wgpu::BindGroup, String>,
}

/// Shades every surfel and blends the results; devices that cannot blend floats clamp them, as
/// they do albedos.
///
/// # Errors
/// Where a pipeline cannot be made or bound.
pub(crate) fn lit_surface(
    input: &SurfaceInput<'_>,
    surface: &Surface,
    shading: &SurfelShading<'_>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<wgpu::TextureView, String> {
    let gpu = recorder.gpu;
    let buffer = |label: &str, size: u64| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.max(RECORD_BYTES),
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        })
    };
    let mut drawing = Drawing::new(input, gpu);
    let counts = drawing.counts();
    let largest = counts.iter().copied().max().unwrap_or(0);
    let records = buffer("surfel records", u64::from(largest) * RECORD_BYTES);
    let none = BTreeMap::new();
    for (chunk, &count) in counts.iter().enumerate() {
        let radiance = buffer("surfel radiance", u64::from(count) * RADIANCE_BYTES);
        let source = format!("{DISC}\n{RECORDS}");
        let shader = pipelines.shader(&source, drawing.defines(chunk))?;
        let pipeline = pipelines.compute("surfels: records", &shader, "record", &none)?;
        let group = drawing.bind_chunk(
            gpu,
            &pipeline,
            chunk,
            &[("records", records.as_entire_binding())],
        )?;
        dispatch(recorder, "surfels: records", &pipeline, &group, count.div_ceil(input.stride));
        let group = (shading.bind)(&records, &radiance)?;
        dispatch(recorder, shading.name, shading.pipeline, &group, count);
        drawing.light(chunk, radiance);
    }
    let target = packed_texture(gpu, input.size);
    if gpu.blends_f32 {
        drawing.blend(surface, &target, recorder, pipelines)?;
    } else {
        drawing.blend_fixed(surface, &target, recorder, pipelines)?;
    }
    Ok(target)
}

/// WebGPU's smallest limit of workgroups per direction.
const MAX_GROUPS: u32 = 65_535;

/// Runs groups of 64 invocations.
fn dispatch(
    recorder: &mut Recorder<'_>,
    name: &str,
    pipeline: &Pipeline,
    group: &wgpu::BindGroup,
    invocations: u32,
) {
    let groups = invocations.div_ceil(64);
    let rows = groups.div_ceil(MAX_GROUPS).max(1);
    recorder.compute(name, |pass| {
        if let Stage::Compute(stage) = &pipeline.stage {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
        }
    });
}
