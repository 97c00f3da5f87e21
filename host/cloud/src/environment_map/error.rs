//! Errors of reading a light probe.

use super::limits::{LARGEST_AREA, LARGEST_SIDE, PIXELS_PER_BYTE};
use crate::files::OpenFault;
use crate::memory::OutOfMemory;
use std::io;
use std::path::PathBuf;

/// Why a probe could not be read: one line that names the file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct ProbeError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: ProbeFault,
}

/// What is wrong with a probe.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProbeFault {
    /// The system could not open or read the file.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// It is a folder or a device.
    #[error("expected a light probe, found {found}; name the file itself")]
    NotAFile {
        /// What it is.
        found: &'static str,
    },
    /// It has no bytes.
    #[error("expected a light probe, found an empty file; check the copy or download")]
    Empty,
    /// It stands for a file that was not downloaded.
    #[error("expected a light probe, found a Git LFS pointer; fetch the file with `git lfs pull`")]
    LfsPointer,
    /// It is of a format that holds no radiance, or of none that is known.
    #[error("expected a light probe in Radiance HDR or OpenEXR, found {found}; convert it first")]
    UnknownFormat {
        /// The format or the first bytes.
        found: String,
    },
    /// It breaks the rules of its format.
    #[error("expected a valid {format} file, found damage: {found}; check the copy or download")]
    Damaged {
        /// The format.
        format: &'static str,
        /// What its reader says.
        found: String,
    },
    /// It ends early.
    #[error(
        "{format}: expected {width} x {height} pixels, found the end of the file before the last; \
         check the copy or download"
    )]
    Truncated {
        /// The format.
        format: &'static str,
        /// Pixels along a row.
        width: u32,
        /// Number of rows.
        height: u32,
    },
    /// It has no colours.
    #[error("expected a layer with the channels R, G and B or Y alone, found {found}")]
    Channels {
        /// The channels of its layers.
        found: String,
    },
    /// It shows a part of the picture only.
    #[error("expected pixels in all of the picture's {expected}, found {found}; export it whole")]
    Cropped {
        /// Size of the whole.
        expected: String,
        /// Size and place of the part.
        found: String,
    },
    /// It has no pixels or too many.
    #[error("expected 1 to {LARGEST_SIDE} pixels along each side, found {width} x {height}")]
    Size {
        /// Pixels along a row.
        width: u64,
        /// Number of rows.
        height: u64,
    },
    /// It has more pixels than are read.
    #[error(
        "expected at most {LARGEST_AREA} pixels, found {width} x {height}; scale the picture down"
    )]
    Area {
        /// Pixels along a row.
        width: u64,
        /// Number of rows.
        height: u64,
    },
    /// It does not fit into memory.
    #[error(
        "{width} x {height} pixels are too many for this machine: {out}; scale the picture down"
    )]
    Memory {
        /// Pixels along a row.
        width: u64,
        /// Number of rows.
        height: u64,
        /// What is needed and what is there.
        out: OutOfMemory,
    },
    /// Its header promises more than it can hold.
    #[error(
        "expected at most {PIXELS_PER_BYTE} pixels for each of its {bytes} bytes, found a header \
         that says {width} x {height}; the file is cut short or its header is wrong"
    )]
    Implausible {
        /// Pixels along a row.
        width: u64,
        /// Number of rows.
        height: u64,
        /// Length of the file.
        bytes: u64,
    },
    /// Its pixels are not as many as its sides say.
    #[error("expected {expected} pixels, found {found}")]
    Length {
        /// Width times height.
        expected: u64,
        /// Pixels given.
        found: usize,
    },
    /// Its shape tells no mapping.
    #[error(
        "expected a square picture or one of 2 to 1, 3 to 4 or 4 to 3, found {width} x {height}; \
         name its mapping: {names}"
    )]
    NoMapping {
        /// Pixels along a row.
        width: u32,
        /// Number of rows.
        height: u32,
        /// Names of all mappings.
        names: String,
    },
    /// Its shape is not that of the mapping it was given.
    #[error("mapping {mapping}: expected {expected}, found {width} x {height}; name another")]
    Shape {
        /// The mapping.
        mapping: &'static str,
        /// Shape that it has.
        expected: &'static str,
        /// Pixels along a row.
        width: u32,
        /// Number of rows.
        height: u32,
    },
}

// The system's message is part of the line already, so it is no `source` that a caller would print
// a second time.
impl From<io::Error> for ProbeFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<OpenFault> for ProbeFault {
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
