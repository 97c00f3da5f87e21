//! Loads plugins; checks, compiles, culls, runs and times their graphs on wgpu; draws surfels.
//!
//! [`plugins`] finds and loads renderers, tracers and tools; [`tools`] runs tools over clouds and
//! [`trace`] tracers over pictures; [`metrics`] compares pictures. An [`Engine`] owns the device side:
//! it takes what a renderer describes for a frame, checks every name and size in it, compiles
//! what is new, runs the passes that requested outputs depend on, and times each. Surfels are
//! drawn here and nowhere else: every renderer reads the surface buffer that is made once per
//! view and shared.
//!
//! Invariants: an unchanged structure compiles and plans nothing; a failed frame leaves nothing
//! behind that a later frame could see; graphs and WGSL are not trusted.

mod engine;
mod environment;
mod gpu;
pub mod metrics;
pub mod picture;
pub mod plugins;
mod run;
mod shader;
mod store;
mod surfels;
pub mod tools;
pub mod trace;

pub use engine::{
    Counters, Engine, EngineOptions, Explanation, FeatureUse, Kept, OutputUse, PassUse,
    RenderRequest, Rendered, RendererView, ResourceUse, Supplier, Supply,
};
pub use gpu::{Atomics, Backend, Gpu, GpuError, GpuOptions};
pub use run::{CompileCounts, Image, PassReport, PassState, RenderError};
pub use store::Store;
pub use surfels::{ColumnUse, SurfaceCounts, SurfelDrawing};
