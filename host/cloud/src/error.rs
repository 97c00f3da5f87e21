//! Errors of clouds and their files, each one line.

use crate::files::OpenFault;
use crate::memory::OutOfMemory;
use glam::DVec3;
use std::io;
use std::path::PathBuf;

/// Why columns do not make a cloud.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CloudError {
    /// There is no column of centres.
    #[error("expected a column `position`, found none")]
    NoPosition,
    /// A column has no name or no components.
    #[error("column `{column}`: expected a name and at least one component")]
    Shape {
        /// The column.
        column: String,
    },
    /// Two columns have one name.
    #[error("column `{column}` is given twice")]
    Twice {
        /// The column.
        column: String,
    },
    /// A column has not as many values as there are surfels.
    #[error("column `{column}`: expected {expected} values, found {found}")]
    Length {
        /// The column.
        column: String,
        /// Surfels times components.
        expected: u64,
        /// Values given.
        found: usize,
    },
    /// A well-known column has a type that its meaning does not allow.
    #[error("column `{column}`: expected {expected}, found {found}")]
    Type {
        /// The column.
        column: String,
        /// Types allowed.
        expected: String,
        /// Type given.
        found: String,
    },
    /// A well-known column holds a number that cannot be drawn.
    #[error("column `{column}`: surfel {surfel} is not finite")]
    NotFinite {
        /// The column.
        column: String,
        /// Index of the first such surfel.
        surfel: usize,
    },
    /// A mask does not have one entry per surfel.
    #[error("mask: expected {expected} entries, found {found}")]
    Mask {
        /// Surfels of the cloud.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// An edit of a tool cannot be taken.
    #[error("edit: expected {expected}, found {found}")]
    Edit {
        /// What would be right.
        expected: String,
        /// What was staged.
        found: String,
    },
    /// A stroke cannot be followed.
    #[error("stroke: expected {expected}, found {found}")]
    Stroke {
        /// What would be right.
        expected: String,
        /// What it has.
        found: String,
    },
    /// There is no memory for it.
    #[error(transparent)]
    Memory(#[from] OutOfMemory),
    /// A triangle has a corner that is no surfel.
    #[error("triangle {triangle}: expected corners below {len}")]
    Face {
        /// Index of the first such triangle.
        triangle: usize,
        /// Surfels of the cloud.
        len: usize,
    },
    /// The origin is not finite.
    #[error("expected a finite origin, found {origin}")]
    Origin {
        /// Origin given.
        origin: DVec3,
    },
    /// A cloud cannot be scaled, turned or moved like this.
    #[error("transform: expected {expected}, found {found}")]
    Transform {
        /// What would be right.
        expected: &'static str,
        /// What was asked for or came of it.
        found: String,
    },
}

/// Why a file could not be read: one line that names the file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: ReadFault,
}

/// What is wrong with a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadFault {
    /// The system could not open or read it.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// It is a folder or a device.
    #[error("expected a file, found {found}; name the file itself")]
    NotAFile {
        /// What it is.
        found: &'static str,
    },
    /// It has no bytes.
    #[error("expected a point cloud, found an empty file; check the copy or download")]
    Empty,
    /// It stands for a file that was not downloaded.
    #[error("expected a point cloud, found a Git LFS pointer; fetch the file with `git lfs pull`")]
    LfsPointer,
    /// It is a pyramid, which is drawn and not read.
    #[error(
        "expected a file of points, found a pyramid, which is drawn as it is; use the files that it was made of"
    )]
    Pyramid,
    /// No supported format begins like this.
    #[error("expected a {known} file, found {found}; convert it to one of these first")]
    UnknownFormat {
        /// Formats that are known, by their endings.
        known: String,
        /// The first bytes.
        found: String,
    },
    /// The header breaks the rules of the format.
    #[error("header line {line}: expected {expected}, found {found}; export the file again")]
    Header {
        /// Line, counted from 1.
        line: usize,
        /// What would be right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// There is no element that holds points.
    #[error("expected an element `vertex` or `point`, found {found}; is it a point cloud?")]
    NoVertices {
        /// Names of the elements.
        found: String,
    },
    /// Coordinates are missing.
    #[error("expected properties x, y and z of {}, found {found}; name them so", quoted(element.as_bytes()))]
    NoCoordinates {
        /// The element of points.
        element: String,
        /// Names of its properties.
        found: String,
    },
    /// The header announces more than the file holds.
    #[error(
        "element {}: expected {expected}, found {found}; \
         the file is cut short or its count is wrong",
        quoted(element.as_bytes())
    )]
    Truncated {
        /// The element.
        element: String,
        /// What the header announces.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A value cannot be read.
    #[error("{place}: expected {expected}, found {found}; correct the line or export again")]
    Value {
        /// Line or record.
        place: String,
        /// What would be right.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A line is longer than any that is meant.
    #[error("line {line}: expected at most {most} bytes in a line, found more; is it a text file?")]
    LongLine {
        /// Line, counted from 1.
        line: usize,
        /// Bytes that are allowed.
        most: usize,
    },
    /// A record is longer than any that is meant.
    #[error(
        "record {record} of element {}: expected at most {most} bytes, found more; the \
         lengths of its lists are wrong",
        quoted(element.as_bytes())
    )]
    LongRecord {
        /// The element.
        element: String,
        /// The record, counted from 0.
        record: u64,
        /// Bytes that are allowed.
        most: u64,
    },
    /// The cloud does not fit into memory.
    #[error("{n_points} points are too many for this machine: {out}; thin or split the file")]
    Memory {
        /// Points announced or read so far.
        n_points: u64,
        /// What is needed and what is there.
        out: OutOfMemory,
    },
    /// A format read the file and found no cloud in it.
    #[error("expected a point cloud, found none in the file; is it the right one?")]
    NoClouds,
    /// There are more points than indices.
    #[error("expected at most 4294967295 points, found {found}; split the file")]
    TooMany {
        /// Points of all clouds of the file.
        found: u64,
    },
    /// A format of a plugin could not read it.
    #[error("{line}")]
    Format {
        /// The format's id.
        format: String,
        /// What it says.
        line: String,
    },
    /// The caller asked to stop.
    #[error("reading was cancelled")]
    Cancelled,
}

impl ReadFault {
    /// What to say where memory runs out at so many points.
    pub(crate) fn memory(n_points: usize) -> impl FnOnce(OutOfMemory) -> Self {
        move |out| Self::Memory { n_points: n_points as u64, out }
    }
}

impl From<OpenFault> for ReadFault {
    fn from(fault: OpenFault) -> Self {
        match fault {
            OpenFault::Io(error) => Self::Io(error),
            OpenFault::NotAFile { found } => Self::NotAFile { found },
            other @ (OpenFault::TooLong { .. } | OpenFault::Memory(_)) => {
                Self::Io(io::Error::other(other.to_string()))
            }
        }
    }
}

// The system's message is part of the line already, so it is no `source` that a caller would print
// a second time.
impl From<io::Error> for ReadFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<surfelshop_geometry::Cancelled> for ReadFault {
    fn from(_: surfelshop_geometry::Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Why a file could not be written; what stood there before still does.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// No writer has this ending.
    #[error("{}: expected a name that ends in {known}, found {found}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// Endings of formats that are written.
        known: String,
        /// Its ending.
        found: String,
    },
    /// A column's name cannot stand in a header.
    #[error("{}: column `{column}` cannot be written: {reason}", path.display())]
    ColumnName {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// Why not.
        reason: &'static str,
    },
    /// The system could not create, write or rename it.
    #[error("{}: cannot be written: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A format of a plugin could not write it.
    #[error("{}: {line}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The format's id.
        format: String,
        /// What it says.
        line: String,
    },
    /// The caller asked to stop.
    #[error("{}: writing was cancelled", path.display())]
    Cancelled {
        /// The file.
        path: PathBuf,
    },
}

/// Bytes of a file as a person can read them: one line, at most 40 characters.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(160)]);
    // Quotation marks are no danger, and escaped ones are hard to read.
    let shown = |c: char| match c {
        '"' | '\'' => c.to_string(),
        _ => c.escape_debug().to_string(),
    };
    let mut shown: String = text.trim_end().chars().take(40).map(shown).collect();
    if text.trim_end().chars().count() > 40 || bytes.len() > 160 {
        shown.push('…');
    }
    format!("`{shown}`")
}

/// The first few of many names, quoted.
pub(crate) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const SHOWN: usize = 8;
    let mut names = names.peekable();
    if names.peek().is_none() {
        return "none".to_owned();
    }
    let mut shown: Vec<String> =
        names.by_ref().take(SHOWN).map(|name| quoted(name.as_bytes())).collect();
    let rest = names.count();
    if rest > 0 {
        shown.push(format!("{rest} more"));
    }
    shown.join(", ")
}
