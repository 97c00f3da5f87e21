//! Memory for passes of splats, sorts and sums that is used again from frame to frame.

use crate::gpu::Gpu;
use surfelshop_raster::composition::Composer;

/// Frames that a buffer survives without being used.
const KEPT_FRAMES: u64 = 64;

/// A buffer that waits for its next use.
struct Waiting {
    buffer: wgpu::Buffer,
    last_used: u64,
}

/// A texture that waits for its next use.
struct WaitingTexture {
    texture: wgpu::Texture,
    last_used: u64,
}

/// What passes of splats, sorts and sums need besides resources of graphs.
#[derive(Default)]
pub(crate) struct PassScratch {
    pub(in crate::graph) composer: Composer,
    waiting: Vec<Waiting>,
    waiting_textures: Vec<WaitingTexture>,
    frame: u64,
}

impl PassScratch {
    /// Drops what has not been used for a while; called once a frame.
    pub(crate) fn next_frame(&mut self) {
        self.frame += 1;
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.waiting.retain(|waiting| waiting.last_used >= oldest);
        self.waiting_textures.retain(|waiting| waiting.last_used >= oldest);
    }

    /// Bytes of the buffers and textures that are kept.
    pub(crate) fn bytes(&self) -> u64 {
        let buffers: u64 = self.waiting.iter().map(|waiting| waiting.buffer.size()).sum();
        let of = |waiting: &WaitingTexture| {
            let texture = &waiting.texture;
            let texel = u64::from(texture.format().block_copy_size(None).unwrap_or(4));
            u64::from(texture.width()) * u64::from(texture.height()) * texel
        };
        buffers + self.waiting_textures.iter().map(of).sum::<u64>()
    }

    /// A buffer of so many bytes, with anything in it.
    pub(in crate::graph) fn take(
        &mut self,
        gpu: &Gpu,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let size = bytes.max(16).next_multiple_of(4);
        let fits = |w: &Waiting| w.buffer.size() == size && w.buffer.usage() == usage;
        if let Some(at) = self.waiting.iter().position(fits) {
            return self.waiting.swap_remove(at).buffer;
        }
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Takes a buffer back that the device is done with, or that is used in its order.
    pub(in crate::graph) fn give(&mut self, buffer: wgpu::Buffer) {
        self.waiting.push(Waiting { buffer, last_used: self.frame });
    }

    /// A texture to draw into and to read, with anything in it.
    pub(in crate::graph) fn take_texture(
        &mut self,
        gpu: &Gpu,
        label: &str,
        format: wgpu::TextureFormat,
        [width, height]: [u32; 2],
    ) -> wgpu::Texture {
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let fits = |w: &WaitingTexture| w.texture.size() == size && w.texture.format() == format;
        if let Some(at) = self.waiting_textures.iter().position(fits) {
            return self.waiting_textures.swap_remove(at).texture;
        }
        gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
    }

    /// Takes a texture back.
    pub(in crate::graph) fn give_texture(&mut self, texture: wgpu::Texture) {
        self.waiting_textures.push(WaitingTexture { texture, last_used: self.frame });
    }
}
