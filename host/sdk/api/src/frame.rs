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
    ///
    /// Since ABI 3.10 also what shaders of passes use that [need](crate::graph::Pass::needs) it: `subgroups`, `f16`,
    /// `64-bit-integers`, `64-bit-atomic-max` (`atomicMax` and `atomicMin` of `u64`), `64-bit-atomics` (all of them)
    /// and `float32-atomics` (`atomicAdd` of `f32`).
    pub features: Vec<String>,
    /// How much the device takes; zeros where there is none. ABI 3.10.
    pub limits: DeviceLimits,
}

/// How much a device takes, and the host of graphs on it. ABI 3.10.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct DeviceLimits {
    /// Most bytes of a buffer, which is bound whole.
    pub buffer_bytes: u64,
    /// Most bytes of a buffer of columns, of which passes of splats are given part by part.
    pub columns_bytes: u64,
    /// Most bytes of all textures and buffers of a graph.
    pub graph_bytes: u64,
    /// Most bytes of a uniform.
    pub uniform_bytes: u64,
    /// Most storage buffers of a pass.
    pub storage_buffers: u32,
    /// Most textures that a pass stores into.
    pub storage_textures: u32,
    /// Most textures that a pass reads.
    pub textures: u32,
    /// Most samplers of a pass.
    pub samplers: u32,
    /// Most uniforms of a pass.
    pub uniforms: u32,
    /// Most texels of a side of a texture, and of each of its layers.
    pub texture_side: u32,
    /// Most texels of a side of a volume.
    pub volume_side: u32,
    /// Most layers of a texture.
    pub texture_layers: u32,
    /// Most invocations of a workgroup.
    pub workgroup_invocations: u32,
    /// Most invocations of a workgroup in each direction.
    pub workgroup_size: [u32; 3],
    /// Most bytes that a workgroup shares.
    pub workgroup_bytes: u32,
    /// Least and most invocations of a subgroup; zeros where the device has none.
    pub subgroup_size: [u32; 2],
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

/// What crosses the boundary with a request for a frame besides: what is on the device already. ABI 3.10.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct OnDevice {
    /// Bytes of [resident](crate::Graph::resident) buffers of this unit.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub resident: Vec<ResidentBytes>,
}

/// Bytes that are on the device. ABI 3.10.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ResidentBytes {
    /// What names them.
    pub key: String,
    /// How many there are.
    pub len: u64,
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
