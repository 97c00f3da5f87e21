//! The folder in which the work stays until the file is whole.

use crate::error::PyramidError;
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use surfelshop_cloud::files;

/// The folder. No other process works in it as long as this lives.
pub(crate) struct Work {
    pub(crate) folder: PathBuf,
    /// The most points of a chunk: that of the run which began the work.
    pub(crate) most: u64,
    /// What the user should know.
    pub(crate) warning: Option<String>,
    about: About,
    lock: Option<File>,
}

/// The file that says what the work is about.
const ABOUT: &str = "about";

/// What the work depends on: the same files, worked on in the same way, are worked on further.
#[derive(Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct About {
    version: String,
    /// Of each file its name, length, and when it was changed.
    inputs: Vec<(PathBuf, u64, u128)>,
    /// What is done to them.
    what: String,
    most: u64,
}

impl Work {
    fn new(output: &Path, inputs: &[&Path], what: String, most: u64) -> Result<Self, PyramidError> {
        let target = files::replaceable(output).map_err(PyramidError::io(output))?;
        let mut name = target.file_name().unwrap_or_default().to_owned();
        name.push(".index");
        let folder = target.with_file_name(name);
        let about = About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            inputs: inputs.iter().map(|input| identity(input)).collect::<Result<_, _>>()?,
            what,
            most,
        };
        Ok(Self { folder, most, warning: None, about, lock: None })
    }

    /// Finds the folder beside the output; what is there of other work goes. Nothing is made yet.
    pub(crate) fn find(
        output: &Path,
        inputs: &[&Path],
        what: String,
        most: u64,
    ) -> Result<Self, PyramidError> {
        let mut work = Self::new(output, inputs, what, most)?;
        if !work.folder.exists() {
            return Ok(work);
        }
        let Some(known) = work.known::<About>(ABOUT) else {
            // Nothing of other people's is in a folder that does not say what it is about.
            if std::fs::read_dir(&work.folder).is_ok_and(|mut all| all.next().is_some()) {
                return Err(PyramidError::file(
                    &work.folder,
                    "expected no folder of this name, or one of an index that was ended; remove \
                     it, or name another output",
                ));
            }
            return Ok(work);
        };
        work.lock()?;
        // The size of parts may differ: they go on as they were begun.
        if known == (About { most: known.most, ..work.about.clone() }) {
            work.most = known.most;
            return Ok(work);
        }
        work.warning = Some(format!(
            "the work so far in {} is of other files, or of files that have changed, or they are \
             worked on in another way: it was begun anew",
            work.folder.display()
        ));
        work.clear()?;
        Ok(work)
    }

    /// Joins work that others do, too, in the folder beside the output; nothing there changes.
    pub(crate) fn join(
        output: &Path,
        inputs: &[&Path],
        what: String,
        most: u64,
    ) -> Result<Self, PyramidError> {
        let mut work = Self::new(output, inputs, what, most)?;
        let known = work.known::<About>(ABOUT);
        let Some(known) = known else {
            return Err(PyramidError::file(
                &work.folder,
                "expected work that was begun; do the step `extent` first",
            ));
        };
        if known != (About { most: known.most, ..work.about.clone() }) {
            return Err(PyramidError::file(
                &work.folder,
                "the work there is of other files, or of files that have changed, or is done in another way; do \
                 the step `extent` again",
            ));
        }
        work.most = known.most;
        work.lock_with(File::try_lock_shared)?;
        Ok(work)
    }

    /// Makes the folder, where it is not there.
    pub(crate) fn begin(&mut self) -> Result<(), PyramidError> {
        std::fs::create_dir_all(&self.folder).map_err(PyramidError::io(&self.folder))?;
        self.lock()?;
        self.keep(ABOUT, &self.about)
    }

    /// Removes what is in the folder, but the lock.
    pub(crate) fn clear(&self) -> Result<(), PyramidError> {
        let failed = PyramidError::io(&self.folder);
        for entry in std::fs::read_dir(&self.folder).map_err(&failed)? {
            let path = entry.map_err(&failed)?.path();
            if path != self.lock_path() {
                std::fs::remove_file(&path).map_err(PyramidError::io(&path))?;
            }
        }
        Ok(())
    }

    fn lock_path(&self) -> PathBuf {
        self.folder.join("lock")
    }

    /// Keeps others out.
    fn lock(&mut self) -> Result<(), PyramidError> {
        self.lock_with(File::try_lock)
    }

    fn lock_with(
        &mut self,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<(), PyramidError> {
        if self.lock.is_some() {
            return Ok(());
        }
        let path = self.lock_path();
        let file = File::create(&path).map_err(PyramidError::io(&path))?;
        match lock(&file) {
            Ok(()) => {
                self.lock = Some(file);
                Ok(())
            }
            Err(TryLockError::WouldBlock) => Err(PyramidError::file(
                &self.folder,
                "another index or bake works on this output; wait until it has ended, or name another",
            )),
            // File systems without locks have them for nobody.
            Err(TryLockError::Error(_)) => Ok(()),
        }
    }

    /// Something that was kept.
    pub(crate) fn known<T: serde::de::DeserializeOwned>(&self, name: &str) -> Option<T> {
        let text = std::fs::read(self.folder.join(name).with_extension("json")).ok()?;
        serde_json::from_slice(&text).ok()
    }

    /// Keeps something.
    pub(crate) fn keep<T: serde::Serialize>(
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
    pub(crate) fn remove(self) {
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
