//! Pictures that fit into a page: as large and as little compressed as so many bytes allow.

use anyhow::{Context as _, bail};
use image::RgbImage;
use jpeg_encoder::{ColorType, Encoder};
use rayon::prelude::*;

/// A share of each side, and a quality of JPEG, from the best to the worst that is still worth showing.
const STEPS: [(f64, u8); 12] = [
    (1.0, 92),
    (1.0, 86),
    (1.0, 78),
    (0.8, 84),
    (0.8, 74),
    (0.64, 80),
    (0.64, 70),
    (0.5, 76),
    (0.5, 66),
    (0.4, 70),
    (0.3, 66),
    (0.2, 60),
];

/// How pictures were stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stored {
    /// Width and height in pixels.
    pub(super) size: [u32; 2],
    /// Quality of JPEG, 1 to 100.
    pub(super) quality: u8,
}

/// The pictures, as PNG and opaque, as JPEG files that take at most so many bytes together on a page.
///
/// # Errors
/// One line where not even the smallest would fit.
pub(super) fn fitted(pictures: &[Vec<u8>], most: u64) -> anyhow::Result<(Vec<Vec<u8>>, Stored)> {
    // A few tell of most steps that they are too large.
    let sample: Vec<&Vec<u8>> =
        pictures.iter().step_by(pictures.len().div_ceil(6).max(1)).collect();
    for (share, quality) in STEPS {
        let some = encoded(&sample, share, quality)?;
        let expected = on_page(&some.0) as f64 * pictures.len() as f64 / sample.len().max(1) as f64;
        if expected > 1.15 * most as f64 {
            continue;
        }
        let all: Vec<&Vec<u8>> = pictures.iter().collect();
        let (files, size) = encoded(&all, share, quality)?;
        if on_page(&files) <= most {
            return Ok((files, Stored { size, quality }));
        }
    }
    bail!(
        "{} pictures do not fit into {most} bytes even when they are small; take fewer with --path, or allow more with \
         --most",
        pictures.len()
    )
}

/// Bytes on a page, where three become four letters.
fn on_page(files: &[Vec<u8>]) -> u64 {
    files.iter().map(|file| 4 * (file.len() as u64).div_ceil(3)).sum()
}

/// The files, and the size of the first.
fn encoded(
    pictures: &[&Vec<u8>],
    share: f64,
    quality: u8,
) -> anyhow::Result<(Vec<Vec<u8>>, [u32; 2])> {
    let one = |png: &&Vec<u8>| -> anyhow::Result<(Vec<u8>, [u32; 2])> {
        let whole = image::load_from_memory(png)?.into_rgb8();
        let side = |side: u32| ((f64::from(side) * share).round() as u32).max(1);
        let picture = match share {
            1.0 => whole,
            _ => image::imageops::thumbnail(&whole, side(whole.width()), side(whole.height())),
        };
        Ok((jpeg(&picture, quality)?, [picture.width(), picture.height()]))
    };
    let all: Vec<(Vec<u8>, [u32; 2])> = pictures.par_iter().map(one).collect::<Result<_, _>>()?;
    let size = all.first().map_or([0; 2], |(_, size)| *size);
    Ok((all.into_iter().map(|(file, _)| file).collect(), size))
}

fn jpeg(picture: &RgbImage, quality: u8) -> anyhow::Result<Vec<u8>> {
    let side = |side: u32| {
        u16::try_from(side).context("a picture of a page has at most 65535 pixels a side")
    };
    let (width, height) = (side(picture.width())?, side(picture.height())?);
    let mut bytes = Vec::new();
    Encoder::new(&mut bytes, quality).encode(picture.as_raw(), width, height, ColorType::Rgb)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn noise(seed: u32, side: u32) -> Vec<u8> {
        let pixel = |x: u32, y: u32| {
            let mixed = (x * 7919) ^ (y * 104_729) ^ (seed * 15_485_863);
            let value = (mixed.wrapping_mul(2_654_435_761) >> 24) as u8;
            image::Rgb([value, value / 2, 255 - value])
        };
        let mut png = Cursor::new(Vec::new());
        RgbImage::from_fn(side, side, pixel).write_to(&mut png, image::ImageFormat::Png).unwrap();
        png.into_inner()
    }

    #[test]
    fn pictures_are_as_good_as_there_is_room() {
        let all: Vec<Vec<u8>> = (0..5).map(|seed| noise(seed, 64)).collect();
        let (files, best) = fitted(&all, 1 << 20).unwrap();
        assert_eq!((files.len(), best), (5, Stored { size: [64; 2], quality: 92 }));
        assert!(files.iter().all(|file| file.starts_with(&[0xff, 0xd8, 0xff])), "they are JPEG");
        let (files, less) = fitted(&all, on_page(&files) / 3).unwrap();
        assert!(less.size[0] < 64 || less.quality < 92, "{less:?}");
        assert!(on_page(&files) > 0);
        assert!(fitted(&all, 100).unwrap_err().to_string().contains("--most"));
    }
}
