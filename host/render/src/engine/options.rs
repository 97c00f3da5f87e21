//! How an engine works, and what it counts.

use crate::disk_cache::DiskCache;
use crate::graph::CompileCounts;
use crate::surfels::{SurfaceCounts, SurfelDrawing};

/// How an engine works.
#[derive(Clone, Debug)]
pub struct EngineOptions {
    /// Most surfels in one chunk; fewer where the device's bindings are smaller.
    pub chunk_surfels: u32,
    /// How surfels are drawn.
    pub surfels: SurfelDrawing,
    /// Whether 64-bit atomics are left unused, as on devices that have none.
    pub only_32_bit_atomics: bool,
    /// Whether radii that are all the same are a constant, where the device draws, and no column; by
    /// default on graphics cards. On software drivers the column takes no more: Mesa's llvmpipe was seen
    /// to take 2 bytes a surfel more while it draws without it.
    pub constant_radii: Option<bool>,
    /// Most splats of a graph's own whose columns are read at once; fewer where the device's bindings are smaller.
    pub part_splats: u32,
    /// Where textures that graphs want stored are kept for the next start, if anywhere.
    pub store: Option<DiskCache>,
}

impl Default for EngineOptions {
    fn default() -> Self {
        Self {
            chunk_surfels: 1 << 20,
            surfels: SurfelDrawing::default(),
            only_32_bit_atomics: false,
            constant_radii: None,
            part_splats: u32::MAX,
            store: None,
        }
    }
}

/// What the engine did since it was made; tests and reports read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Shaders and pipelines compiled.
    pub compiled: CompileCounts,
    /// Parts of surface buffers made.
    pub surfaces: SurfaceCounts,
    /// Structures decoded and checked.
    pub plans: u32,
    /// Frames that were stopped because nobody wanted them any more.
    pub stopped: u32,
    /// Chunks of the last frame's clouds.
    pub chunks: usize,
    /// Columns uploaded.
    pub uploads: u32,
    /// Columns made of others on the device, of which only the surfels that differ were sent.
    pub patched_columns: u32,
    /// Bytes of columns sent to the device.
    pub sent_column_bytes: u64,
    /// Bytes of columns on the device now.
    pub column_bytes: u64,
    /// Bytes of columns in memory now, as the CPU draws them.
    pub host_column_bytes: u64,
    /// Buffers of surfels made for graphs that read them as data.
    pub surfel_buffers: u32,
    /// Buffers of columns made for graphs that read them.
    pub column_buffers: u32,
    /// Bytes of these on the device now.
    pub given_column_bytes: u64,
    /// Surfels that were drawn last, merged ones counting once. Where the CPU draws, or a detail
    /// is asked for, those left out with their blocks are not among them, and groups are filled up to
    /// sixteen.
    pub drawn_surfels: usize,
    /// Buffers whose bytes were sent to stay.
    pub resident_uploads: u32,
    /// Bytes of these on the device now.
    pub resident_bytes: u64,
    /// Environment maps uploaded.
    pub environments: u32,
    /// Bytes of environment maps on the device now.
    pub environment_bytes: u64,
    /// Bytes of surface buffers and of graphs' textures and buffers that are kept for frames to come.
    pub kept_bytes: u64,
    /// Pipelines that are kept.
    pub kept_pipelines: usize,
    /// Shader texts that are kept, composed and checked.
    pub kept_modules: usize,
}
