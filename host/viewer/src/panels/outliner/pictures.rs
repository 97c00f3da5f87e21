//! Small pictures of remembered cameras, as textures.

use crate::document::{PICTURE, Thumbnail};
use eframe::egui::{ColorImage, Context, TextureHandle, TextureId, TextureOptions};

/// The pictures that are on the screen.
#[derive(Default)]
pub(crate) struct BookmarkPictures {
    all: Vec<(Thumbnail, TextureHandle)>,
}

impl BookmarkPictures {
    /// The texture of a picture.
    pub(super) fn of(&mut self, ctx: &Context, picture: &Thumbnail) -> TextureId {
        if let Some((_, texture)) = self.all.iter().find(|(known, _)| known == picture) {
            return texture.id();
        }
        let size = PICTURE.map(|side| side as usize);
        let image = ColorImage::from_rgba_unmultiplied(size, picture.levels());
        let texture = ctx.load_texture("remembered camera", image, TextureOptions::LINEAR);
        let id = texture.id();
        self.all.push((picture.clone(), texture));
        id
    }

    /// Drops the textures of pictures that are gone.
    pub(super) fn retain<'a>(&mut self, known: impl Iterator<Item = &'a Thumbnail> + Clone) {
        self.all.retain(|(picture, _)| known.clone().any(|other| other == picture));
    }
}
