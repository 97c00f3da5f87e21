//! What can be wrong with files of pictures.

use std::path::PathBuf;
use thiserror::Error;

/// Why a picture could not be written or read.
#[derive(Debug, Error)]
pub enum FileError {
    /// An EXR file of nothing.
    #[error("no output to write")]
    NoOutput,
    /// The picture has fewer pixels than its size says.
    #[error("the renderer gave a picture with too few pixels")]
    TooFewPixels,
    /// The file is not what was expected.
    #[error("{}: {what}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// The picture could not be encoded as a PNG.
    #[error(transparent)]
    Png(#[from] image::ImageError),
    /// The picture could not be encoded as an EXR.
    #[error(transparent)]
    Exr(#[from] ::exr::error::Error),
}
