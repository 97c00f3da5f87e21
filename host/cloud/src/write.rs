//! Writing a cloud in the format that the ending names.

use crate::cloud::Cloud;
use crate::error::{WriteError, quoted};
use crate::files::replace;
use crate::formats::ply;
use crate::options::WriteOptions;
use std::io;
use std::path::Path;

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
