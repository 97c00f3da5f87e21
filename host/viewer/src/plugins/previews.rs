//! The pictures that plugins were packed with.

use eframe::egui::{ColorImage, Context, TextureHandle, TextureOptions};
use image::codecs::png::PngDecoder;
use image::{DynamicImage, Limits};
use std::collections::BTreeMap;
use std::io::Cursor;
use surfelshop_runtime::plugins::{Contents, Entry};
use surfelshop_session::output::files;
use surfelshop_session::plugin_facts::preview;

/// Most pixels of a side: four times that of the ones that `plugins pack` makes.
const LARGEST_SIDE: u32 = 1024;
/// Most bytes of the file: what pixels of 8 bits take without compression, and some more.
const LARGEST_FILE: u64 = 5 << 20;
/// Most bytes that decoding sets aside: pixels of 16 bits, and what goes with them.
const LARGEST_IN_MEMORY: u64 = 16 << 20;

/// Those that were asked for; nothing where the file is no such picture.
#[derive(Default)]
pub(crate) struct Previews(BTreeMap<Contents, Option<TextureHandle>>);

impl Previews {
    /// The picture of a plugin, where it was packed with one.
    pub(super) fn of(&mut self, ctx: &Context, entry: &Entry) -> Option<TextureHandle> {
        let load = || {
            let bytes = files::read_short(&preview(entry)?, LARGEST_FILE).ok()?;
            Some(ctx.load_texture("preview", decoded(&bytes)?, TextureOptions::LINEAR))
        };
        self.0.entry(entry.contents()).or_insert_with(load).clone()
    }

    /// Lets go of all, as where plugins were added or removed.
    pub(crate) fn forget(&mut self) {
        self.0.clear();
    }
}

/// The picture, which comes from a stranger: nothing larger than it may be is set aside for what it says of itself.
fn decoded(bytes: &[u8]) -> Option<ColorImage> {
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(LARGEST_IN_MEMORY);
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), limits).ok()?;
    let picture = DynamicImage::from_decoder(decoder).ok()?.into_rgba8();
    let size = [picture.width() as usize, picture.height() as usize];
    Some(ColorImage::from_rgba_unmultiplied(size, picture.as_raw()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageFormat, RgbaImage};

    fn png(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        RgbaImage::new(width, height).write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn previews_are_small_pictures_and_nothing_else() {
        assert_eq!(decoded(&png(256, 128)).unwrap().size, [256, 128]);
        assert!(decoded(&png(LARGEST_SIDE, 1)).is_some());
        assert!(decoded(&png(1, LARGEST_SIDE + 1)).is_none());
        let whole = png(64, 64);
        assert!(decoded(&whole[..whole.len() / 2]).is_none());
        assert!(decoded(b"\x89PNG\r\n\x1a\n").is_none() && decoded(&[]).is_none());
    }
}
