use crate::params::{ParamSet, Values};
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::scene::cloud_facts::CloudFacts;
use crate::scene::environment::Environment;
use serde::{Deserialize, Serialize};

/// What the host tells a unit when it is made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct HostInfo {
    /// Version of the host program.
    pub host_version: String,
    /// Name of the graphics adapter; empty where there is none.
    pub adapter: String,
    /// Whether the adapter is a software driver.
    pub software_adapter: bool,
    /// Shader features the adapter has: `float32-blendable`, `float32-filterable`, and
    /// `volume-storage` where compute passes can store into volumes.
    pub features: Vec<String>,
}

/// One frame as it crosses the boundary.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FrameRequest {
    /// Camera, size and depth range.
    pub view: View,
    /// Lights, exposure and surface settings.
    pub scene: Scene,
    /// Facts of the clouds in view.
    pub cloud: CloudFacts,
    /// Counts the frames of this view since something changed; 0 for the first.
    pub frame_index: u32,
    /// The unit's parameters by id; missing ones have their default.
    pub values: Values,
    /// The light around the scene, where it has one.
    #[serde(default)]
    pub environment: Option<Environment>,
}

/// What crosses the boundary with a request for a frame besides it, as more fields of its message: tests of
/// plugins name all fields of [`FrameRequest`], and go on compiling.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct InMotion {
    /// One surfel of so many is drawn, as [`Graph::stride`](crate::Graph::stride); 0 is taken as 1. ABI 3.6.
    #[serde(default)]
    pub stride: u32,
}

/// One frame a renderer is asked to describe.
#[derive(Clone, Debug)]
pub struct Frame<P> {
    /// Camera, size and depth range.
    pub view: View,
    /// Lights, exposure and surface settings.
    pub scene: Scene,
    /// Facts of the clouds in view.
    pub cloud: CloudFacts,
    /// Counts the frames of this view since something changed; 0 for the first.
    pub frame_index: u32,
    /// The unit's parameters, clamped to their declared ranges.
    pub params: P,
    /// The light around the scene, where it has one.
    pub environment: Option<Environment>,
}

impl<P: ParamSet> From<FrameRequest> for Frame<P> {
    fn from(request: FrameRequest) -> Self {
        Self {
            view: request.view,
            scene: request.scene,
            cloud: request.cloud,
            frame_index: request.frame_index,
            params: P::from_values(&request.values),
            environment: request.environment,
        }
    }
}
