//! A picture in linear light, at full size and at halves of it.

use image::{DynamicImage, ImageDecoder as _, ImageFormat};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;
use surfelshop_api::glam::{DVec2, Vec3, Vec4};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::*;

/// Most pixels of a side, and in all: a file may claim what no memory holds. A pixel takes some 30 bytes meanwhile.
const MOST_SIDE: u32 = 32_768;
const MOST_PIXELS: u64 = 64 << 20;

/// One size of the picture.
struct Level {
    /// How many times as wide its pixels are as those of the largest.
    step: f64,
    width: usize,
    height: usize,
    /// Linear light times opacity, and opacity.
    pixels: Vec<Vec4>,
}

/// What tells whether a file is as it was.
#[derive(PartialEq)]
struct FileState {
    path: PathBuf,
    modified: SystemTime,
    length: u64,
}

/// A picture.
pub(crate) struct Picture {
    /// The largest first.
    levels: Vec<Level>,
}

impl Picture {
    /// The same picture as the last time, where its file is as it was: a hand that leads a tool asks again and again.
    ///
    /// # Errors
    /// As [`Picture::read`].
    pub(crate) fn read_once(path: &Path, job: &Job<'_>) -> Result<Arc<Self>> {
        static LAST: Mutex<Option<(FileState, Arc<Picture>)>> = Mutex::new(None);
        let state = fs::metadata(path).ok().and_then(|file| {
            Some(FileState {
                path: path.to_owned(),
                modified: file.modified().ok()?,
                length: file.len(),
            })
        });
        let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, picture)) = &*last
            && Some(known) == state.as_ref()
        {
            return Ok(Arc::clone(picture));
        }
        let picture = Arc::new(Self::read(path, job)?);
        *last = state.map(|state| (state, Arc::clone(&picture)));
        Ok(picture)
    }

    /// Reads a PNG or JPEG file.
    ///
    /// # Errors
    /// Where it is none, or too large, and where the job is to stop.
    pub(crate) fn read(path: &Path, job: &Job<'_>) -> Result<Self> {
        let name = path.display();
        let wrong = |error: &dyn std::fmt::Display| {
            Error::new(format!("{name}: expected a PNG or JPEG picture, found {error}"))
        };
        let mut reader = image::ImageReader::open(path)
            .and_then(image::ImageReader::with_guessed_format)
            .map_err(|error| wrong(&error))?;
        match reader.format() {
            Some(ImageFormat::Png | ImageFormat::Jpeg) => {}
            _ => return Err(wrong(&"another kind of file")),
        }
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MOST_SIDE);
        limits.max_image_height = Some(MOST_SIDE);
        limits.max_alloc = Some(8 * MOST_PIXELS);
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(|error| wrong(&error))?;
        let (width, height) = decoder.dimensions();
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            let found = format!("{width} x {height} pixels, of at most {MOST_PIXELS} in all");
            return Err(wrong(&found));
        }
        // As a camera was held.
        let orientation = decoder.orientation().map_err(|error| wrong(&error))?;
        let mut decoded = DynamicImage::from_decoder(decoder).map_err(|error| wrong(&error))?;
        decoded.apply_orientation(orientation);
        let decoded = decoded.into_rgba16();
        job.check()?;
        let (width, height) = (decoded.width() as usize, decoded.height() as usize);
        let share = |code: u16| f32::from(code) / 65535.0;
        let light: Vec<f32> = (0..=u16::MAX).map(|code| srgb_to_linear(share(code))).collect();
        let pixels = decoded.pixels().map(|pixel| {
            let [r, g, b, a] = pixel.0;
            let [r, g, b] = [r, g, b].map(|code| light[usize::from(code)]);
            Vec3::new(r, g, b).extend(1.0) * share(a)
        });
        let pixels = pixels.collect();
        let mut levels = vec![Level { step: 1.0, width, height, pixels }];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
            job.check()?;
            levels.push(last.halved());
        }
        Ok(Self { levels })
    }

    /// Width over height.
    pub(crate) fn aspect(&self) -> f64 {
        self.levels.first().map_or(1.0, |level| level.width as f64 / level.height as f64)
    }

    /// Linear light and opacity at a place, to the right and upwards in heights of the picture, as seen over a width in
    /// the same units; none outside.
    pub(crate) fn at(&self, place: DVec2, width: f64) -> Option<Vec4> {
        let largest = self.levels.first()?;
        let share = DVec2::new(place.x / self.aspect(), 1.0 - place.y);
        if !(share.cmpge(DVec2::ZERO).all() && share.cmple(DVec2::ONE).all()) {
            return None;
        }
        // A level whose pixels are as wide as what is seen.
        let level = (width * largest.height as f64).max(1.0).log2();
        let level = level.min((self.levels.len() - 1) as f64);
        let (below, part) = (level.floor() as usize, level.fract() as f32);
        let pixel = share * DVec2::new(largest.width as f64, largest.height as f64);
        let fine = self.levels[below].at(pixel);
        let coarse = self.levels.get(below + 1).map_or(fine, |level| level.at(pixel));
        let seen = fine.lerp(coarse, part);
        let light = if seen.w > 0.0 { seen.truncate() / seen.w } else { seen.truncate() };
        Some(light.extend(seen.w))
    }
}

impl Level {
    fn pixel(&self, x: usize, y: usize) -> Vec4 {
        self.pixels[y.min(self.height - 1) * self.width + x.min(self.width - 1)]
    }

    /// Half as large, each pixel the mean of four.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mean = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let row = |y: usize| self.pixel(x, y) + self.pixel(x + 1, y);
            0.25 * (row(y) + row(y + 1))
        };
        let pixels = (0..width * height).map(mean).collect();
        Self { step: 2.0 * self.step, width, height, pixels }
    }

    /// Between the four pixels around a place, in pixels of the largest level from the upper left corner.
    fn at(&self, pixel: DVec2) -> Vec4 {
        let along = |pixel: f64, n: usize| {
            let at = (pixel / self.step - 0.5).clamp(0.0, (n - 1) as f64);
            (at.floor() as usize, at.fract() as f32)
        };
        let ((x, u), (y, v)) = (along(pixel.x, self.width), along(pixel.y, self.height));
        let row = |y: usize| self.pixel(x, y).lerp(self.pixel(x + 1, y), u);
        row(y).lerp(row(y + 1), v)
    }
}
