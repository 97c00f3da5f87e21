//! Surfel drawing: columns on the device and the surface buffer made from them, in three ways that give
//! the same picture: quads, compute, and the CPU.

mod chunk;
mod column_buffers;
mod columns;
mod compute;
mod cpu;
mod quads;
mod render_cloud;
mod samples;
mod shading;
mod spare_textures;
mod strategy;
mod surface;

pub(crate) use column_buffers::{ColumnBuffers, Ordered};
pub(crate) use columns::Columns;
pub(crate) use columns::demand::ColumnDemand;
pub(crate) use columns::elements::geometry_of;
pub use columns::usage::ColumnUse;
pub(crate) use columns::usage::{DrawnHow, columns_used};
pub(crate) use quads::RESOLVE;
pub(crate) use render_cloud::DrawnCloud;
pub(crate) use samples::{SURFEL_BYTES, Samples};
pub(crate) use shading::lit_surface;
pub use strategy::SurfelDrawing;

/// The albedo of surfels that are seen from behind where these are tinted, linear Rec. 709: that of `disc.wgsl`.
pub const BACK_ALBEDO: [f32; 3] = [0.8, 0.03, 0.45];
pub use surface::SurfaceCounts;
pub(crate) use surface::{STOPPED, Surface, SurfaceInput, SurfaceParts, Surfaces};
