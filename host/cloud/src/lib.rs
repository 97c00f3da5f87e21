//! Point clouds with typed columns, and the files they come from.
//!
//! A [`Cloud`] is a set of named typed columns around an f64 origin, shared by reference and edited
//! by copy on write. [`read()`] loads one from a file of any supported format, recognised by content,
//! fills in what a renderer needs and the file lacks (normals and radii, from triangles where it is a
//! mesh), drops what cannot be drawn, and counts all of it in a [`Summary`]. [`write()`] saves one so that a failure
//! leaves the old file as it was.
//!
//! A [`scene`] says which clouds stand where and how they are seen; [`display`] makes of a cloud what is
//! shown of it, coloured and filtered by its columns.
//!
//! Files are not trusted: damaged ones give one line that says what was expected and what was
//! found, and memory stays within a small multiple of the file's size.
//!
//! Invariants: this crate knows no graphics API and no user interface; every loaded cloud has
//! `position`, `normal` and `radius` columns that are finite, with unit normals and positive radii
//! (`every_loaded_cloud_can_be_drawn`).

mod assemble;
mod cloud;
pub mod convert;
pub mod display;
pub mod environment_map;
mod error;
mod faces;
pub mod files;
mod formats;
mod inspect;
pub mod memory;
mod options;
mod read;
pub mod scene;
mod summary;
mod table;
#[cfg(test)]
mod tests;
mod toml_text;
mod write;

pub use assemble::{camera_frame, lies_on_map};
pub use cloud::Cloud;
pub use cloud::buffer::Buffer;
pub use cloud::changes::changed_rows;
pub use cloud::column::{Column, is_well_known};
pub use cloud::delta::CloudDelta;
pub use cloud::edit::{EditedCloud, StagedEdits};
pub use cloud::part::{AMONG_NOTE, CloudPart};
pub use cloud::provenance::{CloudEdit, How, ToolRun};
pub use cloud::selection;
pub use cloud::source::{CameraFrame, Scan, Source};
pub use cloud::splat_columns;
pub use cloud::splats::SplatKind;
pub use cloud::transform::{Rotation, Transform};
pub use error::{CloudError, ReadError, ReadFault, WriteError};
pub use formats::plugins::{FormatCall, Formats, NoFormats, SharedSink, WriteFault};
pub use formats::positioned::SystemFile;
pub use formats::table_sink::TableSink;
pub use inspect::{CloudContents, Contents, heads, inspect, stream};
pub use options::{ColorBits, PreviewSink, ReadOptions, WriteOptions};
pub use read::preview::PREVIEW_POINTS;
pub use read::{PYRAMID, read};
pub use summary::{
    ColorCounts, Loaded, NormalCounts, RadiusCounts, Summary, Trajectory, in_groups,
};
pub use surfelshop_api::columns::NEUTRAL_ALBEDO;
pub use surfelshop_geometry::{Progress, silent};
pub use write::{Written, write, writer};
