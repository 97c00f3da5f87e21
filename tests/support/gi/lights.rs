//! The virtual lights and shadow maps of a frame, as its debug pictures show them.

use super::hemisphere::{Axes, center_of, place_of, texel_of, width_at};
use super::{Bench, Set, int};
use anyhow::{Context as _, Result, ensure};
use glam::Vec3;
use surfelshop_api::graph::Output;
use surfelshop_image::Image;

/// Shadow maps' sides are multiples of this many texels.
const BLOCK: usize = 4;

/// A shadow's distance from what throws it over the root of points in a map, and the most of it, units
/// of the extent: as the renderer has them.
const THICKNESS: f32 = 1.0;
const THICKEST: f32 = 0.05;

/// The steepest slope that a texel's own depth is made up for, and how many texels' it is.
const STEEPEST: f32 = 8.0;
const TEXELS: f32 = 1.5;

/// A virtual light; lengths in units of the extent.
#[derive(Clone, Copy, Debug)]
pub struct Vpl {
    /// Where it is, from the scene's origin.
    pub position: Vec3,
    /// Unit, on the side that is lit.
    pub normal: Vec3,
    /// The light that it reflects, as a grey.
    pub power: f32,
    /// Whether it shines.
    pub alive: bool,
}

/// The lights of a first bounce and their shadow maps.
#[derive(Clone, Debug)]
pub struct Maps {
    /// The lights.
    pub lights: Vec<Vpl>,
    /// Texels on a side of a map.
    pub side: usize,
    /// One over the distance, units of the extent; 0 where nothing is. Map by map, row by row.
    pub texels: Vec<f32>,
    /// Surfels that went over all maps.
    pub n_points: usize,
}

/// Reads the lights of a picture `debug.vpls`.
fn lights_of(picture: &Image, n: u32, extent: f32) -> Vec<Vpl> {
    let vector = |i: u32, row: u32| {
        let pixel = picture.pixel(i % picture.width, i / picture.width * 5 + row);
        (Vec3::from_slice(pixel), pixel[3])
    };
    let light = |i| {
        let ((position, alive), (normal, _)) = (vector(i, 0), vector(i, 1));
        let power = (vector(i, 2).0 * vector(i, 3).0).element_sum() / 3.0;
        Vpl { position: position / extent, normal, power, alive: alive > 0.0 }
    };
    (0..n).map(light).collect()
}

/// Reads the maps of a picture `debug.ism` or `debug.ism-points`.
fn texels_of(picture: &Image, n: usize, side: usize) -> Result<Vec<f32>> {
    let columns = picture.width as usize / side;
    ensure!(columns > 0 && n.div_ceil(columns) * side <= picture.height as usize, "all maps fit");
    let mut texels = Vec::with_capacity(n * side * side);
    for map in 0..n {
        let [left, top] = [map % columns * side, map / columns * side];
        for y in top..top + side {
            texels.extend((left..left + side).map(|x| picture.pixel(x as u32, y as u32)[0]));
        }
    }
    Ok(texels)
}

impl Maps {
    /// Draws the maps of `n` lights as the renderer fills them, and as surfels left them.
    ///
    /// # Errors
    /// Those of drawing, or where the bench's picture is too small for all maps.
    pub fn drawn(
        bench: &mut Bench,
        n: u32,
        size: u32,
        points: u32,
        levels: u32,
    ) -> Result<[Self; 2]> {
        let sets: [Set<'_>; 6] = [
            ("bounces", int(1)),
            ("frames", int(1)),
            ("vpls", int(n)),
            ("ism-size", int(size)),
            ("ism-points", int(points)),
            ("pull-push", int(levels)),
        ];
        let outputs = ["vpls", "ism", "ism-points"].map(|name| Output::Debug(name.to_owned()));
        let drawn = bench.draw(&sets, &outputs, 0)?;
        let picture = |i: usize| drawn.image(&outputs[i]).context("no such picture");
        let lights = lights_of(picture(0)?, n, bench.extent());
        let side = (f64::from(size).powi(2) / f64::from(n)).sqrt() as usize;
        let side = (side / BLOCK).max(1) * BLOCK;
        let n_surfels = bench.cloud.len();
        let n_points = n_surfels.div_ceil(n_surfels.div_ceil(points as usize).max(1));
        let maps = |i: usize| -> Result<Self> {
            let texels = texels_of(picture(i)?, n as usize, side)?;
            Ok(Self { lights: lights.clone(), side, texels, n_points })
        };
        Ok([maps(1)?, maps(2)?])
    }

    /// How far behind what throws it a shadow begins, units of the extent.
    #[must_use]
    pub fn thickness(&self) -> f32 {
        let per_map = self.n_points as f32 / self.lights.len().max(1) as f32;
        (THICKNESS / per_map.sqrt()).min(THICKEST)
    }

    /// Whether what lies at a distance in a direction of a light is seen from there, as
    /// `shade.wgsl` decides, with a thickness of so many extents and a factor on what a texel's
    /// width leaves open.
    #[must_use]
    pub fn is_seen(
        &self,
        map: usize,
        direction: Vec3,
        distance: f32,
        receiver_cosine: f32,
        bias: [f32; 2],
    ) -> bool {
        let local = Axes::around(self.lights[map].normal).local(direction);
        let place = place_of(local);
        let [x, y] = texel_of(place, self.side);
        let near = self.texels[(map * self.side + y) * self.side + x];
        let sine = (1.0 - (receiver_cosine * receiver_cosine).min(1.0)).sqrt();
        let slope = (sine / receiver_cosine).min(STEEPEST);
        let wide = TEXELS * distance * width_at(place, self.side);
        let open = bias[1] * wide * slope + bias[0];
        near <= 0.0 || 1.0 / near >= distance - open
    }

    /// The share of the texels within the circle in which nothing is, of lights that shine.
    #[must_use]
    pub fn empty(&self) -> f64 {
        let area = self.side * self.side;
        let (mut empty, mut all) = (0usize, 0usize);
        for (map, light) in self.lights.iter().enumerate() {
            for (i, near) in self.texels[map * area..(map + 1) * area].iter().enumerate() {
                let center = center_of(i % self.side, i / self.side, self.side);
                if light.alive && center.length_squared() <= 1.0 {
                    all += 1;
                    empty += usize::from(*near <= 0.0);
                }
            }
        }
        empty as f64 / all.max(1) as f64
    }
}
