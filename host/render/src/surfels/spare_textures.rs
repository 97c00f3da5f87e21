//! Textures of surfaces that are dropped, for those that the CPU draws next: the memory of new ones is cleared by the
//! system page by page.

use crate::gpu::Gpu;
use crate::graph::texture_bytes;
use std::sync::Arc;
use surfelshop_raster::Coverage;

/// Textures by what of them is not zeros.
#[derive(Default)]
pub(crate) struct SpareTextures {
    views: Vec<(wgpu::TextureView, Arc<Coverage>)>,
}

impl SpareTextures {
    /// A texture, and which parts of it may hold something.
    pub(crate) fn take(
        &mut self,
        gpu: &Gpu,
        label: &str,
        size: [u32; 2],
        format: wgpu::TextureFormat,
    ) -> (wgpu::TextureView, Arc<Coverage>) {
        let fits = |(view, _): &(wgpu::TextureView, _)| {
            let texture = view.texture();
            [texture.width(), texture.height()] == size && texture.format() == format
        };
        match self.views.iter().position(fits) {
            Some(at) => self.views.swap_remove(at),
            None => {
                let empty = Coverage::none(size.map(|side| side as usize));
                (texture(gpu, label, size, format), Arc::new(empty))
            }
        }
    }

    /// Takes over the textures of a dropped surface, in place of those of the one before: a frame drops one, and the
    /// next makes one.
    pub(crate) fn replace(
        &mut self,
        views: impl Iterator<Item = wgpu::TextureView>,
        covered: &Arc<Coverage>,
    ) {
        self.views = views.map(|view| (view, covered.clone())).collect();
    }

    /// Bytes of all of them, without what the driver adds.
    pub(crate) fn bytes(&self) -> u64 {
        self.views.iter().map(|(view, _)| texture_bytes(view.texture())).sum()
    }
}

/// A texture of a surface, of this size in pixels.
pub(crate) fn texture(
    gpu: &Gpu,
    label: &str,
    size: [u32; 2],
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: match format {
            wgpu::TextureFormat::Depth32Float => {
                wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING
            }
            _ => {
                wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_DST
                    | wgpu::TextureUsages::COPY_SRC
            }
        },
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
