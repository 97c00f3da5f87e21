//! Surfel drawing: columns on the device and the surface buffer made from them.

mod chunk;
mod columns;
mod computed;
mod drawing;
mod elements;
mod fixed;
mod host_columns;
mod lit;
mod on_host;
mod order;
mod radii;
mod strategy;
mod surface;
mod uses;
mod wanted;

pub(crate) use columns::{Columns, DrawnCloud};
pub(crate) use drawing::RESOLVE;
pub(crate) use lit::{SurfelShading, lit_surface};
pub use strategy::SurfelDrawing;
pub use surface::SurfaceCounts;
pub(crate) use surface::{Surface, SurfaceInput, SurfaceParts, Surfaces};
pub use uses::ColumnUse;
pub(crate) use uses::{DrawnHow, columns_used};
pub(crate) use wanted::Wanted;
