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

use crate::stage;
use anyhow::Result;
use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Scene, View};
use surfelshop_assets::cornell::cornell_scene;
use surfelshop_cloud::Cloud;
use surfelshop_engine::{Engine, RenderRequest, Rendered, RendererView};

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

/// The renderer in front of a cloud in the light of the Cornell box.
pub struct Bench {
    /// The engine that draws.
    pub engine: Engine,
    /// The renderer `global-illumination`.
    pub renderer: RendererView,
    /// The cloud.
    pub cloud: Cloud,
    /// The box's light.
    pub scene: Scene,
    /// The box's camera.
    pub view: View,
}

impl Bench {
    /// The box's light and camera before a cloud, in pictures of this many pixels on a side.
    #[must_use]
    pub fn new(cloud: Cloud, size: u32) -> Self {
        let engine = stage::engine();
        let library = "surfelshop-global-illumination";
        let renderer = stage::built_renderer(&engine, library, "global-illumination");
        let (scene, view) = cornell_view(size);
        Self { engine, renderer, cloud, scene, view }
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
            stride: 1,
            detail_px: 0.0,
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
