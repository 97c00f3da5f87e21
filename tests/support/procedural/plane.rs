//! Patterns on a plane that fills the picture, with what they look like over each pixel.

use super::noise::Place;
use super::patterns::Settings;
use crate::clouds::Surfels;
use crate::stage::{self, PooledEngine};
use anyhow::{Context as _, Result};
use glam::{DQuat, DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{PassReport, RenderRequest, RendererView};

/// Radius of the disc that is the plane, scene units.
const RADIUS: f32 = 8192.0;

/// How the pattern is turned about x and y, degrees.
const TURN: [f64; 2] = [25.0, 40.0];

/// Samples along a pixel of the reference.
pub const SAMPLES: u32 = 16;

/// A pattern of one's own that is the sum of octaves as it is.
pub const SUM: &str = "
#import surfelshop::noise::Place
#import procedural::pattern::{Look, fbm}
fn look(at: Place, albedo: vec3<f32>) -> Look {
    return Look(vec3(0.5 + 0.5 * fbm(at).mean), 0.0, 1.0, 0.0);
}";

/// The same, computed with the volume's period, without a filter.
pub const PERIODIC: &str = "
#import surfelshop::noise::{Place, Seed}
#import surfelshop::noise as gradients
#import procedural::pattern::{Look, settings}
fn look(at: Place, albedo: vec3<f32>) -> Look {
    var sum = 0.0;
    var f = vec3(settings.frequency);
    var contrast = settings.to_one_octave;
    for (var k = 0u; k < settings.n_octaves; k++) {
        let by = f32(k) * vec3(5.375, 9.703125, 13.140625);
        let l = gradients::moved(gradients::lattice(at, f), by);
        sum += contrast * gradients::scalar(l, Seed(settings.key, 15u));
        f *= settings.lacunarity;
        contrast *= settings.gain;
    }
    return Look(vec3(0.5 + 0.5 * sum), 0.0, 1.0, 0.0);
}";

/// The renderer over one surfel, so large that it is a plane.
pub struct Plane {
    /// The device side.
    pub engine: PooledEngine,
    renderer: RendererView,
    cloud: Cloud,
}

/// Where the plane is seen from.
#[derive(Clone, Copy, Debug)]
pub struct PatternView {
    /// From the eye to the plane, scene units.
    pub distance: f64,
    /// Between the direction of view and the plane's normal, radians.
    pub tilt: f64,
    /// Pixels along the picture.
    pub size: u32,
}

impl PatternView {
    fn view(&self) -> View {
        // Off the middle, so that no lattice stands symmetrically in the picture.
        let target = self.distance.min(1.0) * DVec3::new(0.137, 0.071, 0.0);
        let away = DQuat::from_rotation_x(-self.tilt) * DVec3::Z;
        let camera = Camera {
            eye: target + self.distance * away,
            target,
            up: DVec3::Y,
            projection: Projection::Perspective { fov_y: 0.4 },
        };
        let near = 1e-3 * self.distance;
        View { camera, size_px: [self.size; 2], near, far: 1e3 * self.distance }
    }
}

/// A picture, linear radiance, row by row, and its passes.
pub struct Picture {
    /// The pixels.
    pub pixels: Vec<Vec3>,
    /// What was drawn.
    pub passes: Vec<PassReport>,
}

impl Plane {
    /// The largest extent of its box, scene units.
    pub const SIZE: f32 = 2.0 * RADIUS;

    /// A plane and the renderer on the default adapter.
    #[must_use]
    pub fn new() -> Self {
        let mut surfels = Surfels::default();
        surfels.push(Vec3::ZERO, Vec3::Z, RADIUS);
        Self::of(&surfels)
    }

    /// The same box around a disc of this radius, for looks so close that the plane itself would be
    /// drawn inexactly.
    #[must_use]
    pub fn close(radius: f32) -> Self {
        let mut surfels = Surfels::default();
        surfels.push(Vec3::ZERO, Vec3::Z, radius);
        surfels.push(Vec3::X * RADIUS, Vec3::Z, radius);
        surfels.push(Vec3::X * -RADIUS, Vec3::Z, radius);
        Self::of(&surfels)
    }

    fn of(surfels: &Surfels) -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-procedural", "procedural");
        Self { engine, renderer, cloud: surfels.cloud() }
    }

    /// Where the centre of a pixel lies in the pattern of [`unlit`], in f64.
    #[must_use]
    pub fn place(sight: PatternView, pixel: [u32; 2]) -> Place {
        let view = sight.view();
        let [half_x, half_y] = view.half_extent();
        let ndc = |k: usize| (2.0 * f64::from(pixel[k]) + 1.0) / f64::from(sight.size) - 1.0;
        let in_view = DVec3::new(ndc(0) * half_x, -ndc(1) * half_y, -1.0);
        let ray = view.camera.view_from_world().transpose() * in_view;
        let eye = view.camera.eye;
        let on_plane = eye - ray * (eye.z / ray.z);
        let in_box = on_plane / (2.0 * f64::from(RADIUS));
        let turn = DQuat::from_rotation_y(TURN[1].to_radians())
            * DQuat::from_rotation_x(TURN[0].to_radians());
        let [across, along, jitter] = [DVec3::ZERO; 3];
        Place { position: turn.inverse() * in_box + 0.5, across, along, jitter }
    }

    /// The plane in a picture.
    ///
    /// # Errors
    /// Where it cannot be rendered, or does not fill the picture.
    pub fn picture(&mut self, sight: PatternView, values: &Values) -> Result<Picture> {
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &Scene::default(),
            view: sight.view(),
            values,
            outputs: &[Output::Color],
            frame_index: 0,
            environment: None,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
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
    pub fn truth(&mut self, sight: PatternView, values: &Values) -> Result<Vec<Vec3>> {
        let mut values = values.clone();
        values.insert("filter".to_owned(), Value::Bool(false));
        let fine = PatternView { size: sight.size * SAMPLES, ..sight };
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
    let settings = Settings { frequency: cells_per_unit * Plane::SIZE, ..*settings };
    let mut values = settings.values(pattern);
    values.insert("lighting".to_owned(), Value::Text("none".to_owned()));
    // No lattice lies in the plane.
    values.insert("rotation-x".to_owned(), Value::Float(TURN[0]));
    values.insert("rotation-y".to_owned(), Value::Float(TURN[1]));
    values
}

/// The root of the mean square of the differences of two pictures, over all channels.
#[must_use]
pub fn rmse(a: &[Vec3], b: &[Vec3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a.distance_squared(*b)));
    (squares.sum::<f64>() / (3 * a.len().max(1)) as f64).sqrt()
}
