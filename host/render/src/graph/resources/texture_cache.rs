//! Persistent textures as bytes, for the store: every level and slice, row by row, without padding.

use crate::gpu::Gpu;
use crate::graph::readback::map;

/// Width, height, slices and bytes per row of a level.
fn level_of(texture: &wgpu::Texture, level: u32) -> Option<([u32; 3], u32)> {
    let halved = |side: u32| (side >> level).max(1);
    let deep = texture.dimension() == wgpu::TextureDimension::D3;
    let slices = texture.depth_or_array_layers();
    let size = [
        halved(texture.width()),
        halved(texture.height()),
        if deep { halved(slices) } else { slices },
    ];
    let texel = texture.format().block_copy_size(None)?;
    Some((size, size[0] * texel))
}

fn n_bytes(size: [u32; 3], row: u32) -> usize {
    row as usize * size[1] as usize * size[2] as usize
}

fn extent([width, height, depth_or_array_layers]: [u32; 3]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers }
}

fn place(texture: &wgpu::Texture, mip_level: u32) -> wgpu::TexelCopyTextureInfo<'_> {
    wgpu::TexelCopyTextureInfo {
        texture,
        mip_level,
        origin: wgpu::Origin3d::ZERO,
        aspect: wgpu::TextureAspect::All,
    }
}

/// Fills a texture; `false`, and nothing done, where the bytes are not as many as it holds.
pub(super) fn fill(gpu: &Gpu, texture: &wgpu::Texture, bytes: &[u8]) -> bool {
    let levels: Option<Vec<_>> =
        (0..texture.mip_level_count()).map(|level| level_of(texture, level)).collect();
    let Some(levels) = levels else { return false };
    if levels.iter().map(|(size, row)| n_bytes(*size, *row)).sum::<usize>() != bytes.len() {
        return false;
    }
    let mut rest = bytes;
    for (level, (size, row)) in levels.into_iter().enumerate() {
        let (own, after) = rest.split_at(n_bytes(size, row));
        rest = after;
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: Some(size[1]),
        };
        gpu.queue.write_texture(place(texture, level as u32), own, layout, extent(size));
    }
    true
}

/// The bytes of a texture; `None` where the device does not give them.
pub(super) fn bytes(gpu: &Gpu, texture: &wgpu::Texture) -> Option<Vec<u8>> {
    let mut all = Vec::new();
    for level in 0..texture.mip_level_count() {
        let (size, row) = level_of(texture, level)?;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("to be stored"),
            size: n_bytes(size, padded) as u64,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            place(texture, level),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: Some(size[1]),
                },
            },
            extent(size),
        );
        gpu.queue.submit([encoder.finish()]);
        let mapped = map(gpu, &buffer).ok()?;
        for line in mapped.chunks_exact(padded as usize) {
            all.extend_from_slice(&line[..row as usize]);
        }
    }
    Some(all)
}
