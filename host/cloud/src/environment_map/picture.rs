//! The radiance picture of a probe: its shape, its repair, and writing it.

use super::error::ProbeFault;
use super::limits::{LARGEST_AREA, LARGEST_SIDE};
use super::mapping::Mapping;
use super::texels::TexelMap;
use crate::error::WriteError;
use crate::files::replace;
use image::codecs::hdr::HdrEncoder;
use std::io;
use std::path::Path;

/// A picture of radiance, linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Texels along a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Texels row by row from the top, each row from the left.
    pub rgb: Vec<[f32; 3]>,
}

/// Texels that were no radiance and were replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Texels with a channel that was not finite; it is the mean of that channel's finite
    /// neighbours now, 0 where there are none.
    pub n_not_finite: u64,
    /// Other texels with a negative channel; it is 0 now.
    pub n_negative: u64,
}

/// Share of the texels in a corner beyond an angular map's disc that are black; the rest leaves
/// room for what compression and resampling leave there.
const BLACK_CORNER: f64 = 0.98;

/// How many of the four corners are black: many published maps have their title in one.
const N_BLACK_CORNERS: usize = 3;

/// Largest channel of a black texel, as a share of the picture's mean.
const BLACK: f64 = 1e-3;

impl Picture {
    /// Checks sides and length.
    pub(super) fn check(&self) -> Result<(), ProbeFault> {
        let (width, height) = (u64::from(self.width), u64::from(self.height));
        check_size(width, height)?;
        if self.rgb.len() as u64 != width * height {
            return Err(ProbeFault::Length { expected: width * height, found: self.rgb.len() });
        }
        Ok(())
    }

    /// The mapping if the picture has its shape.
    pub(super) fn fits(&self, mapping: Mapping) -> Result<Mapping, ProbeFault> {
        let (width, height) = (self.width, self.height);
        let (fits, expected) = match mapping {
            Mapping::LatLong => (true, "any shape"),
            Mapping::VerticalCross => (is_cross(width, height, 3, 4), "square faces, 3 by 4"),
            Mapping::HorizontalCross => (is_cross(width, height, 4, 3), "square faces, 4 by 3"),
            Mapping::Angular | Mapping::MirroredBall | Mapping::Octahedral => {
                (width == height, "a square")
            }
        };
        if fits {
            Ok(mapping)
        } else {
            Err(ProbeFault::Shape { mapping: mapping.name(), expected, width, height })
        }
    }

    /// The mapping that the picture's shape and corners tell.
    pub(super) fn detect(&self) -> Result<Mapping, ProbeFault> {
        let (width, height) = (self.width, self.height);
        if width == 2 * height {
            Ok(Mapping::LatLong)
        } else if is_cross(width, height, 3, 4) {
            Ok(Mapping::VerticalCross)
        } else if is_cross(width, height, 4, 3) {
            Ok(Mapping::HorizontalCross)
        } else if width == height && self.corners_are_black() {
            Ok(Mapping::Angular)
        } else if width == height {
            Ok(Mapping::Octahedral)
        } else {
            let names = Mapping::ALL.map(Mapping::name).join(", ");
            Err(ProbeFault::NoMapping { width, height, names })
        }
    }

    /// Whether what lies beyond the disc of a square is black, as angular maps have it but for a
    /// title.
    fn corners_are_black(&self) -> bool {
        // What is not finite counts as black: some programs write it where nothing is shown.
        let value = |rgb: &[f32; 3]| {
            rgb.iter().filter(|c| c.is_finite()).fold(0.0, |sum, &c| f64::max(sum, f64::from(c)))
        };
        let mean = self.rgb.iter().map(value).sum::<f64>() / self.rgb.len() as f64;
        let side = f64::from(self.width);
        // A texel's diagonal beyond the rim, which may be blurred.
        let rim = 1.0 + 2.0 * std::f64::consts::SQRT_2 / side;
        let place = |i: usize| (2 * i + 1) as f64 / side - 1.0;
        let (mut black, mut all) = ([0u64; 4], [0u64; 4]);
        for (i, rgb) in self.rgb.iter().enumerate() {
            let (x, y) = (i % self.width as usize, i / self.width as usize);
            if place(x).hypot(place(y)) > rim {
                let corner = usize::from(place(x) > 0.0) + 2 * usize::from(place(y) > 0.0);
                all[corner] += 1;
                black[corner] += u64::from(value(rgb) <= BLACK * mean);
            }
        }
        let is_black =
            |(&black, &all): (&u64, &u64)| all > 0 && black as f64 >= BLACK_CORNER * all as f64;
        black.iter().zip(&all).filter(|&pair| is_black(pair)).count() >= N_BLACK_CORNERS
    }

    /// Replaces what is no radiance; texels that show nothing become black where they are not
    /// finite or negative, and are not counted.
    pub(super) fn repair(&mut self, source: &TexelMap) -> Repairs {
        let mut repairs = Repairs::default();
        let bad = |c: &f32| !c.is_finite() || *c < 0.0;
        let found: Vec<usize> =
            (0..self.rgb.len()).filter(|&i| self.rgb[i].iter().any(bad)).collect();
        let mut mended = Vec::with_capacity(found.len());
        for &i in &found {
            let (x, y) = (i as u32 % self.width, i as u32 / self.width);
            let rgb = self.rgb[i];
            if !source.shows(x, y) {
                mended.push(rgb.map(|c| if bad(&c) { 0.0 } else { c }));
                continue;
            }
            if rgb.iter().all(|c| c.is_finite()) {
                repairs.n_negative += 1;
            } else {
                repairs.n_not_finite += 1;
            }
            mended.push(std::array::from_fn(|channel| {
                let c = rgb[channel];
                let c = if c.is_finite() { c } else { self.mean_around(source, x, y, channel) };
                c.max(0.0)
            }));
        }
        found.into_iter().zip(mended).for_each(|(i, rgb)| self.rgb[i] = rgb);
        repairs
    }

    /// Mean of a channel over the finite ones of the eight neighbours that show something.
    fn mean_around(&self, source: &TexelMap, x: u32, y: u32, channel: usize) -> f32 {
        let (mut sum, mut n) = (0.0, 0.0);
        for y in y.saturating_sub(1)..=(y + 1).min(self.height - 1) {
            for x in x.saturating_sub(1)..=(x + 1).min(self.width - 1) {
                let c = self.rgb[y as usize * self.width as usize + x as usize][channel];
                if c.is_finite() && source.shows(x, y) {
                    (sum, n) = (sum + f64::from(c), n + 1.0);
                }
            }
        }
        if n > 0.0 { (sum / n) as f32 } else { 0.0 }
    }
}

/// Checks that a picture has pixels, and not too many.
pub(super) fn check_size(width: u64, height: u64) -> Result<(), ProbeFault> {
    let allowed = 1..=u64::from(LARGEST_SIDE);
    if !allowed.contains(&width) || !allowed.contains(&height) {
        return Err(ProbeFault::Size { width, height });
    }
    if width * height > LARGEST_AREA {
        return Err(ProbeFault::Area { width, height });
    }
    Ok(())
}

fn is_cross(width: u32, height: u32, columns: u32, rows: u32) -> bool {
    width.is_multiple_of(columns) && width / columns * rows == height
}

/// Writes a picture as Radiance HDR, which keeps about two digits of each texel.
///
/// The file is written beside its target and renamed when it is complete, so that a failure or a
/// crash leaves what stood there before. What is not finite or negative is written as the format
/// can.
///
/// # Errors
/// Where the picture has another number of texels than its sides say, or the system refuses.
pub fn write_hdr(path: impl AsRef<Path>, picture: &Picture) -> Result<(), WriteError> {
    let path = path.as_ref();
    let failed = |error: io::Error| WriteError::Io { path: path.to_owned(), error };
    picture.check().map_err(|fault| failed(io::Error::other(fault.to_string())))?;
    let pixels: Vec<image::Rgb<f32>> = picture.rgb.iter().map(|&rgb| image::Rgb(rgb)).collect();
    let (width, height) = (picture.width as usize, picture.height as usize);
    replace(
        path,
        |file| {
            HdrEncoder::new(file).encode(&pixels, width, height).map_err(|error| match error {
                image::ImageError::IoError(error) => failed(error),
                other => failed(io::Error::other(other.to_string())),
            })
        },
        failed,
    )
}
