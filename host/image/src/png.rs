//! PNG files, of 8 or 16 bits a channel.

use crate::display::{to_8_bit, to_16_bit};
use crate::{FileError, Image};
use image::{ImageBuffer, Rgba};
use std::io::Cursor;

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
