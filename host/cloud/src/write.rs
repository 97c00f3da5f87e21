use crate::cloud::Cloud;
use crate::error::{WriteError, quoted};
use crate::ply;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use surfelshop_geometry::{Progress, silent};
use tempfile::NamedTempFile;

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
    replace(path, |out| ply::write(out, path, cloud, options), failed)
}

/// Writes a file beside its target and renames it when it is complete.
pub(crate) fn replace<E>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<NamedTempFile>) -> Result<(), E>,
    failed: impl Fn(io::Error) -> E,
) -> Result<(), E> {
    // Renaming onto a link would replace the link rather than the file it names.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let file = beside(&target).map_err(&failed)?;
    let mut out = BufWriter::with_capacity(1 << 18, file);
    write(&mut out)?;
    let file = out.into_inner().map_err(|error| failed(error.into_error()))?;
    file.persist(&target).map_err(|error| failed(error.error))?;
    Ok(())
}

/// A new file in the folder of `target`, with the rights of the file it is to replace.
fn beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".surfelshop-").suffix(".part");
    let old = std::fs::metadata(target).ok().filter(std::fs::Metadata::is_file);
    // Temporary files are private by default; a file that a user asked for has the usual rights.
    #[cfg(unix)]
    if old.is_none() {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder)?;
    if let Some(old) = old {
        file.as_file_mut().set_permissions(old.permissions())?;
    }
    file.flush()?;
    Ok(file)
}
