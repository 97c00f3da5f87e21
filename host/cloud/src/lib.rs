//! Point clouds with typed columns, and the files they come from.
//!
//! A [`Cloud`] is a set of named typed columns around an f64 origin, shared by reference and edited
//! by copy on write. [`read()`] loads one from a file of any supported format, recognised by content,
//! fills in what a renderer needs and the file lacks (normals and radii, from triangles where it is a
//! mesh), drops what cannot be drawn, and counts all of it in a [`Summary`]. [`write()`] saves one so that a failure
//! leaves the old file as it was.
//!
//! A [`scene`] says which clouds stand where and how they are seen.
//!
//! Files are not trusted: damaged ones give one line that says what was expected and what was
//! found, and memory stays within a small multiple of the file's size.
//!
//! Invariants: this crate knows no graphics API and no user interface; every loaded cloud has
//! `position`, `normal` and `radius` columns that are finite, with unit normals and positive radii
//! (`every_loaded_cloud_can_be_drawn`).

mod assemble;
mod body;
mod buffer;
mod cloud;
mod color;
mod column;
mod edit;
mod error;
mod faces;
mod facts;
pub mod files;
mod lines;
pub mod memory;
mod obj;
mod off;
mod ply;
pub mod probe;
mod provenance;
mod read;
pub mod scene;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod transform;
mod write;

pub use buffer::Buffer;
pub use cloud::Cloud;
pub use column::{Column, is_well_known};
pub use edit::{Edited, Staged};
pub use error::{CloudError, ReadError, ReadFault, WriteError};
pub use provenance::{CloudMade, How, Made};
pub use read::{Loaded, ReadOptions, read};
pub use summary::{ColorCounts, NormalCounts, RadiusCounts, Summary};
pub use surfelshop_api::columns::NEUTRAL_ALBEDO;
pub use surfelshop_geometry::Progress;
pub use transform::{Rotation, Transform};
pub use write::{WriteOptions, write};
