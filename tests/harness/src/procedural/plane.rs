//! Patterns on a plane that fills the picture, with what they look like over each pixel.

use super::patterns::Settings;
use crate::clouds::Surfels;
use crate::stage;
use anyhow::{Context as _, Result};
use glam::{DQuat, DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_engine::{Engine, PassReport, RenderRequest, RendererView};

/// Radius of the disc that is the plane, scene units.
const RADIUS: f32 = 8192.0;

/// Samples along a pixel of the reference.
pub const SAMPLES: u32 = 16;

/// The renderer over one surfel, so large that it is a plane.
pub struct Plane {
    /// The device side.
    pub engine: Engine,
    renderer: RendererView,
    cloud: Cloud,
}

/// Where the plane is seen from.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// From the eye to the plane, scene units.
    pub distance: f64,
    /// Between the direction of view and the plane's normal, radians.
    pub tilt: f64,
    /// Pixels along the picture.
    pub size: u32,
}

/// A picture, linear radiance, row by row, and its passes.
pub struct Picture {
    /// The pixels.
    pub pixels: Vec<Vec3>,
    /// What was drawn.
    pub passes: Vec<PassReport>,
}

impl Plane {
    /// A plane and the renderer on the default adapter.
    #[must_use]
    pub fn new() -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-procedural", "procedural");
        let mut surfels = Surfels::default();
        surfels.push(Vec3::ZERO, Vec3::Z, RADIUS);
        Self { engine, renderer, cloud: surfels.cloud() }
    }

    /// The plane in a picture.
    ///
    /// # Errors
    /// Where it cannot be rendered, or does not fill the picture.
    pub fn picture(&mut self, sight: Sight, values: &Values) -> Result<Picture> {
        // Off the middle, so that no lattice stands symmetrically in the picture.
        let target = DVec3::new(0.137, 0.071, 0.0);
        let away = DQuat::from_rotation_x(-sight.tilt) * DVec3::Z;
        let camera = Camera {
            eye: target + sight.distance * away,
            target,
            up: DVec3::Y,
            projection: Projection::Perspective { fov_y: 0.4 },
        };
        let near = 1e-3 * sight.distance;
        let view = View { camera, size_px: [sight.size; 2], near, far: 1e3 * sight.distance };
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &Scene::default(),
            view,
            values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: None,
            stride: 1,
        };
        let rendered = self.engine.render(&mut self.renderer, &request)?;
        let color = rendered.image(&Output::Color).context("there is no picture")?;
        let texels = color.data.as_chunks::<4>().0;
        anyhow::ensure!(texels.iter().all(|texel| texel[3] > 0.0), "the plane is not everywhere");
        let pixels = texels.iter().map(|texel| Vec3::from_slice(texel)).collect();
        Ok(Picture { pixels, passes: rendered.passes })
    }

    /// What the pixels of a picture see: the mean over [`SAMPLES`] squared points of each, without a
    /// filter.
    ///
    /// # Errors
    /// Where it cannot be rendered.
    pub fn truth(&mut self, sight: Sight, values: &Values) -> Result<Vec<Vec3>> {
        let mut values = values.clone();
        values.insert("filter".to_owned(), Value::Bool(false));
        let fine = Sight { size: sight.size * SAMPLES, ..sight };
        let picture = self.picture(fine, &values)?;
        let (n, k) = (sight.size as usize, SAMPLES as usize);
        let mean = |pixel: usize| {
            let (x, y) = (pixel % n * k, pixel / n * k);
            let row = |row: usize| &picture.pixels[row * n * k + x..][..k];
            (y..y + k).flat_map(row).sum::<Vec3>() / (k * k) as f32
        };
        Ok((0..n * n).map(mean).collect())
    }
}

impl Default for Plane {
    fn default() -> Self {
        Self::new()
    }
}

/// The parameters of a pattern, unlit, with so many cells of the coarsest noise per scene unit.
#[must_use]
pub fn unlit(settings: &Settings, pattern: &str, cells_per_unit: f32) -> Values {
    let settings = Settings { frequency: cells_per_unit * 2.0 * RADIUS, ..*settings };
    let mut values = settings.values(pattern);
    values.insert("lighting".to_owned(), Value::Text("none".to_owned()));
    // No lattice lies in the plane.
    values.insert("rotation-x".to_owned(), Value::Float(25.0));
    values.insert("rotation-y".to_owned(), Value::Float(40.0));
    values
}

/// The root of the mean square of the differences of two pictures, over all channels.
#[must_use]
pub fn rmse(a: &[Vec3], b: &[Vec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a.distance_squared(*b)));
    (squares.sum::<f64>() / (3 * a.len().max(1)) as f64).sqrt()
}
