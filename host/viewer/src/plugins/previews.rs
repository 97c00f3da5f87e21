//! The pictures that plugins were packed with.

use eframe::egui::{ColorImage, Context, TextureHandle, TextureOptions};
use image::{DynamicImage, ImageDecoder as _, codecs::png::PngDecoder};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use surfelshop_runtime::plugins::Contents;
use surfelshop_session::output::files;

/// Most pixels of a side: four times that of the ones that `plugins pack` makes.
const LARGEST_SIDE: u32 = 1024;
/// Most bytes of the file: what its pixels take without compression, and some more.
const LARGEST_FILE: u64 = 5 << 20;

/// Those that were asked for; nothing where the file is no such picture.
#[derive(Default)]
pub(crate) struct Previews(BTreeMap<Contents, Option<TextureHandle>>);

impl Previews {
    /// The picture in a file, for a plugin of these contents.
    pub(super) fn of(
        &mut self,
        ctx: &Context,
        contents: Contents,
        file: &Path,
    ) -> Option<TextureHandle> {
        let load = || {
            let bytes = files::read_short(file, LARGEST_FILE).ok()?;
            Some(ctx.load_texture("preview", decoded(&bytes)?, TextureOptions::LINEAR))
        };
        self.0.entry(contents).or_insert_with(load).clone()
    }
}

/// The picture, which comes from a stranger: its size is looked at before its pixels are.
fn decoded(bytes: &[u8]) -> Option<ColorImage> {
    let decoder = PngDecoder::new(Cursor::new(bytes)).ok()?;
    let (width, height) = decoder.dimensions();
    if width.max(height) > LARGEST_SIDE {
        return None;
    }
    let picture = DynamicImage::from_decoder(decoder).ok()?.into_rgba8();
    let size = [width as usize, height as usize];
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
