//! The surface where a renderer's own clouds are nearest, and nothing elsewhere.

use crate::graph::{Pipelines, Recorder, RenderError, Settings, Stage, bind};

const OWN_SURFACE: &str = include_str!("own_surface.wgsl");

/// A packed surface without the pixels whose nearest surfel is of other clouds than these.
///
/// # Errors
/// Where the pipeline cannot be made or bound.
pub(in crate::engine) fn masked(
    packed: &wgpu::TextureView,
    objects: &wgpu::TextureView,
    own: &[u32],
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
) -> Result<wgpu::TextureView, RenderError> {
    let gpu = recorder.gpu;
    let size = packed.texture().size();
    let made = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("surface of own clouds"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = made.create_view(&wgpu::TextureViewDescriptor::default());
    let n_flags = own.iter().max().map_or(1, |last| *last as usize + 1);
    let is_own = |object: usize| u32::from(own.iter().any(|own| *own as usize == object));
    let flags: Vec<u8> = (0..n_flags).flat_map(|object| is_own(object).to_le_bytes()).collect();
    let flags = gpu.filled_buffer("own clouds", &flags, wgpu::BufferUsages::STORAGE);
    let name = "host: surface of own clouds";
    let shader = pipelines.shader(OWN_SURFACE, &[]).map_err(RenderError::Host)?;
    let found = pipelines.compute(name, &shader, "own_surface", &Settings::default());
    let pipeline = found.map_err(RenderError::Host)?.pipeline;
    let group = bind(gpu, &pipeline, |name| match name {
        "packed" => Some(wgpu::BindingResource::TextureView(packed)),
        "objects" => Some(wgpu::BindingResource::TextureView(objects)),
        "own" => Some(flags.as_entire_binding()),
        "masked" => Some(wgpu::BindingResource::TextureView(&view)),
        _ => None,
    })
    .map_err(RenderError::Host)?;
    recorder.compute(name, |pass| {
        if let Stage::Compute(stage) = &pipeline.stage {
            pass.set_pipeline(stage);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(size.width.div_ceil(8), size.height.div_ceil(8), 1);
        }
    });
    Ok(view)
}
