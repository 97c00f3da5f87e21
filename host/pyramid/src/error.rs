//! What can go wrong with a pyramid.

use std::path::{Path, PathBuf};
use surfelshop_cloud::convert::ConvertError;

/// Why a pyramid was not made, opened or read: one line.
#[derive(Debug, thiserror::Error)]
pub enum PyramidError {
    /// The system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
    /// It is no pyramid, of another version, or damaged.
    #[error("{}: {line}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was expected, what was found, and what to do.
        line: String,
    },
    /// A source could not be read.
    #[error(transparent)]
    Source(#[from] ConvertError),
    /// Points could not be made surfels.
    #[error("{0}")]
    Points(String),
    /// The user asked to stop.
    #[error("cancelled; the work so far stays in {}, and the same command goes on from there", .0.display())]
    Cancelled(PathBuf),
}

impl PyramidError {
    pub(crate) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |error| Self::Io { path: path.to_owned(), error }
    }

    pub(crate) fn file(path: &Path, line: impl Into<String>) -> Self {
        Self::File { path: path.to_owned(), line: line.into() }
    }
}
