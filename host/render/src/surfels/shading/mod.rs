//! Surfels that are shaded one by one and then blended: a surface whose albedo is their radiance.

use crate::graph::{Pipelines, Recorder, Settings, SurfelShading};
use crate::surfels::quads::{DISC, Drawing, each_of};
use crate::surfels::surface::{Surface, SurfaceInput, packed_texture};

const RECORDS: &str = include_str!("records.wgsl");

/// Bytes of a record, and of a surfel's radiance.
const RECORD_BYTES: u64 = 32;
const RADIANCE_BYTES: u64 = 16;

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
    // Surfels drawn of each chunk.
    let counts: Vec<u32> = drawing.counts().map(|n| n.div_ceil(input.stride)).collect();
    let largest = counts.iter().copied().max().unwrap_or(0);
    let records = buffer("surfel records", u64::from(largest) * RECORD_BYTES);
    let none = Settings::default();
    for (chunk, &count) in counts.iter().enumerate() {
        let radiance = buffer("surfel radiance", u64::from(count) * RADIANCE_BYTES);
        let source = format!("{DISC}\n{RECORDS}");
        let shader = pipelines.shader(&source, drawing.defines(chunk))?;
        let pipeline = pipelines.compute("surfels: records", &shader, "record", &none)?.pipeline;
        let group = drawing.bind_chunk(
            gpu,
            &pipeline,
            chunk,
            &[("records", records.as_entire_binding())],
        )?;
        recorder.compute("surfels: records", |pass| each_of(pass, &pipeline, &group, count));
        let group = (shading.bind)(&records, &radiance)?;
        recorder.compute(shading.name, |pass| each_of(pass, shading.pipeline, &group, count));
        drawing.light(chunk, radiance);
    }
    let target = packed_texture(gpu, input.size);
    drawing.blended(surface, &target, recorder, pipelines)?;
    Ok(target)
}
