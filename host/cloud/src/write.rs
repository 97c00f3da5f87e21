use crate::cloud::Cloud;
use crate::error::{WriteError, quoted};
use crate::files::replace;
use crate::ply;
use std::io;
use std::path::Path;
use surfelshop_geometry::{Progress, silent};

/// How a file is written.
#[derive(Clone)]
pub struct WriteOptions<'a> {
    /// Text instead of binary little endian; several times larger, and just as exact.
    pub ascii: bool,
    /// Comments for the header.
    pub comments: Vec<String>,
    /// Takes how far the work is, in [0, 1], and may ask it to stop.
    pub progress: Progress<'a>,
}

impl Default for WriteOptions<'_> {
    fn default() -> Self {
        Self { ascii: false, comments: Vec::new(), progress: &silent }
    }
}

/// Writes a cloud with all its columns in the format that the file's ending names.
///
/// The file is written beside its target and renamed when it is complete, so that a failure or a
/// crash leaves what stood there before.
///
/// # Errors
/// Where the ending is unknown, a column's name cannot be written, the system refuses, or
/// `progress` asks to stop.
pub fn write(
    path: impl AsRef<Path>,
    cloud: &Cloud,
    options: &WriteOptions<'_>,
) -> Result<(), WriteError> {
    let path = path.as_ref();
    let ending = path.extension().unwrap_or_default();
    if !ending.eq_ignore_ascii_case("ply") {
        let found = if ending.is_empty() {
            "no ending".to_owned()
        } else {
            quoted(format!(".{}", ending.to_string_lossy()).as_bytes())
        };
        return Err(WriteError::UnknownFormat { path: path.to_owned(), found });
    }
    let failed = |error: io::Error| WriteError::Io { path: path.to_owned(), error };
    replace(path, |mut out| ply::write(&mut out, path, cloud, options), failed)
}
