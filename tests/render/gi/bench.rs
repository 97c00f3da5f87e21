//! The renderer with a cloud, lights and a view.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Light, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{RenderRequest, Rendered, RendererView};
use surfelshop_tests::stage;

pub(crate) const LIBRARY: &str = "surfelshop-global-illumination";
pub(crate) const UNIT: &str = "global-illumination";

/// An engine, the renderer in a view, and what it draws.
pub(crate) struct Bench {
    pub engine: stage::PooledEngine,
    pub renderer: RendererView,
    pub cloud: Cloud,
    pub scene: Scene,
    pub view: View,
    /// One surfel of so many is drawn.
    pub stride: u32,
}

/// Whole numbers by parameter id.
pub(crate) fn ints(values: &[(&str, i64)]) -> Values {
    values.iter().map(|(id, value)| ((*id).to_owned(), Value::Int(*value))).collect()
}

/// A view from one place to another, `fov_y` radians high.
pub(crate) fn view(eye: DVec3, target: DVec3, fov_y: f64, size: u32) -> View {
    let camera =
        Camera { eye, target, up: DVec3::Y, projection: Projection::Perspective { fov_y } };
    View { camera, size_px: [size; 2], near: 1e-4, far: 1e3 }
}

pub(crate) fn point(position: DVec3, intensity: f32) -> Light {
    Light::Point { position, intensity: Vec3::splat(intensity) }
}

impl Bench {
    pub(crate) fn new(cloud: Cloud, lights: Vec<Light>, view: View) -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, LIBRARY, UNIT);
        let scene = Scene { lights, ..Scene::default() };
        Self { engine, renderer, cloud, scene, view, stride: 1 }
    }

    /// One frame of a view at rest.
    pub(crate) fn frame(
        &mut self,
        values: &Values,
        frame_index: u32,
        outputs: &[Output],
    ) -> Rendered {
        let (clouds, facts) = ([self.cloud.view()], self.cloud.facts());
        let request = RenderRequest {
            clouds: &clouds,
            facts,
            scene: &self.scene,
            view: self.view,
            values,
            outputs,
            frame_index,
            environment: None,
            stride: self.stride,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        self.engine.render(&mut self.renderer, &request).unwrap()
    }

    /// The colours once the picture does not change any more, all of them finite.
    pub(crate) fn color(&mut self, values: &Values) -> Vec<[f32; 4]> {
        let mut index = 0;
        loop {
            let rendered = self.frame(values, index, &[Output::Color]);
            index += 1;
            if !rendered.wants_another_frame {
                return pixels(&rendered, &Output::Color);
            }
        }
    }
}

pub(crate) fn pixels(rendered: &Rendered, output: &Output) -> Vec<[f32; 4]> {
    let pixels = rendered.image(output).unwrap().data.as_chunks::<4>().0.to_vec();
    assert!(pixels.as_flattened().iter().all(|value| value.is_finite()), "{}", output.name());
    pixels
}

/// The mean of the covered pixels' first three channels.
pub(crate) fn mean(pixels: &[[f32; 4]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut n = 0.0;
    for pixel in pixels.iter().filter(|pixel| pixel[3] > 0.0) {
        n += 1.0;
        for (sum, value) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(*value);
        }
    }
    sum.map(|sum| sum / f64::max(n, 1.0))
}
