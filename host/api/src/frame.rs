use crate::camera::View;
use crate::environment::Environment;
use crate::object::ObjectFrame;
use crate::params::{ParamSet, Values};
use crate::scene::Scene;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Facts of the clouds in view, computed once when they are loaded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CloudFacts {
    /// Number of surfels.
    pub n_surfels: u64,
    /// Lower corner of the bounding box of the surfel centres, world space; zero where empty.
    pub bounds_min: DVec3,
    /// Upper corner of the bounding box of the surfel centres, world space; zero where empty.
    pub bounds_max: DVec3,
    /// Names of the columns that exist, sorted.
    pub columns: Vec<String>,
    /// The radius all surfels share, scene units, where they do.
    pub equal_radius: Option<f32>,
    /// The colour all surfels share (linear albedo), where they do.
    pub equal_color: Option<[f32; 3]>,
    /// The box of each cloud, in the order in which `object_at` of the WGSL module
    /// `surfelshop::surface` counts them.
    pub objects: Vec<ObjectFrame>,
    /// Whether each of these clouds has colours of its own.
    pub colored: Vec<bool>,
}

impl CloudFacts {
    /// Whether the cloud has a column of this name.
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }
}

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
pub(crate) struct InMotion {
    /// One surfel of so many is drawn, as [`Graph::stride`](crate::Graph::stride); 0 is taken as 1. ABI 3.6.
    #[serde(default)]
    pub(crate) stride: u32,
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
