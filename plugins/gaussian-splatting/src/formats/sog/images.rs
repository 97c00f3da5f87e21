//! Images as rows of numbers.

use super::zip::Archive;
use image_webp::WebPDecoder;
use std::io::Cursor;
use surfelshop_api::prelude::{Error, Result};

/// Most bytes of a packed image.
const MOST_BYTES: u64 = 1 << 30;

/// Pixels that an image may have beyond those that are needed: its sides are rounded up.
const MOST_SPARE: u64 = 1 << 17;

/// An image.
pub(super) struct Image {
    pub(super) width: usize,
    pub(super) height: usize,
    channels: usize,
    values: Vec<u8>,
}

impl Image {
    /// Reads an image that needs so many pixels.
    pub(super) fn read(archive: &Archive<'_>, name: &str, pixels: u64) -> Result<Self> {
        let image = Self::of_any_size(archive, name, pixels)?;
        let found = (image.width * image.height) as u64;
        if found < pixels {
            return Err(Error::new(format!(
                "`{}` in the archive: expected {pixels} pixels, found {found}",
                name.escape_debug()
            )));
        }
        Ok(image)
    }

    /// Reads an image that has not many more pixels than these.
    pub(super) fn of_any_size(archive: &Archive<'_>, name: &str, pixels: u64) -> Result<Self> {
        let wrong =
            |line: String| Error::new(format!("`{}` in the archive: {line}", name.escape_debug()));
        let bytes = archive.bytes(name, MOST_BYTES)?;
        let refused =
            |error: image_webp::DecodingError| wrong(format!("expected a WebP image: {error}"));
        let mut decoder = WebPDecoder::new(Cursor::new(&bytes)).map_err(refused)?;
        let (width, height) = decoder.dimensions();
        let found = u64::from(width) * u64::from(height);
        if found > pixels + MOST_SPARE {
            return Err(wrong(format!(
                "expected about {pixels} pixels, found {width} x {height}: the file is damaged"
            )));
        }
        if decoder.is_lossy() {
            return Err(wrong(
                "expected a lossless image, found a lossy one, whose numbers are no longer those that were packed".into(),
            ));
        }
        let channels = if decoder.has_alpha() { 4 } else { 3 };
        let mut values = Vec::new();
        let length = usize::try_from(found)? * channels;
        values.try_reserve_exact(length)?;
        values.resize(length, 0);
        decoder.read_image(&mut values).map_err(refused)?;
        Ok(Self { width: width as usize, height: height as usize, channels, values })
    }

    /// A pixel, of which there must be one; opaque where the image does not say.
    pub(super) fn pixel(&self, place: usize) -> [u8; 4] {
        let start = place * self.channels;
        match self.values.get(start..start + self.channels) {
            Some(&[r, g, b, a]) => [r, g, b, a],
            Some(&[r, g, b]) => [r, g, b, u8::MAX],
            _ => [0; 4],
        }
    }
}
