//! Private copies of libraries, made to be loaded.
//!
//! A library is mapped from its file while the program runs; if a build wrote into that file, the
//! program would die at the next call. So the bytes that were inspected are written to a file of
//! their own, and that one is loaded.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::{fs, io};
use tempfile::TempDir;

const PREFIX: &str = "surfelshop-plugin-";

/// A copy on disk, in a folder that only this user may enter.
pub(crate) struct PrivateCopy {
    folder: TempDir,
    path: PathBuf,
}

impl PrivateCopy {
    /// Writes `bytes` under the file name of `original` in a new folder.
    pub(crate) fn write(original: &Path, bytes: &[u8]) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o700));
        }
        let folder = builder.tempdir()?;
        let path = folder.path().join(original.file_name().unwrap_or(OsStr::new("plugin")));
        fs::write(&path, bytes)?;
        Ok(Self { folder, path })
    }

    /// Where the copy lies.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Ends the copy's life on disk as soon as the system allows, once it is loaded.
    pub(crate) fn loaded(self) {
        // Unix keeps a mapped file's contents after its name is gone, so nothing is left behind
        // however the program ends. Elsewhere a mapped file cannot be removed; a later start
        // does it.
        if cfg!(unix) {
            if let Err(error) = self.folder.close() {
                tracing::debug!(%error, "the copy of a loaded plugin was not removed");
            }
        } else {
            drop(self.folder.keep());
        }
    }
}

/// Removes copies that earlier programs left behind.
///
/// Copies younger than an hour are left alone: another program may be about to load one. Those
/// that a program still uses cannot be removed where removal is needed at all.
pub(super) fn remove_stale() {
    const HOUR_SECS: u64 = 3600;
    let Ok(listing) = fs::read_dir(std::env::temp_dir()) else { return };
    for found in listing.flatten() {
        if !found.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        // `DirEntry::metadata` does not follow links, so a planted link is not a folder here.
        let Ok(metadata) = found.metadata() else { continue };
        let age_secs = metadata.modified().ok().and_then(|t| t.elapsed().ok()).map(|d| d.as_secs());
        if metadata.is_dir()
            && age_secs.is_some_and(|secs| secs > HOUR_SECS)
            && let Err(error) = fs::remove_dir_all(found.path())
        {
            tracing::debug!(%error, path = %found.path().display(), "a stale copy was kept");
        }
    }
}
