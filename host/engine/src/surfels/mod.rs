//! Surfel drawing: columns on the device and the surface buffer made from them.

mod columns;
mod surface;

pub(crate) use columns::{Columns, DrawnCloud};
pub use surface::SurfaceCounts;
pub(crate) use surface::{RESOLVE, Surface, SurfaceInput, SurfaceParts, Surfaces};
