//! PNG files, of 8 or 16 bits a channel.

use crate::display_transform::{to_8_bit, to_16_bit};
use crate::{FileError, Image};
use image::{ImageBuffer, ImageReader, Limits, Rgba};
use std::io::Cursor;
use std::path::Path;

/// Bits per channel of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bits {
    /// What screens show.
    #[default]
    Eight,
    /// For pictures that are worked on.
    Sixteen,
}

/// A picture of values in [0, 1] and straight alpha as a PNG file.
///
/// # Errors
/// Where the picture has fewer pixels than its size says, or cannot be encoded.
pub fn encode(image: &Image, bits: Bits) -> Result<Vec<u8>, FileError> {
    let mut bytes = Cursor::new(Vec::new());
    let (width, height) = (image.width, image.height);
    let format = image::ImageFormat::Png;
    let encoded = match bits {
        Bits::Eight => ImageBuffer::<Rgba<u8>, _>::from_raw(width, height, to_8_bit(image))
            .map(|pixels| pixels.write_to(&mut bytes, format)),
        Bits::Sixteen => ImageBuffer::<Rgba<u16>, _>::from_raw(width, height, to_16_bit(image))
            .map(|pixels| pixels.write_to(&mut bytes, format)),
    };
    match encoded {
        Some(encoded) => encoded?,
        None => return Err(FileError::TooFewPixels),
    }
    Ok(bytes.into_inner())
}

/// 8-bit levels, red, green, blue and straight alpha of each pixel, as a PNG file.
///
/// # Errors
/// Where there are fewer than the size says, or they cannot be encoded.
pub fn encode_levels([width, height]: [u32; 2], levels: Vec<u8>) -> Result<Vec<u8>, FileError> {
    let mut bytes = Cursor::new(Vec::new());
    let pixels = ImageBuffer::<Rgba<u8>, _>::from_raw(width, height, levels);
    pixels.ok_or(FileError::TooFewPixels)?.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// Reads a PNG file of at most so many pixels: values in [0, 1] with straight alpha, four a pixel.
///
/// # Errors
/// Where the file cannot be read, is no PNG, or has more pixels: its head is read before there is memory for
/// them.
pub fn read(path: &Path, most_pixels: u64) -> Result<Image, FileError> {
    let wrong = |what: String| FileError::Unreadable { path: path.to_owned(), what };
    let unreadable = |error: image::ImageError| wrong(format!("cannot be read: {error}"));
    let open = || -> Result<_, FileError> {
        let mut reader = ImageReader::open(path).map_err(|error| wrong(error.to_string()))?;
        reader.set_format(image::ImageFormat::Png);
        Ok(reader)
    };
    let (width, height) = open()?.into_dimensions().map_err(unreadable)?;
    let n_pixels = u64::from(width) * u64::from(height);
    if n_pixels > most_pixels {
        return Err(wrong(format!("expected at most {most_pixels} pixels, found {n_pixels}")));
    }
    let mut reader = open()?;
    // Four channels of 16 bits, and as much again for the rows being decoded.
    let mut limits = Limits::default();
    limits.max_alloc = Some(16 * n_pixels.max(1 << 16));
    reader.limits(limits);
    let pixels = reader.decode().map_err(unreadable)?.into_rgba32f().into_raw();
    Ok(Image { width, height, components: 4, data: pixels })
}
