//! The CPU puts splats together: footprints come from the device, pictures go there.

use crate::gpu::Gpu;
use crate::graph::execute::Variables;
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::PassScratch;
use crate::graph::readback::with_mapped;
use crate::graph::recorder::Recorder;
use crate::graph::splats::{Made, surface};
use std::borrow::Cow;
use surfelshop_api::Projection;
use surfelshop_api::graph::{Composition, Footprint, SplatDepth, Splats, TextureId};
use surfelshop_raster::composition::{self as raster, Depths, Kind, Pictures};

/// Puts splats together and brings the pictures to the device.
///
/// # Errors
/// Where the device fails.
pub(super) fn compose(
    splats: &Splats,
    variables: &Variables<'_>,
    made: &[Made],
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<(), String> {
    let gpu = recorder.gpu;
    let n_payloads = splats.targets.len();
    let size = variables.plan.size_of(variables.pass);
    let surface = match splats.tested {
        true => Some(surface::depths(variables, size, recorder, pipelines, scratch)?),
        false => None,
    };
    let mut copies = Vec::new();
    let mut readable = |buffer: &wgpu::Buffer, recorder: &mut Recorder<'_>| -> wgpu::Buffer {
        if buffer.usage().contains(wgpu::BufferUsages::MAP_READ) {
            return buffer.clone();
        }
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let read = scratch.take(gpu, "splats read back", buffer.size(), usage);
        recorder.encoder.copy_buffer_to_buffer(buffer, 0, &read, 0, buffer.size());
        copies.push(read.clone());
        read
    };
    let n_parts = made.len();
    let mut read: Vec<wgpu::Buffer> = Vec::new();
    read.extend(made.iter().map(|part| readable(&part.footprints, recorder)));
    read.extend(made.iter().map(|part| readable(&part.payloads, recorder)));
    read.extend(surface.iter().map(|depths| readable(depths, recorder)));
    recorder.finish();
    gpu.stages.end("splats: read-back");
    let wants = |which| splats.depths.iter().any(|(depth, _)| *depth == which);
    let depths = Depths {
        expected: wants(SplatDepth::Expected),
        median: wants(SplatDepth::Median),
        distortion: wants(SplatDepth::Distortion),
    };
    let composition = match splats.composition {
        Composition::Over => raster::Composition::Over,
        Composition::Additive => raster::Composition::Additive,
        Composition::Nearest => raster::Composition::Nearest,
        Composition::Stochastic { samples } => raster::Composition::Stochastic(samples),
        Composition::Normalized { tolerance } => raster::Composition::Normalized(tolerance),
    };
    let (seen, unit) = variables.view().ok_or("there is no view to draw splats in")?;
    let view = raster::View {
        size_px: size,
        near: (seen.near / unit) as f32,
        unit: unit as f32,
        orthographic: matches!(seen.camera.projection, Projection::Orthographic { .. }),
    };
    let read: Vec<_> = read.iter().map(|buffer| buffer.slice(..)).collect();
    let composer = &mut scratch.composer;
    let drawn = with_mapped(gpu, &read, |bytes| -> Result<(), String> {
        let counts = |per_splat: usize| made.iter().map(move |part| part.n as usize * per_splat);
        let footprints = joined(&bytes[..n_parts], counts(1))?;
        let payloads = joined(&bytes[n_parts..2 * n_parts], counts(n_payloads))?;
        let surface = match bytes.get(2 * n_parts) {
            Some(depths) => joined(&[*depths], [depths.len() / 4].into_iter())?,
            None => Cow::Borrowed(&[][..]),
        };
        let splatted = raster::Splats {
            kind: match splats.footprint {
                Footprint::Conic => Kind::Conic,
                Footprint::Planar => Kind::Planar,
            },
            footprints: &footprints,
            payloads: &payloads,
            n_payloads,
            surface: &surface,
        };
        let each = |stage: &str| gpu.stages.end(stage);
        let pictures = composer.compose(&splatted, composition, depths, &view, &each);
        upload(splats, variables, gpu, pictures);
        gpu.stages.end("splats: upload");
        Ok(())
    });
    copies.into_iter().for_each(|copy| scratch.give(copy));
    surface.into_iter().for_each(|depths| scratch.give(depths));
    drawn?
}

/// What stands in buffers behind one another, so many of each: in one buffer as it lies there.
fn joined<'a, T: bytemuck::AnyBitPattern>(
    bytes: &[&'a [u8]],
    counts: impl Iterator<Item = usize>,
) -> Result<Cow<'a, [T]>, String> {
    let cast = |(bytes, n): (&&'a [u8], usize)| -> Result<&'a [T], String> {
        let whole = bytes.len() / size_of::<T>() * size_of::<T>();
        let all: &[T] = bytemuck::try_cast_slice(&bytes[..whole])
            .map_err(|error| format!("the device's memory cannot be read as it lies: {error}"))?;
        all.get(..n).ok_or_else(|| "the device gave less than it was asked for".to_owned())
    };
    let parts = bytes.iter().zip(counts).map(cast).collect::<Result<Vec<_>, _>>()?;
    Ok(match parts.as_slice() {
        [only] => Cow::Borrowed(*only),
        parts => Cow::Owned(parts.concat()),
    })
}

/// Brings pictures into the textures of a pass.
fn upload(splats: &Splats, variables: &Variables<'_>, gpu: &Gpu, pictures: &Pictures) {
    let write = |target: TextureId, texel: u32, bytes: &[u8]| {
        // One that nobody reads was not made.
        let texture = variables.resources.textures.get(target.index());
        let Some(Some(texture)) = texture else { return };
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(texel * texture.width()),
            rows_per_image: None,
        };
        gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, texture.size());
    };
    for (target, sums) in splats.targets.iter().zip(&pictures.sums) {
        write(*target, 16, bytemuck::cast_slice(sums));
    }
    for (which, target) in &splats.depths {
        let depths = match which {
            SplatDepth::Expected => &pictures.expected,
            SplatDepth::Median => &pictures.median,
            SplatDepth::Distortion => &pictures.distortion,
        };
        write(*target, 4, bytemuck::cast_slice(depths));
    }
}
