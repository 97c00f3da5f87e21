//! Errors of reading and writing a scene.

use super::limits::LARGEST_FILE;
use std::io;
use std::path::PathBuf;

/// Why a scene could not be read: one line that names the file and, where there is one, the place.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {fault}", path.display(), shown(*place))]
pub struct SceneError {
    /// The file.
    pub path: PathBuf,
    /// Line and column of what is wrong, counted from 1, the column in characters.
    pub place: Option<[usize; 2]>,
    /// What is wrong.
    pub fault: SceneFault,
}

fn shown(place: Option<[usize; 2]>) -> String {
    place.map_or_else(String::new, |[line, column]| format!(":{line}:{column}"))
}

/// What is wrong with a scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneFault {
    /// The system could not open or read the file.
    #[error("cannot be read: {0}")]
    Io(io::Error),
    /// It is a folder or a device.
    #[error("expected a scene, found {found}; name the file itself")]
    NotAFile {
        /// What it is.
        found: &'static str,
    },
    /// It is too large to have been meant.
    #[error("expected a scene of at most {LARGEST_FILE} bytes, found more; is it a scene?")]
    TooLarge,
    /// It is no text.
    #[error("expected UTF-8 text, found the byte 0x{byte:02x}; save the file as UTF-8")]
    NotText {
        /// The first byte that is none.
        byte: u8,
    },
    /// It is no TOML.
    #[error("not valid TOML: {found}; correct it here")]
    Syntax {
        /// What the parser says of the place.
        found: String,
    },
    /// It does not say that it is a scene.
    #[error("expected a scene, which has a line `format = 1`, found none; if it is one, add it")]
    NoFormat,
    /// A newer program wrote it.
    #[error(
        "expected a scene of format 1, found format {found} of a newer Surfelshop; \
         open it with that version or a later one"
    )]
    Newer {
        /// The format.
        found: i64,
    },
    /// A key is not there.
    #[error("`{key}`: expected {expected}, found no such key; add it")]
    Missing {
        /// The key with all its tables.
        key: String,
        /// What would be right.
        expected: String,
    },
    /// There are more of something than are read.
    #[error(
        "`{key}`: expected at most {most} {what}, found {found}; remove some, or split the scene"
    )]
    TooMany {
        /// The key with all its tables; the last one that was read where there is none for all.
        key: String,
        /// What there is too much of.
        what: &'static str,
        /// How many are allowed.
        most: usize,
        /// How many there are, at least.
        found: usize,
    },
    /// A value is not what its key means.
    #[error("`{key}`: expected {expected}, found {found}")]
    Value {
        /// The key with all its tables.
        key: String,
        /// What would be right.
        expected: String,
        /// What is there.
        found: String,
    },
}

// The system's message is part of the line already, so it is no `source` that a caller would print
// a second time.
impl From<io::Error> for SceneFault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Why a scene could not be written; what stood there before still does.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneWriteError {
    /// The program would not take a file of this name for a scene.
    #[error("{}: expected a name that ends in .scene.toml, found {found}", path.display())]
    Name {
        /// The file.
        path: PathBuf,
        /// Its ending.
        found: String,
    },
    /// A cloud's path is no text.
    #[error(
        "{}: the cloud {} cannot be named in a scene, its path is not UTF-8; rename it",
        path.display(), cloud.display()
    )]
    Cloud {
        /// The scene.
        path: PathBuf,
        /// The cloud.
        cloud: PathBuf,
    },
    /// What the scene holds could not be read again, such as a camera at infinity.
    #[error("{}: the scene cannot be written: {fault}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What reading would say.
        fault: SceneFault,
    },
    /// The system could not create, write or rename the file.
    #[error("{}: cannot be written: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
}
