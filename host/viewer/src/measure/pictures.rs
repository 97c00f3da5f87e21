//! Small pictures of what was measured.

use crate::document::{PICTURE, Thumbnail};
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};
use std::cell::OnceCell;

/// One for each subject; textures are made when they are shown first.
pub(super) struct Pictures(Vec<(Option<Thumbnail>, OnceCell<TextureHandle>)>);

impl Pictures {
    pub(super) fn new(n: usize) -> Self {
        Self((0..n).map(|_| (None, OnceCell::new())).collect())
    }

    /// Takes in the picture of a subject.
    pub(super) fn put(&mut self, i: usize, size: [u32; 2], levels: &[u8]) {
        if let Some(place) = self.0.get_mut(i) {
            *place = (Thumbnail::of(size, levels), OnceCell::new());
        }
    }

    /// The texture of a subject's picture.
    pub(super) fn texture(&self, ctx: &Context, i: usize) -> Option<TextureId> {
        let (picture, texture) = self.0.get(i)?;
        let picture = picture.as_ref()?;
        let texture = texture.get_or_init(|| {
            let size = PICTURE.map(|side| side as usize);
            let image = ColorImage::from_rgba_unmultiplied(size, picture.levels());
            ctx.load_texture("measured picture", image, TextureOptions::LINEAR)
        });
        Some(texture.id())
    }
}
