use super::{around, view_of};
use crate::clouds;
use crate::stage::{self, PooledEngine};
use anyhow::Result;
use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Environment, Projection, Scene, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_render::{RenderRequest, Rendered, RendererView};

/// The renderer `environment` over a sphere of albedo 1, seen along -z without perspective.
pub struct Lab {
    /// The device side.
    pub engine: PooledEngine,
    /// The renderer.
    pub renderer: RendererView,
    /// The sphere, of radius 1 about the origin.
    pub cloud: Cloud,
    /// Where it is seen from.
    pub view: View,
    /// Lights besides the environment, exposure and surface.
    pub scene: Scene,
}

/// A covered pixel.
pub struct Pixel {
    /// Unit normal, world space.
    pub normal: DVec3,
    /// Unit vector towards the eye, world space.
    pub to_eye: DVec3,
    /// Linear radiance.
    pub color: [f64; 3],
}

impl Lab {
    /// A sphere of so many surfels in a square picture of so many pixels a side.
    #[must_use]
    pub fn new(n_surfels: usize, size: u32) -> Self {
        let engine = stage::engine();
        let renderer = stage::built_renderer(&engine, "surfelshop-environment", "environment");
        let mut sphere = clouds::sphere(n_surfels, 1.0);
        sphere.colors = vec![[255; 3]; sphere.positions.len()];
        let camera = Camera {
            eye: DVec3::new(0.0, 0.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Orthographic { height: 2.1 },
        };
        let view = View { camera, size_px: [size; 2], near: 0.1, far: 10.0 };
        Self { engine, renderer, cloud: sphere.cloud(), view, scene: Scene::default() }
    }

    /// A frame in some light, of one surfel of `stride`.
    ///
    /// # Errors
    /// Where it cannot be rendered.
    pub fn frame(
        &mut self,
        light: Option<(&Environment, &Probe)>,
        values: &Values,
        stride: u32,
    ) -> Result<Rendered> {
        let request = RenderRequest {
            clouds: &[self.cloud.view()],
            facts: self.cloud.facts(),
            scene: &self.scene,
            view: self.view,
            values,
            outputs: &[Output::Color, Output::Normal],
            frame_index: 0,
            environment: light.map(|(environment, probe)| view_of(environment, probe)),
            stride,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        Ok(self.engine.render(&mut self.renderer, &request)?)
    }

    /// The covered pixels in the light of a probe.
    ///
    /// # Errors
    /// Where they cannot be rendered.
    pub fn pixels(&mut self, probe: &Probe, values: &Values) -> Result<Vec<Pixel>> {
        let environment = around(probe);
        let to_eye = (self.view.camera.eye - self.view.camera.target).normalize_or(DVec3::Z);
        Ok(pixels(&self.frame(Some((&environment, probe)), values, 1)?, to_eye))
    }
}

/// The covered pixels of a frame with colours and normals; none of one without.
#[must_use]
pub fn pixels(frame: &Rendered, to_eye: DVec3) -> Vec<Pixel> {
    let (Some(color), Some(normal)) = (frame.image(&Output::Color), frame.image(&Output::Normal))
    else {
        return Vec::new();
    };
    let vector = |texel: &[f32]| [0, 1, 2].map(|k| f64::from(texel[k]));
    let pairs = color.data.chunks_exact(4).zip(normal.data.chunks_exact(4));
    pairs
        .filter(|(_, normal)| normal[3] > 0.0)
        .map(|(color, normal)| Pixel {
            normal: DVec3::from(vector(normal)).normalize_or(DVec3::Z),
            to_eye,
            color: vector(color),
        })
        .collect()
}

/// How far pixels are from a reference, over all channels.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Mean absolute error, as a share of the mean reference.
    pub mean: f64,
    /// Largest absolute error, as a share of the mean reference.
    pub largest: f64,
    /// The smallest value found.
    pub least: f64,
}

impl Errors {
    /// Compares pixels with what a reference says of each.
    #[must_use]
    pub fn of(pixels: &[Pixel], reference: impl Fn(&Pixel) -> [f64; 3]) -> Self {
        let (mut sum, mut largest, mut scale, mut least) = (0.0, 0.0f64, 0.0, f64::INFINITY);
        for pixel in pixels {
            for (found, expected) in pixel.color.iter().zip(reference(pixel)) {
                sum += (found - expected).abs();
                largest = largest.max((found - expected).abs());
                scale += expected;
                least = least.min(*found);
            }
        }
        Self { mean: sum / scale, largest: largest * 3.0 * pixels.len() as f64 / scale, least }
    }
}
