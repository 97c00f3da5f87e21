//! The folder in which the work stays until the file is whole.

use super::IndexOptions;
use crate::error::PyramidError;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use surfelshop_cloud::files;

/// The folder.
pub(super) struct Work {
    pub(super) folder: PathBuf,
}

/// The file that says what the work is about.
const ABOUT: &str = "about";

/// What the work depends on: the same files, read in the same way, are worked on further.
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
struct About {
    version: String,
    /// Of each file its name, length, and when it was changed.
    inputs: Vec<(PathBuf, u64, u128)>,
    most: u64,
    n_neighbours: usize,
    radius: Option<f32>,
    format: Option<String>,
}

impl Work {
    /// Opens the folder beside the output; what is there of other work goes.
    pub(super) fn open(
        output: &Path,
        inputs: &[PathBuf],
        options: &IndexOptions<'_>,
        most: u64,
    ) -> Result<Self, PyramidError> {
        let target = files::replaceable(output).map_err(PyramidError::io(output))?;
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(".index");
        let folder = target.with_file_name(name);
        let about = About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            inputs: inputs.iter().map(|input| identity(input)).collect::<Result<_, _>>()?,
            most,
            n_neighbours: options.read.n_neighbours,
            radius: options.read.radius,
            format: options.read.format.map(str::to_owned),
        };
        let work = Self { folder };
        if work.known(ABOUT).is_some_and(|known: About| known == about) {
            return Ok(work);
        }
        if work.folder.exists() {
            // Nothing of other people's is in a folder that does not say what it is about.
            if work.known::<About>(ABOUT).is_none()
                && std::fs::read_dir(&work.folder).is_ok_and(|mut all| all.next().is_some())
            {
                return Err(PyramidError::file(
                    &work.folder,
                    "expected no folder of this name, or one of an index that was ended; remove \
                     it, or name another output",
                ));
            }
            std::fs::remove_dir_all(&work.folder).map_err(PyramidError::io(&work.folder))?;
        }
        std::fs::create_dir_all(&work.folder).map_err(PyramidError::io(&work.folder))?;
        work.keep(ABOUT, &about)?;
        Ok(work)
    }

    /// Something that was kept.
    pub(super) fn known<T: serde::de::DeserializeOwned>(&self, name: &str) -> Option<T> {
        let text = std::fs::read(self.folder.join(name).with_extension("json")).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Keeps something.
    pub(super) fn keep<T: serde::Serialize>(
        &self,
        name: &str,
        value: &T,
    ) -> Result<(), PyramidError> {
        let path = self.folder.join(name).with_extension("json");
        let text =
            serde_json::to_vec(value).map_err(|error| PyramidError::Points(error.to_string()))?;
        files::write_whole(&path, &text).map_err(PyramidError::io(&path))
    }

    /// The work is done.
    pub(super) fn remove(self) {
        // What cannot be removed does no harm: the next index of this name does it.
        drop(std::fs::remove_dir_all(&self.folder));
    }
}

fn identity(input: &Path) -> Result<(PathBuf, u64, u128), PyramidError> {
    let failed = PyramidError::io(input);
    let found = std::fs::metadata(input).map_err(&failed)?;
    let changed = found.modified().map_err(&failed)?;
    let changed = changed.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
    let path = std::fs::canonicalize(input).map_err(&failed)?;
    Ok((path, found.len(), changed))
}
