//! Surfel drawing: columns on the device and the surface buffer made from them.

mod chunk;
mod columns;
mod computed;
mod drawing;
mod drawn;
mod elements;
mod fixed;
mod host_columns;
mod lit;
mod on_host;
mod order;
mod radii;
mod samples;
mod strategy;
mod surface;
mod uploading;
mod uses;
mod wanted;

pub(crate) use columns::Columns;
pub(crate) use drawing::RESOLVE;
pub(crate) use drawn::DrawnCloud;
pub(crate) use lit::{SurfelShading, lit_surface};
pub(crate) use samples::{SURFEL_BYTES, Samples};
pub use strategy::SurfelDrawing;
pub use surface::SurfaceCounts;
pub(crate) use surface::{Surface, SurfaceInput, SurfaceParts, Surfaces};
pub use uses::ColumnUse;
pub(crate) use uses::{DrawnHow, columns_used};
pub(crate) use wanted::Wanted;
