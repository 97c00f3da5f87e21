//! Pictures of splats against the samples' own, path traced.

use super::views_around;
use crate::stage;
use anyhow::{Context as _, Result};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{FrameRequest, Light, Scene, SurfaceSettings, UnitKind, View};
use surfelshop_cloud::Cloud;
use surfelshop_image::Image;
use surfelshop_image::TracedPicture;
use surfelshop_image::metrics::{Settings, compare};
use surfelshop_render::{Engine, Rendered, RendererView};
use surfelshop_runtime::plugins::Timeouts;
use surfelshop_runtime::trace::{TraceOrder, trace};

/// The renderer's modes, the paper's first.
pub const MODES: [&str; 4] = ["phong", "averaged", "blended", "flat"];

/// Directions that models are seen from.
const DIRECTIONS: [[f64; 3]; 3] = [[0.3, 0.3, 1.0], [-1.0, 0.2, -0.4], [0.2, 1.0, -0.7]];

/// How far pictures of splats are from those of the samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quality {
    /// Mean FLIP of all views against the path-traced samples.
    pub flip: f64,
    /// Root mean square angle between normals where both cover a pixel, degrees.
    pub normal_degrees: f64,
}

/// A model as samples, seen from several sides.
pub struct Bench {
    /// The engine that draws.
    pub engine: Engine,
    /// The renderer `phong-splatting`.
    pub splatting: RendererView,
    /// The renderer `ewa-phong`.
    pub baseline: RendererView,
    /// The model.
    pub samples: Cloud,
    /// The scene: a light at the camera, which throws no shadows that it could see, on surfaces of one
    /// side, as the paper has it for closed models: splats just behind a silhouette are not seen.
    pub scene: Scene,
    views: Vec<View>,
    traced: Vec<TracedPicture>,
    normals: Vec<Image>,
    depths: Vec<Image>,
}

impl Bench {
    /// Traces a model in pictures of this size.
    ///
    /// # Errors
    /// Those of drawing and tracing.
    pub fn new(samples: Cloud, size: u32, paths: u32) -> Result<Self> {
        let engine = stage::fresh_engine();
        let library = "surfelshop-phong-splatting";
        let splatting = stage::built_renderer(&engine, library, "phong-splatting");
        let baseline = stage::built_renderer(&engine, "surfelshop-ewa-phong", "ewa-phong");
        let light =
            Light::Directional { towards: DVec3::Z, radiance: Vec3::ONE, follows_camera: true };
        let surface = SurfaceSettings { two_sided: false, ..SurfaceSettings::default() };
        let scene = Scene { lights: vec![light], surface, ..Scene::default() };
        let mut bench = Self {
            engine,
            splatting,
            baseline,
            samples,
            scene,
            views: Vec::new(),
            traced: Vec::new(),
            normals: Vec::new(),
            depths: Vec::new(),
        };
        bench.views = views_around(&bench.samples, DIRECTIONS, size);
        for view in bench.views.clone() {
            bench.traced.push(bench.trace(view, paths)?);
            let samples = bench.samples.clone();
            let outputs = [Output::Normal, Output::Depth];
            let drawn = bench.draw(&samples, view, "averaged", &outputs)?;
            bench.normals.push(drawn.image(&Output::Normal).context("no normals")?.clone());
            bench.depths.push(drawn.image(&Output::Depth).context("no depths")?.clone());
        }
        Ok(bench)
    }

    fn trace(&self, view: View, paths: u32) -> Result<TracedPicture> {
        let unit = stage::built_unit("surfelshop-reference", UnitKind::Tracer, "reference");
        let text = |value: &str| Value::Text(value.to_owned());
        let values: Values = [
            ("mode", text("direct")),
            ("model", text("phong")),
            ("samples", Value::Int(i64::from(paths))),
        ]
        .map(|(id, value)| (id.to_owned(), value))
        .into();
        let order = TraceOrder {
            request: FrameRequest {
                view,
                scene: self.scene.clone(),
                cloud: self.samples.facts().clone(),
                frame_index: 0,
                values,
                environment: None,
            },
            clouds: vec![self.samples.clone()],
            texels: Arc::default(),
            samples: paths,
            threads: 0,
        };
        trace(&unit, order, &Timeouts::default(), |_| true).map_err(anyhow::Error::msg)
    }

    /// Draws a cloud in one of the modes.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn draw(
        &mut self,
        cloud: &Cloud,
        view: View,
        mode: &str,
        outputs: &[Output],
    ) -> Result<Rendered> {
        let values: Values = [
            ("mode".to_owned(), Value::Text(mode.to_owned())),
            ("ambient".to_owned(), Value::Float(0.0)),
        ]
        .into();
        let (engine, renderer, scene) = (&mut self.engine, &mut self.splatting, &self.scene);
        Ok(stage::render_with(engine, renderer, cloud, scene, view, &values, outputs)?)
    }

    /// Milliseconds that a frame of the first view takes, drawn anew, in a mode or by `ewa-phong`.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn time(&mut self, cloud: &Cloud, mode: &str) -> Result<f64> {
        self.engine.forget_surfaces();
        let started = Instant::now();
        match mode {
            "ewa-phong" => {
                let (engine, renderer) = (&mut self.engine, &mut self.baseline);
                let color = [Output::Color];
                stage::render(engine, renderer, cloud, &self.scene, self.views[0], &color)?;
            }
            _ => drop(self.draw(cloud, self.views[0], mode, &[Output::Color])?),
        }
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }

    /// The views.
    #[must_use]
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// A traced picture of the samples.
    #[must_use]
    pub fn traced(&self, view: usize) -> &TracedPicture {
        &self.traced[view]
    }

    /// How far pictures of splats are from those of the samples.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn quality(&mut self, splats: &Cloud, mode: &str) -> Result<Quality> {
        let mut found = Quality::default();
        let (mut squares, mut n) = (0.0, 0.0);
        for (i, view) in self.views.clone().into_iter().enumerate() {
            let drawn = self.draw(splats, view, mode, &[Output::Color, Output::Normal])?;
            let color = drawn.image(&Output::Color).context("no colours")?;
            let compared = compare(color, &self.traced[i], &Settings::default())?;
            let errors = compared.errors.context("pictures are finite")?;
            found.flip += errors.flip.mean / self.views.len() as f64;
            let normals = drawn.image(&Output::Normal).context("no normals")?;
            let pairs = normals.data.chunks_exact(4).zip(self.normals[i].data.chunks_exact(4));
            for (own, other) in pairs.filter(|(own, other)| own[3] > 0.0 && other[3] > 0.0) {
                let angle = Vec3::from_slice(own).angle_between(Vec3::from_slice(other));
                squares += f64::from(angle.to_degrees()).powi(2);
                n += 1.0;
            }
        }
        found.normal_degrees = (squares / f64::max(n, 1.0)).sqrt();
        Ok(found)
    }

    /// Pixels inside of the samples' silhouettes, farther from their edges than a tolerance in scene units,
    /// that no splat covers, or through which something far behind the samples is seen; of surfaces of two
    /// sides, as they are drawn unless a scene says otherwise.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn holes(&mut self, splats: &Cloud, tolerance: f64) -> Result<usize> {
        self.scene.surface.two_sided = true;
        let mut found = 0;
        for (i, view) in self.views.clone().into_iter().enumerate() {
            let drawn = self.draw(splats, view, "flat", &[Output::Depth])?;
            let drawn = drawn.image(&Output::Depth).context("no depths")?;
            // How far the tolerance, and a pixel, may move the silhouette where it is nearest.
            let [_, half_y] = view.half_extent();
            let facts = self.samples.facts();
            let reach = 0.5 * (facts.bounds_max - facts.bounds_min).length();
            let distance = view.camera.eye.distance(view.camera.target) - reach;
            let pixels = tolerance / distance / half_y * 0.5 * f64::from(view.size_px[1]);
            let behind = 10.0 * tolerance + BEHIND * reach;
            found += holes(drawn, &self.depths[i], pixels.ceil() as i64 + 1, behind as f32);
        }
        self.scene.surface.two_sided = false;
        Ok(found)
    }
}

/// Bytes that a surfel takes where it is drawn in a mode of the renderer, and nothing else is.
///
/// # Errors
/// Those of drawing.
pub fn bytes_each(cloud: &Cloud, mode: &str) -> Result<f64> {
    let mut engine = stage::fresh_engine();
    let library = "surfelshop-phong-splatting";
    let mut renderer = stage::built_renderer(&engine, library, "phong-splatting");
    let view = stage::view(DVec3::splat(9.0), DVec3::ZERO, 64);
    let values = [("mode".to_owned(), Value::Text(mode.to_owned()))].into();
    let (scene, color) = (Scene::default(), [Output::Color]);
    stage::render_with(&mut engine, &mut renderer, cloud, &scene, view, &values, &color)?;
    let counts = engine.counters();
    Ok((counts.column_bytes + counts.host_column_bytes) as f64 / cloud.len() as f64)
}

/// How far behind the samples, in half diagonals and besides ten tolerances, something is that is seen
/// through a hole: farther than splats seen at a flat angle reach, and nearer than the other side.
const BEHIND: f64 = 0.1;

/// Pixels whose depth one picture does not have, or has by so much behind the other's, which has all of
/// their neighbours within so many pixels at about one depth.
fn holes(drawn: &Image, whole: &Image, margin: i64, behind: f32) -> usize {
    let [width, height] = [i64::from(drawn.width), i64::from(drawn.height)];
    let depth = |image: &Image, x: i64, y: i64| {
        let inside = (0..width).contains(&x) && (0..height).contains(&y);
        if inside { image.pixel(x as u32, y as u32)[0] } else { 0.0 }
    };
    let all = (0..width * height).map(|i| (i % width, i / width));
    let is_hole = |&(x, y): &(i64, i64)| {
        let around =
            (-margin..=margin).flat_map(|dy| (-margin..=margin).map(move |dx| (x + dx, y + dy)));
        let (own, expected) = (depth(drawn, x, y), depth(whole, x, y));
        let is_near = |(x, y): (i64, i64)| {
            let other = depth(whole, x, y);
            other > 0.0 && (other - expected).abs() < behind
        };
        (own <= 0.0 || own > expected + behind) && around.into_iter().all(is_near)
    };
    all.filter(is_hole).count()
}
