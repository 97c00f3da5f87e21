//! Textures of surfaces that are dropped, for those that the CPU draws next: the memory of new ones is cleared by the
//! system page by page.

use crate::gpu::Gpu;
use crate::graph::texture_bytes;
use crate::surfels::surface::{Surface, texture};
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

    /// Takes over the textures of a surface, in place of those of the one before: a frame drops one, and the next
    /// makes one.
    pub(crate) fn add(&mut self, dropped: Option<Surface>) {
        let Some(dropped) = dropped else { return };
        let Surface { nearest, blended, fields, material, object, covered, size, .. } = dropped;
        let whole = || Arc::new(Coverage::whole(size.map(|side| side as usize)));
        let covered = covered.unwrap_or_else(whole);
        let views = [nearest, blended, fields, material, object].into_iter().flatten();
        self.views = views.map(|view| (view, covered.clone())).collect();
    }

    /// Bytes of all of them, without what the driver adds.
    pub(crate) fn bytes(&self) -> u64 {
        self.views.iter().map(|(view, _)| texture_bytes(view.texture())).sum()
    }
}
