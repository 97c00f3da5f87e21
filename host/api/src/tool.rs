use crate::columns::Element;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A rectangle of the picture that a tracer fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(C)]
pub struct Tile {
    /// Left edge, pixels.
    pub x: u32,
    /// Upper edge, pixels.
    pub y: u32,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Which sample of the pixel this call computes, counted from 0.
    pub sample: u32,
}

/// A new or replaced column of an edit.
#[derive(Clone, Debug, PartialEq)]
pub struct NewColumn<'a> {
    /// The column's name.
    pub name: &'a str,
    /// Elements per surfel, at least 1.
    pub components: u32,
    /// The values, all components of a surfel together.
    pub values: crate::columns::Values<'a>,
}

/// A staged edit of a cloud, committed whole or dropped.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit<'a> {
    /// Adds or replaces columns; each has as many surfels as the cloud.
    Columns(Vec<NewColumn<'a>>),
    /// Keeps the surfels whose entry is true; one entry per surfel.
    Keep(Cow<'a, [bool]>),
    /// Stands beside the source as a cloud of its own.
    NewCloud {
        /// World position that the new `position` column is relative to.
        origin: glam::DVec3,
        /// All columns of the new cloud.
        columns: Vec<NewColumn<'a>>,
    },
}

/// How an edit's columns are announced to the host; the values follow as raw slices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColumnHeader {
    /// The column's name.
    pub name: String,
    /// Elements per surfel.
    pub components: u32,
    /// Element type.
    pub element: Element,
}

/// The pointer-free part of an edit as it crosses the boundary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum EditHeader {
    /// See [`Edit::Columns`].
    Columns(Vec<ColumnHeader>),
    /// See [`Edit::Keep`]; one slice of bytes, 0 or 1.
    Keep,
    /// See [`Edit::NewCloud`].
    NewCloud {
        /// Origin of the new cloud, world space.
        origin: glam::DVec3,
        /// The columns.
        columns: Vec<ColumnHeader>,
    },
}

/// What a host offers a running job.
pub trait JobHost {
    /// Takes progress in [0, 1] and what is being done.
    fn progress(&self, fraction: f64, message: &str);
    /// Whether the user asked to stop.
    fn cancelled(&self) -> bool;
    /// Takes a staged edit.
    ///
    /// # Errors
    /// Where the edit does not fit the cloud.
    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()>;
}

/// A running tool's or tracer's line to the host.
pub struct Job<'a> {
    host: &'a dyn JobHost,
}

impl<'a> Job<'a> {
    /// A job that reports to `host`.
    #[must_use]
    pub fn new(host: &'a dyn JobHost) -> Self {
        Self { host }
    }

    /// Tells how far the work is, in [0, 1], and what is being done.
    pub fn progress(&self, fraction: f64, message: &str) {
        self.host.progress(fraction, message);
    }

    /// Whether the user asked to stop; a job that sees it returns soon.
    #[must_use]
    pub fn cancelled(&self) -> bool {
        self.host.cancelled()
    }

    /// Returns an error where the user asked to stop, for use with `?` in loops.
    ///
    /// # Errors
    /// "cancelled", where the user asked to stop.
    pub fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::new("cancelled")) } else { Ok(()) }
    }

    /// Stages an edit; it is committed when the tool returns `Ok`.
    ///
    /// # Errors
    /// Where a column's length does not fit the cloud.
    pub fn edit(&self, edit: &Edit<'_>) -> Result<()> {
        let describe = |columns: &[NewColumn<'_>]| -> Vec<ColumnHeader> {
            columns
                .iter()
                .map(|column| ColumnHeader {
                    name: column.name.to_owned(),
                    components: column.components,
                    element: column.values.element(),
                })
                .collect()
        };
        match edit {
            Edit::Columns(columns) => {
                let bytes: Vec<Vec<u8>> =
                    columns.iter().map(|c| little_endian(&c.values)).collect();
                self.stage(&EditHeader::Columns(describe(columns)), &bytes)
            }
            Edit::Keep(mask) => {
                let bytes = mask.iter().map(|&keep| u8::from(keep)).collect();
                self.stage(&EditHeader::Keep, &[bytes])
            }
            Edit::NewCloud { origin, columns } => {
                let bytes: Vec<Vec<u8>> =
                    columns.iter().map(|c| little_endian(&c.values)).collect();
                let header = EditHeader::NewCloud { origin: *origin, columns: describe(columns) };
                self.stage(&header, &bytes)
            }
        }
    }

    fn stage(&self, header: &EditHeader, values: &[Vec<u8>]) -> Result<()> {
        let slices: Vec<&[u8]> = values.iter().map(Vec::as_slice).collect();
        self.host.stage(header, &slices)
    }
}

/// The values' bytes, least significant first.
fn little_endian(values: &crate::columns::Values<'_>) -> Vec<u8> {
    use crate::columns::Values;
    macro_rules! bytes {
        ($slice:expr) => {
            $slice.iter().flat_map(|value| value.to_le_bytes()).collect()
        };
    }
    match values {
        Values::I8(slice) => bytes!(slice),
        Values::U8(slice) => slice.to_vec(),
        Values::I16(slice) => bytes!(slice),
        Values::U16(slice) => bytes!(slice),
        Values::I32(slice) => bytes!(slice),
        Values::U32(slice) => bytes!(slice),
        Values::F32(slice) => bytes!(slice),
        Values::F64(slice) => bytes!(slice),
    }
}
