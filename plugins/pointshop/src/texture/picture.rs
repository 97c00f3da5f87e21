//! A picture in linear light, at full size and at halves of it.

use std::path::Path;
use surfelshop_api::glam::{DVec2, Vec4};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::*;

/// Most pixels of a side: a file may claim what no memory holds.
const MOST_SIDE: u32 = 16_384;

/// One size of the picture.
struct Level {
    width: usize,
    height: usize,
    /// Linear light times opacity, and opacity.
    pixels: Vec<Vec4>,
}

/// A picture.
pub(crate) struct Picture {
    /// The largest first.
    levels: Vec<Level>,
}

impl Picture {
    /// Reads a PNG or JPEG file.
    ///
    /// # Errors
    /// Where it is none, or too large.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let name = path.display();
        let wrong = |error: &dyn std::fmt::Display| {
            Error::new(format!("{name}: expected a PNG or JPEG picture, found {error}"))
        };
        let mut reader = image::ImageReader::open(path)
            .and_then(image::ImageReader::with_guessed_format)
            .map_err(|error| wrong(&error))?;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MOST_SIDE);
        limits.max_image_height = Some(MOST_SIDE);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|error| wrong(&error))?.into_rgba16();
        let (width, height) = (decoded.width() as usize, decoded.height() as usize);
        let share = |code: u16| f32::from(code) / 65535.0;
        let pixels = decoded.pixels().map(|pixel| {
            let [r, g, b, a] = pixel.0.map(share);
            let [r, g, b] = [r, g, b].map(srgb_to_linear);
            Vec4::new(r * a, g * a, b * a, a)
        });
        let mut levels = vec![Level { width, height, pixels: pixels.collect() }];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
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
        let fine = self.levels[below].at(share);
        let coarse = self.levels.get(below + 1).map_or(fine, |level| level.at(share));
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
        Self { width, height, pixels: (0..width * height).map(mean).collect() }
    }

    /// Between the four pixels around a place in shares of the sides, from the upper left corner.
    fn at(&self, share: DVec2) -> Vec4 {
        let along = |share: f64, n: usize| {
            let at = (share * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
            (at.floor() as usize, at.fract() as f32)
        };
        let ((x, u), (y, v)) = (along(share.x, self.width), along(share.y, self.height));
        let row = |y: usize| self.pixel(x, y).lerp(self.pixel(x + 1, y), u);
        row(y).lerp(row(y + 1), v)
    }
}
