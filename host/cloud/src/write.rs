//! Writing a cloud in the format that the ending names.

use crate::cloud::Cloud;
use crate::error::{WriteError, quoted};
use crate::files::{replace, replace_at};
use crate::formats::batches::CloudBatches;
use crate::formats::plugins::{FormatCall, WriteFault};
use crate::formats::ply;
use crate::options::WriteOptions;
use std::io;
use std::path::Path;

/// What came of writing a cloud.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// What the format could not hold, a line each.
    pub lost: Vec<String>,
}

/// Writes a cloud with all its columns in the format that the file's ending names.
///
/// The file is written beside its target and renamed when it is complete, so that a failure or a
/// crash leaves what stood there before.
///
/// # Errors
/// Where the ending is unknown, a column's name cannot be written, the system or the format refuses, or
/// `progress` asks to stop.
pub fn write(
    path: impl AsRef<Path>,
    cloud: &Cloud,
    options: &WriteOptions<'_>,
) -> Result<Written, WriteError> {
    let path = path.as_ref();
    let failed = |error: io::Error| WriteError::Io { path: path.to_owned(), error };
    let Some(id) = writer(path, options)? else {
        let written = replace(path, |mut out| ply::write(&mut out, path, cloud, options), failed);
        let lost = || match ply::n_edits_left_out(cloud) {
            0 => Vec::new(),
            n => vec![format!(
                "the history of the first {n} edits, which is too long for a PLY file; save the strokes to have them"
            )],
        };
        return written.map(|()| Written { lost: lost() });
    };
    let formats = options.formats;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let call = FormatCall { name: &name, values: options.values, ..FormatCall::default() };
    let clouds = Box::new(CloudBatches::new(cloud, formats.takes_several(&id)));
    let write = |file| {
        formats.write(&id, clouds, file, call, options.progress).map_err(|fault| match fault {
            WriteFault::Line(line) => {
                WriteError::Format { path: path.to_owned(), format: id.clone(), line }
            }
            WriteFault::Cancelled => WriteError::Cancelled { path: path.to_owned() },
        })
    };
    replace_at(path, write, failed).map(|lost| Written { lost })
}

/// The plugin's format that writes a file of this name; `None` for PLY, but where a plugin has a longer ending.
///
/// # Errors
/// Where no format that is written has such an ending.
pub fn writer(path: &Path, options: &WriteOptions<'_>) -> Result<Option<String>, WriteError> {
    let ending = path.extension().unwrap_or_default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let by_name = |name: &str| options.formats.by_name(name, true);
    if ending.eq_ignore_ascii_case("ply") {
        // Plain `.ply` is no plugin's, but an ending that is longer may be, such as `.compressed.ply`.
        let is_longer = path.file_stem().is_some_and(|stem| Path::new(stem).extension().is_some());
        let longer = if is_longer { by_name(&name) } else { None };
        return Ok(longer.filter(|id| by_name("a.ply").as_ref() != Some(id)));
    }
    if let Some(id) = by_name(&name) {
        return Ok(Some(id));
    }
    let found = if ending.is_empty() {
        "no ending".to_owned()
    } else {
        quoted(format!(".{}", ending.to_string_lossy()).as_bytes())
    };
    let others = options.formats.endings(true);
    let known = std::iter::once("ply").chain(others.iter().map(String::as_str));
    let known = known.map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(", ");
    Err(WriteError::UnknownFormat { path: path.to_owned(), known, found })
}
