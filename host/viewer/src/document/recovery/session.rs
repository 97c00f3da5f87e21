//! The folder of a window's unsaved edits: clouds, two scenes and a manifest.
//!
//! Invariants: beside the folder lies a lock, which the process holds until it ends and the system then
//! frees, so that a folder that can be locked has no owner; a lock file appears locked; the manifest
//! appears whole and names existing files alone.

use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use surfelshop_session::output::files;

/// Version of the manifest.
const FORMAT: u32 = 1;
/// Most bytes of a manifest: far more than the rows of any scene.
const MAX_MANIFEST: u64 = 4 << 20;
const MANIFEST: &str = "manifest.toml";
const LOCK: &str = "lock";
/// The scene that is read to restore the edits.
pub(super) const RECOVERED_SCENE: &str = "recovered.scene.toml";

/// The contents of the folder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Manifest {
    format: u32,
    /// When it was written, seconds since 1970.
    pub(crate) time: u64,
    /// The scene file that was opened or saved last.
    pub(crate) scene: Option<PathBuf>,
    /// The scene with the edited clouds.
    pub(super) shown: String,
    /// The scene with the opened clouds.
    pub(super) opened: String,
    /// All open clouds.
    pub(crate) clouds: Vec<CloudRow>,
}

/// An open cloud.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct CloudRow {
    /// Its index among the clouds of the scene with edits.
    pub(crate) at: usize,
    /// Whether the opened scene has it at the same index.
    pub(crate) was_opened: bool,
    pub(crate) visible: bool,
    /// Its name in the summary.
    pub(crate) name: String,
    /// The file it was saved to after it was opened.
    pub(crate) saved_as: Option<PathBuf>,
    /// Its file in the folder, if it has unsaved edits.
    pub(crate) file: Option<String>,
    /// What the user calls it.
    #[serde(default)]
    pub(crate) title: Option<String>,
}

impl Manifest {
    pub(super) fn new(
        scene: Option<PathBuf>,
        [shown, opened]: [String; 2],
        clouds: Vec<CloudRow>,
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

    /// The names of the edited clouds.
    pub(crate) fn names(&self) -> Vec<String> {
        let edited = self.clouds.iter().filter(|row| row.file.is_some());
        let name = |row: &CloudRow| {
            let path = row.saved_as.as_deref().unwrap_or(Path::new(&row.name));
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        edited.map(name).collect()
    }
}

/// The locked folder of this window or of an earlier one.
pub(crate) struct Session {
    pub(super) folder: PathBuf,
    lock_path: PathBuf,
    _lock: File,
}

impl Session {
    /// Creates a folder that no other user can read.
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

    /// Replaces the manifest.
    pub(super) fn write(&self, manifest: &Manifest) -> anyhow::Result<()> {
        let path = self.folder.join(MANIFEST);
        let text = toml::to_string_pretty(manifest)
            .with_context(|| format!("{}: cannot be written", path.display()))?;
        files::write_whole(&path, text.as_bytes())
    }

    /// Removes the folder with its contents.
    pub(crate) fn remove(self) {
        // The manifest first: without it the folder is not offered, should this be interrupted.
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

/// The edits of an earlier session, locked until the user has decided about them.
pub(crate) struct OrphanSession {
    pub(crate) session: Session,
    pub(crate) manifest: Manifest,
}

/// The sessions without an owner, the newest first.
pub(crate) fn orphans(all: &Path) -> Vec<OrphanSession> {
    let listing = all.read_dir().ok().into_iter().flatten().flatten();
    let locks = listing.filter(|found| found.file_type().is_ok_and(|kind| kind.is_file()));
    let locks = locks.map(|found| found.path());
    let locks = locks.filter(|path| path.extension().is_some_and(|ending| ending == LOCK));
    let mut orphans: Vec<OrphanSession> = locks.filter_map(|path| take(&path)).collect();
    orphans.sort_by_key(|orphan| std::cmp::Reverse(orphan.manifest.time));
    orphans
}

fn take(lock_path: &Path) -> Option<OrphanSession> {
    let lock = File::open(lock_path).ok()?;
    lock.try_lock().ok()?;
    // Another window may have removed it meanwhile.
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
        Ok(manifest) => Some(OrphanSession { session, manifest }),
        Err(error) => {
            tracing::debug!("edits that were left are not offered: {error:#}");
            None
        }
    }
}
