//! Gaussians out of the pixels of their images.

use super::super::batch::{Batch, Column};
use super::super::{Gaussian, rotation};
use super::images::Image;
use super::meta::{COEFFICIENTS, Meta, Opacity, PER_ROW};
use super::zip::Archive;
use std::f32::consts::FRAC_1_SQRT_2;
use surfelshop_api::prelude::{Error, Job, Result};

/// The share of the work that unpacking images is.
pub(super) const UNPACKING: f64 = 0.6;

/// Alpha of rotations whose largest part is w; those of x, y and z follow.
const FIRST_TAG: u8 = 252;

/// Spherical harmonics by the entry of a palette.
struct Harmonics {
    labels: Image,
    entries: Image,
    /// Of an entry.
    coefficients: usize,
    count: usize,
}

/// The images of a scene.
pub(super) struct Images {
    lower: Image,
    upper: Image,
    scales: Option<Image>,
    rotations: Option<Image>,
    colors: Option<Image>,
    harmonics: Option<Harmonics>,
    /// Gaussians whose rotation or entry of the palette the file does not have.
    n_without_rotation: u64,
    n_without_entry: u64,
}

impl Images {
    /// Unpacks the images of columns that are wanted; `folder` is where their names lie.
    pub(super) fn read(
        archive: &Archive<'_>,
        folder: &str,
        meta: &Meta,
        batch: &Batch,
        job: &Job<'_>,
    ) -> Result<Self> {
        let mut n_read = 0;
        let mut report = || {
            n_read += 1;
            job.progress(UNPACKING * f64::from(n_read.min(7)) / 7.0, "");
            job.check()
        };
        let mut read = |name: &str, is_wanted: bool| {
            report()?;
            let name = format!("{folder}{name}");
            is_wanted.then(|| Image::read(archive, &name, meta.count)).transpose()
        };
        let mut needed = |name: &str| {
            let image = read(name, true)?;
            image.ok_or_else(|| Error::new("an image was not read"))
        };
        let [lower, upper] = [needed(&meta.means[0])?, needed(&meta.means[1])?];
        let scales = read(&meta.scales_file, batch.has(Column::Scale))?;
        let rotations = read(&meta.quats_file, batch.has(Column::Rotation))?;
        let has_colors = batch.has(Column::Sh(0)) || batch.has(Column::Opacity);
        let colors = read(&meta.colors_file, has_colors)?;
        let harmonics = match &meta.palette {
            Some(palette) if batch.has_rest() => {
                let [entries, labels] =
                    palette.files.each_ref().map(|name| format!("{folder}{name}"));
                Some(Harmonics::read(archive, [&entries, &labels], meta)?)
            }
            _ => None,
        };
        let (n_without_rotation, n_without_entry) = (0, 0);
        Ok(Self {
            lower,
            upper,
            scales,
            rotations,
            colors,
            harmonics,
            n_without_rotation,
            n_without_entry,
        })
    }

    /// A Gaussian. What was not read is as it is by default.
    pub(super) fn gaussian(&mut self, meta: &Meta, i: usize) -> Gaussian {
        let mut found = Gaussian { position: self.position(meta, i), ..Gaussian::default() };
        if let Some(image) = &self.scales {
            let pixel = image.pixel(i);
            found.scale = [0, 1, 2].map(|axis| meta.scales[axis][usize::from(pixel[axis])].exp());
        }
        if let Some(image) = &self.rotations {
            let rotation = unpacked(image.pixel(i));
            self.n_without_rotation += u64::from(rotation.is_none());
            found.rotation = rotation.unwrap_or(rotation::IDENTITY);
        }
        if let Some(image) = &self.colors {
            let pixel = image.pixel(i);
            found.color = [0, 1, 2].map(|color| meta.colors[color][usize::from(pixel[color])]);
            let share = f32::from(pixel[3]) / 255.0;
            found.opacity = match meta.opacity {
                Opacity::Share => share,
                Opacity::Logit([least, most]) => {
                    1.0 / (1.0 + (-(least + (most - least) * share)).exp())
                }
            };
        }
        if let (Some(harmonics), Some(palette)) = (&self.harmonics, &meta.palette) {
            let [low, high, ..] = harmonics.labels.pixel(i);
            let label = usize::from(u16::from_le_bytes([low, high]));
            self.n_without_entry += u64::from(label >= harmonics.count);
            if label < harmonics.count {
                let n = harmonics.coefficients;
                let first = (label / PER_ROW) * harmonics.entries.width + (label % PER_ROW) * n;
                for (k, value) in found.rest.iter_mut().take(n).enumerate() {
                    let [r, g, b, _] = harmonics.entries.pixel(first + k);
                    *value = [r, g, b].map(|code| palette.codes[usize::from(code)]);
                }
            }
        }
        found
    }

    /// Positions are sign(n) (exp |n| - 1) of a number n between bounds, of 16 bits.
    fn position(&self, meta: &Meta, i: usize) -> [f32; 3] {
        let (lower, upper) = (self.lower.pixel(i), self.upper.pixel(i));
        [0, 1, 2].map(|axis| {
            let [least, most] = meta.bounds[axis];
            let share = f64::from(u16::from_le_bytes([lower[axis], upper[axis]])) / 65535.0;
            let number = least + (most - least) * share;
            (number.abs().exp_m1().copysign(number)) as f32
        })
    }

    /// What was doubtful.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.n_without_rotation > 0 {
            lines.push(format!(
                "{} rotations do not say which part is the largest: they are the identity",
                self.n_without_rotation
            ));
        }
        if self.n_without_entry > 0 {
            lines.push(format!(
                "{} Gaussians have spherical harmonics that the palette does not have: they are 0",
                self.n_without_entry
            ));
        }
        lines
    }
}

impl Harmonics {
    fn read(archive: &Archive<'_>, [entries, labels]: [&str; 2], meta: &Meta) -> Result<Self> {
        // Labels have 16 bits.
        let most = (1 << 16) * COEFFICIENTS[3] as u64;
        let image = Image::of_any_size(archive, entries, most)?;
        let palette = meta.palette.as_ref();
        let bands = palette.and_then(|palette| palette.bands);
        let of_width = || (1..=3).find(|bands| PER_ROW * COEFFICIENTS[*bands] == image.width);
        let bands =
            bands.or_else(of_width).filter(|bands| PER_ROW * COEFFICIENTS[*bands] == image.width);
        let bands = bands.ok_or_else(|| {
            let widths = [1, 2, 3].map(|bands| (PER_ROW * COEFFICIENTS[bands]).to_string());
            let expected = match palette.and_then(|palette| palette.bands) {
                Some(bands) => (PER_ROW * COEFFICIENTS[bands]).to_string(),
                None => widths.join(" or "),
            };
            Error::new(format!(
                "`{}` in the archive: expected a palette {expected} pixels wide, found {}",
                entries.escape_debug(),
                image.width
            ))
        })?;
        let in_image = PER_ROW * image.height;
        let count = palette.and_then(|palette| palette.count).unwrap_or(in_image).min(in_image);
        let labels = Image::read(archive, labels, meta.count)?;
        Ok(Self { labels, entries: image, coefficients: COEFFICIENTS[bands], count })
    }
}

/// The degree of spherical harmonics of a scene; where only the palette's image says, that is read.
pub(super) fn degree(archive: &Archive<'_>, folder: &str, meta: &Meta) -> Result<usize> {
    let Some(palette) = &meta.palette else { return Ok(0) };
    match palette.bands {
        Some(bands) => Ok(bands),
        None => {
            let [entries, labels] = palette.files.each_ref().map(|name| format!("{folder}{name}"));
            let found = Harmonics::read(archive, [&entries, &labels], meta)?;
            Ok(COEFFICIENTS.iter().position(|n| *n == found.coefficients).unwrap_or(0))
        }
    }
}

/// The rotation x, y, z, w of a pixel: three parts in the order w, x, y, z, without the largest, which alpha names.
fn unpacked([a, b, c, tag]: [u8; 4]) -> Option<[f32; 4]> {
    let largest = usize::from(tag.checked_sub(FIRST_TAG)?);
    let part = |byte: u8| (f32::from(byte) / 255.0 * 2.0 - 1.0) * FRAC_1_SQRT_2;
    let [w, x, y, z] = rotation::without_largest([a, b, c].map(part), largest);
    Some([x, y, z, w])
}

/// The pixel of a rotation, as [`unpacked`] takes it.
pub(super) fn packed(rotation: [f32; 4]) -> [u8; 4] {
    let [x, y, z, w] = rotation::unit(rotation);
    let parts = [w, x, y, z];
    let largest =
        (1..4).fold(0, |most, i| if parts[i].abs() > parts[most].abs() { i } else { most });
    let sign = if parts[largest] < 0.0 { -1.0 } else { 1.0 };
    let mut pixel = [0; 4];
    let others = (0..4).filter(|i| *i != largest);
    for (byte, i) in pixel.iter_mut().zip(others) {
        let share = 0.5 * (sign * parts[i] / FRAC_1_SQRT_2 + 1.0);
        *byte = (255.0 * share).round() as u8;
    }
    pixel[3] = FIRST_TAG + largest as u8;
    pixel
}
