//! What a window leaves in its folder: edited clouds, two scenes and a manifest that says what is what.
//!
//! Invariants: a session has a lock beside its folder, which its process holds for as long as it lives and
//! the system frees however that ends, so what can be locked is of nobody; a lock appears under its name
//! locked; the manifest appears whole and names only files that are.

use crate::files;
use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Version of the manifest.
const FORMAT: u32 = 1;
/// Far more than the rows of any scene need, bytes.
const MAX_MANIFEST: u64 = 4 << 20;
const MANIFEST: &str = "manifest.toml";
const LOCK: &str = "lock";

/// What is what.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Manifest {
    format: u32,
    /// When it was written, seconds since 1970.
    pub(super) time: u64,
    /// The scene that was opened or saved last.
    pub(crate) scene: Option<PathBuf>,
    /// The scene as it was shown, with the edited clouds in the place of the others.
    pub(super) shown: String,
    /// The scene with the clouds as they were opened.
    pub(super) opened: String,
    /// All clouds that were open.
    pub(crate) clouds: Vec<Row>,
}

/// A cloud that was open.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Row {
    /// Its place among the clouds of the scene as it was shown.
    pub(crate) at: usize,
    /// Whether it is among the clouds as they were opened, at the same place.
    pub(crate) was_opened: bool,
    pub(crate) visible: bool,
    /// What its summary calls it.
    pub(crate) name: String,
    /// The file it was saved to since it was opened.
    pub(crate) saved_as: Option<PathBuf>,
    /// Its file in the folder, where no other file has what it has.
    pub(crate) file: Option<String>,
}

impl Manifest {
    pub(super) fn new(
        scene: Option<PathBuf>,
        [shown, opened]: [String; 2],
        clouds: Vec<Row>,
    ) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let time = since.map_or(0, |since| since.as_secs());
        Self { format: FORMAT, time, scene, shown, opened, clouds }
    }

    fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(MANIFEST);
        let text = String::from_utf8(files::read_short(&path, MAX_MANIFEST)?)?;
        let read: Self =
            toml::from_str(&text).with_context(|| format!("{}: not read", path.display()))?;
        ensure!(read.format == FORMAT, "{}: of another version", path.display());
        let named = read.clouds.iter().filter_map(|row| row.file.as_ref());
        let is_name =
            |name: &String| Path::new(name).file_name().is_some_and(|own| own == name.as_str());
        let is_plain = named.chain([&read.shown, &read.opened]).all(is_name);
        ensure!(is_plain, "{}: names files of other folders", path.display());
        Ok(read)
    }

    /// What the edited clouds were called.
    pub(crate) fn names(&self) -> Vec<String> {
        let edited = self.clouds.iter().filter(|row| row.file.is_some());
        let name = |row: &Row| {
            let path = row.saved_as.as_deref().unwrap_or(Path::new(&row.name));
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        edited.map(name).collect()
    }
}

/// The folder of one window, or what one left; locked.
pub(crate) struct Session {
    pub(super) folder: PathBuf,
    lock_path: PathBuf,
    _lock: File,
}

impl Session {
    /// A new one; nobody else can read it.
    pub(super) fn begin(all: &Path) -> anyhow::Result<Self> {
        let cannot = || format!("{}: cannot be made", all.display());
        make_private(all).with_context(cannot)?;
        let unfinished = tempfile::Builder::new()
            .prefix(&format!("{}-", std::process::id()))
            .suffix(".new")
            .tempfile_in(all)
            .with_context(cannot)?;
        unfinished.as_file().lock().with_context(cannot)?;
        let lock_path = unfinished.path().with_extension(LOCK);
        let lock =
            unfinished.persist(&lock_path).map_err(|error| error.error).with_context(cannot)?;
        let folder = lock_path.with_extension("");
        make_private(&folder).with_context(cannot)?;
        Ok(Self { folder, lock_path, _lock: lock })
    }

    /// Says what is what, from now on.
    pub(super) fn write(&self, manifest: &Manifest) -> anyhow::Result<()> {
        let path = self.folder.join(MANIFEST);
        let text = toml::to_string_pretty(manifest)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        files::write_whole(&path, text.as_bytes())
    }

    /// Takes it away with all that is in it.
    pub(crate) fn remove(self) {
        // The manifest first: without it nothing is offered, however this ends.
        for removed in [
            fs::remove_file(self.folder.join(MANIFEST)),
            fs::remove_dir_all(&self.folder),
            fs::remove_file(&self.lock_path),
        ] {
            if let Err(error) = removed {
                tracing::debug!("{}: not removed: {error}", self.folder.display());
            }
        }
    }
}

fn make_private(folder: &Path) -> std::io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// Edits of a window that is gone, held until somebody has decided about them.
pub(crate) struct Left {
    pub(crate) session: Session,
    pub(crate) manifest: Manifest,
}

/// What windows that are gone have left, the newest first.
pub(crate) fn left(all: &Path) -> Vec<Left> {
    let listing = all.read_dir().ok().into_iter().flatten().flatten();
    let locks = listing.filter(|found| found.file_type().is_ok_and(|kind| kind.is_file()));
    let locks = locks.map(|found| found.path());
    let locks = locks.filter(|path| path.extension().is_some_and(|ending| ending == LOCK));
    let mut left: Vec<Left> = locks.filter_map(|path| take(&path)).collect();
    left.sort_by_key(|left| std::cmp::Reverse(left.manifest.time));
    left
}

fn take(lock_path: &Path) -> Option<Left> {
    let lock = File::open(lock_path).ok()?;
    lock.try_lock().ok()?;
    // Another window may have been quicker.
    if !lock_path.exists() {
        return None;
    }
    let folder = lock_path.with_extension("");
    let session = Session { folder, lock_path: lock_path.to_owned(), _lock: lock };
    if !session.folder.join(MANIFEST).exists() {
        session.remove();
        return None;
    }
    match Manifest::read(&session.folder) {
        Ok(manifest) => Some(Left { session, manifest }),
        Err(error) => {
            tracing::debug!("edits that were left are not offered: {error:#}");
            None
        }
    }
}
