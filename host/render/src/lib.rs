//! Checks, compiles, culls, runs and times the graphs of renderers on wgpu; draws surfels.
//!
//! An [`Engine`] owns the device side:
//! it takes what a renderer describes for a frame, checks every name and size in it, compiles
//! what is new, runs the passes that requested outputs depend on, and times each. Surfels are
//! drawn here and nowhere else: every renderer reads the surface buffer that is made once per
//! view and shared.
//!
//! Invariants: an unchanged structure compiles and plans nothing; a failed frame leaves nothing
//! behind that a later frame could see; graphs and WGSL are not trusted.

mod adapters;
mod disk_cache;
mod engine;
mod environment_map;
mod gpu;
mod graph;
mod host_info;
mod host_uniform;
mod resource_use;
mod shader_compiler;
mod shader_features;
mod stages;
mod surfels;
mod transfer;

pub use adapters::has_graphics_card;
pub use disk_cache::DiskCache;
pub use engine::{
    ColumnUploader, Companion, Counters, Engine, EngineOptions, Explanation, FeatureUse, OutputUse,
    PartOf, Parts, PassUse, PreparedColumns, RenderRequest, Rendered, RendererPart, RendererUse,
    RendererView, Restored,
};
pub use gpu::{Atomics, Backend, Gpu, GpuError, GpuOptions};
pub use graph::{CompileCounts, PassReport, PassState, RenderError};
pub use resource_use::ResourceUse;
pub use stages::{Clocks, StageClock, StageTime};
pub use surfels::{BACK_ALBEDO, ColumnUse, SurfaceCounts, SurfelDrawing};
