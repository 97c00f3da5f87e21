//! How well the renderer `global-illumination` does: its shadow maps against rays, its passes' times,
//! and its pictures against paths.

mod error;
mod hemisphere;
mod lights;
mod rules;
mod times;
mod visibility;

pub use error::{Error, bias, blurred, error, less, relative};
pub use lights::{Maps, Vpl};
pub use rules::{Rules, Surfels};
pub use times::{Times, Timing, quartiles};
pub use visibility::{Errors, Pairs, Receiver, receivers};

use crate::stage::{self, PooledEngine};
use anyhow::Result;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Light, Scene, View};
use surfelshop_assets::cornell::cornell_scene;
use surfelshop_cloud::Cloud;
use surfelshop_render::{RenderRequest, Rendered, RendererView};

/// A parameter's value.
pub type Set<'a> = (&'a str, Value);

/// A whole number as a parameter.
#[must_use]
pub fn int(value: u32) -> Value {
    Value::Int(i64::from(value))
}

/// A choice as a parameter.
#[must_use]
pub fn text(value: &str) -> Value {
    Value::Text(value.to_owned())
}

/// The parameters of these names.
#[must_use]
pub fn values(sets: &[Set<'_>]) -> Values {
    sets.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

/// The renderer in front of a cloud.
pub struct Bench {
    /// The engine that draws.
    pub engine: PooledEngine,
    /// The renderer `global-illumination`.
    pub renderer: RendererView,
    /// The cloud.
    pub cloud: Cloud,
    /// Its light.
    pub scene: Scene,
    /// Where it is looked at from.
    pub view: View,
    /// One surfel of so many is drawn.
    pub stride: u32,
}

impl Bench {
    /// A cloud in the Cornell box's light and camera, in pictures of this many pixels on a side.
    #[must_use]
    pub fn new(cloud: Cloud, size: u32) -> Self {
        let engine = stage::engine();
        let library = "surfelshop-global-illumination";
        let renderer = stage::built_renderer(&engine, library, "global-illumination");
        let (scene, view) = cornell_view(size);
        Self { engine, renderer, cloud, scene, view, stride: 1 }
    }

    /// A scan with y upwards, in front of the camera and lit by a spot from the upper left.
    #[must_use]
    pub fn scan(cloud: Cloud, size: u32) -> Self {
        let facts = cloud.facts();
        let target = 0.5 * (facts.bounds_min + facts.bounds_max);
        let half = 0.5 * (facts.bounds_max - facts.bounds_min).length();
        let eye = target + DVec3::new(0.3, 0.2, 2.6) * half;
        let position = target + DVec3::new(-0.8, 1.1, 1.3) * half;
        // White surfaces that it falls on straight have a radiance of about 1.
        let intensity = Vec3::splat((PI * position.distance_squared(target)) as f32);
        let light = Light::Spot { position, target, intensity, angle: 0.55, softness: 0.4 };
        let (near, far) = (1e-2 * half, 1e2 * half);
        let view = View { near, far, ..stage::view(eye, target, size) };
        let scene = Scene { lights: vec![light], ..Scene::default() };
        Self { scene, view, ..Self::new(cloud, size) }
    }

    /// Draws frame number `frame_index` since something changed.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn draw(
        &mut self,
        sets: &[Set<'_>],
        outputs: &[Output],
        frame_index: u32,
    ) -> Result<Rendered> {
        let values = values(sets);
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &self.scene,
            view: self.view,
            values: &values,
            outputs,
            frame_index,
            environment: None,
            stride: self.stride,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        Ok(self.engine.render(&mut self.renderer, &request)?)
    }

    /// The scene's size, to which the renderer relates lengths, scene units: a power of two.
    #[must_use]
    pub fn extent(&self) -> f32 {
        let facts = self.cloud.facts();
        (facts.bounds_max - facts.bounds_min).max_element().log2().round().exp2() as f32
    }
}

/// The light and the camera of the Cornell box, in pictures of this many pixels on a side.
#[must_use]
pub fn cornell_view(size: u32) -> (Scene, View) {
    let file = cornell_scene();
    let scene = file.scene();
    // The box's scene has a camera.
    let camera = file.camera.map_or_else(|| other_camera(size), |camera| camera.known);
    (scene, View { camera, size_px: [size, size], near: 1e-3, far: 1e2 })
}

fn other_camera(size: u32) -> Camera {
    stage::view(DVec3::Z, DVec3::ZERO, size).camera
}
