//! The journal writes unsaved clouds to disk, on a thread of its own.
//!
//! It gets a target after every change; the latest one counts, and writing a cloud that is no longer in
//! it stops. Edits go on whether the journal can be written or not.

use super::session::{CloudRow, Manifest, OrphanSession, Session};
use crate::document::open_clouds::generations;
use anyhow::Context as _;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use surfelshop_cloud::scene::SceneFile;
use surfelshop_cloud::selection::EditLayer;
use surfelshop_cloud::{Cloud, WriteError, WriteOptions};
use surfelshop_session::input::layers;

/// Most bytes of columns on disk: it is the disk of the user's home.
pub(crate) const MOST_BYTES: u64 = 4 << 30;

/// How long [`Journal::finish`] waits for the thread: writing a gigabyte takes seconds.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(10);

/// An edited cloud.
#[derive(Clone)]
pub(super) struct EditedCloud {
    /// Its index in [`JournalTarget::rows`].
    pub(super) row: usize,
    pub(super) cloud: Cloud,
    pub(super) comments: Vec<String>,
    /// Of a pyramid its edits, and how many surfels it has: these are kept instead.
    pub(super) layer: Option<(EditLayer, u64)>,
}

/// The contents that the journal must have.
#[derive(Clone, Default)]
pub(super) struct JournalTarget {
    pub(super) scene: Option<PathBuf>,
    pub(super) rows: Vec<CloudRow>,
    pub(super) edited: Vec<EditedCloud>,
    pub(super) shown: SceneFile,
    pub(super) opened: SceneFile,
}

/// What happens to the journal at its end.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum JournalEnd {
    /// It stays for the next start.
    Keep,
    /// It is removed.
    Remove,
}

#[derive(Default)]
struct Shared {
    target: Option<JournalTarget>,
    works: bool,
    end: Option<JournalEnd>,
    /// Restored sessions, which are removed once this journal holds their edits.
    adopted: Vec<OrphanSession>,
    faults: Vec<String>,
}

/// The window's end of the journal; its thread starts with the first edit.
pub(crate) struct Journal {
    pub(super) folder: PathBuf,
    most_bytes: u64,
    shared: Arc<(Mutex<Shared>, Condvar)>,
    has_thread: bool,
}

impl Journal {
    pub(super) fn new(folder: PathBuf) -> Self {
        let folder = std::path::absolute(&folder).unwrap_or(folder);
        Self { folder, most_bytes: MOST_BYTES, shared: Arc::default(), has_thread: false }
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the target; the thread calls `wake` after a failure.
    pub(super) fn update(&mut self, target: JournalTarget, wake: impl Fn() + Send + 'static) {
        if !self.has_thread && target.edited.is_empty() && self.lock().adopted.is_empty() {
            return;
        }
        {
            let mut shared = self.lock();
            shared.target = Some(target);
            shared.works = true;
        }
        self.shared.1.notify_all();
        if self.has_thread {
            return;
        }
        let (folder, most_bytes, shared) =
            (self.folder.clone(), self.most_bytes, self.shared.clone());
        let writer = Writer { folder, most_bytes, shared, session: None, files: Vec::new(), n: 0 };
        let thread = std::thread::Builder::new().name("journal".to_owned());
        match thread.spawn(move || writer.run(&wake)) {
            Ok(_) => self.has_thread = true,
            Err(error) => {
                let mut shared = self.lock();
                shared.works = false;
                shared.faults.push(format!("edits are not kept for the case of a crash: {error}"));
            }
        }
    }

    /// Takes on a restored session.
    pub(super) fn adopt(&self, orphan: OrphanSession) {
        self.lock().adopted.push(orphan);
    }

    /// The failures since the last call.
    pub(super) fn faults(&self) -> Vec<String> {
        std::mem::take(&mut self.lock().faults)
    }

    /// Whether the target is on disk.
    #[cfg(test)]
    pub(crate) fn is_idle(&self) -> bool {
        !self.lock().works
    }

    #[cfg(test)]
    pub(crate) fn keep_at_most(&mut self, bytes: u64) {
        self.most_bytes = bytes;
    }

    /// Ends the thread, and waits at most [`SHUTDOWN_TIMEOUT`].
    pub(crate) fn finish(&mut self, end: JournalEnd) {
        let mut shared = self.lock();
        shared.end = Some(end);
        self.shared.1.notify_all();
        if self.has_thread {
            let works = |shared: &mut Shared| shared.works || shared.end.is_some();
            let waited = self.shared.1.wait_timeout_while(shared, SHUTDOWN_TIMEOUT, works);
            shared = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if end == JournalEnd::Remove {
            shared.adopted.drain(..).for_each(|orphan| orphan.session.remove());
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        let mut shared = self.lock();
        shared.end.get_or_insert(JournalEnd::Keep);
        self.shared.1.notify_all();
    }
}

/// A cloud on disk.
struct JournalFile {
    generations: Vec<u64>,
    file: String,
}

/// The thread.
struct Writer {
    folder: PathBuf,
    most_bytes: u64,
    shared: Arc<(Mutex<Shared>, Condvar)>,
    session: Option<Session>,
    files: Vec<JournalFile>,
    /// The number of the last file.
    n: u64,
}

fn bytes(cloud: &Cloud) -> u64 {
    let columns = cloud.columns().iter().map(surfelshop_cloud::Column::values);
    let bytes: usize = columns.map(|values| values.len() * values.element().size()).sum();
    (bytes + 12 * cloud.faces().len()) as u64
}

impl Writer {
    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(mut self, wake: &dyn Fn()) {
        loop {
            let shared = self.lock();
            let idles = |shared: &mut Shared| shared.target.is_none() && shared.end.is_none();
            let waited = self.shared.1.wait_while(shared, idles);
            let mut shared = waited.unwrap_or_else(PoisonError::into_inner);
            let (target, end) = (shared.target.take(), shared.end);
            drop(shared);
            if let Some(target) = target.filter(|_| end != Some(JournalEnd::Remove)) {
                if let Err(error) = self.write(&target) {
                    let line = format!("edits are not kept for the case of a crash: {error:#}");
                    self.lock().faults.push(line);
                    wake();
                }
                let mut shared = self.lock();
                shared.works = shared.target.is_some();
                continue;
            }
            if end == Some(JournalEnd::Remove) {
                self.session.take().into_iter().for_each(Session::remove);
            }
            // The folder is unlocked before the window continues.
            self.session = None;
            let mut shared = self.lock();
            (shared.works, shared.end) = (false, None);
            self.shared.1.notify_all();
            return;
        }
    }

    /// Whether a cloud is no longer in the target.
    fn is_stale(&self, generations_of: &[u64]) -> bool {
        let shared = self.lock();
        let needed = |target: &JournalTarget| {
            target.edited.iter().any(|e| generations(&e.cloud) == generations_of)
        };
        shared.end == Some(JournalEnd::Remove)
            || shared.target.as_ref().is_some_and(|target| !needed(target))
    }

    /// Writes the target to disk.
    fn write(&mut self, target: &JournalTarget) -> anyhow::Result<()> {
        if target.edited.is_empty() {
            self.session.take().into_iter().for_each(Session::remove);
            self.files.clear();
            self.remove_adopted();
            return Ok(());
        }
        if self.session.is_none() {
            self.session = Some(Session::begin(&self.folder)?);
        }
        let (mut target, mut refused, mut sum) = (target.clone(), Vec::new(), 0);
        for edited in target.edited.clone() {
            sum += if edited.layer.is_some() { 0 } else { bytes(&edited.cloud) };
            let file = match sum > self.most_bytes {
                true => Err(format!(
                    "together they are larger than {:.1} GB; save them",
                    self.most_bytes as f64 / 1e9
                )),
                false => self.file_of(&edited),
            };
            match file {
                Ok(Some(file)) => self.put(&mut target, &edited, file),
                // The target has changed meanwhile.
                Ok(None) => return Ok(()),
                Err(reason) => refused.push((edited.row, reason)),
            }
        }
        let written = self.write_manifest(&target);
        self.clean();
        written?;
        if let Some((row, reason)) = refused.first() {
            let name = target.rows.get(*row).map(|row| row.name.clone()).unwrap_or_default();
            anyhow::bail!("{name}: {reason}");
        }
        self.remove_adopted();
        Ok(())
    }

    /// The file of a cloud, written if it is missing; `None` if the cloud left the target meanwhile.
    fn file_of(&mut self, edited: &EditedCloud) -> Result<Option<String>, String> {
        let Some(session) = &self.session else { return Ok(None) };
        let key = generations(&edited.cloud);
        if let Some(known) = self.files.iter().find(|known| known.generations == key) {
            return Ok(Some(known.file.clone()));
        }
        self.n += 1;
        if let Some((layer, n_surfels)) = &edited.layer {
            let file = format!("{}.{}", self.n, layers::ENDING);
            let written = layers::write(&session.folder.join(&file), *n_surfels, layer);
            written.map_err(|error| format!("{error:#}"))?;
            self.files.push(JournalFile { generations: key, file: file.clone() });
            return Ok(Some(file));
        }
        let file = format!("{}.ply", self.n);
        let path = session.folder.join(&file);
        let progress = |_| match self.is_stale(&key) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let comments = edited.comments.clone();
        let options = WriteOptions { comments, progress: &progress, ..WriteOptions::default() };
        match surfelshop_cloud::write(&path, &edited.cloud, &options) {
            Err(WriteError::Cancelled { .. }) => return Ok(None),
            Err(error) => return Err(error.to_string()),
            Ok(_nothing_lost) => {}
        }
        // For the case that the machine stops, and not only the program.
        File::open(&path).and_then(|file| file.sync_all()).map_err(|error| error.to_string())?;
        self.files.push(JournalFile { generations: key, file: file.clone() });
        Ok(Some(file))
    }

    fn write_manifest(&mut self, target: &JournalTarget) -> anyhow::Result<()> {
        let Some(session) = &self.session else { return Ok(()) };
        self.n += 1;
        let names = ["shown", "opened"].map(|what| format!("{what}-{}.scene.toml", self.n));
        for (name, scene) in names.iter().zip([&target.shown, &target.opened]) {
            let path = session.folder.join(name);
            scene.write(&path).with_context(|| "the scene cannot be kept".to_owned())?;
        }
        session.write(&Manifest::new(target.scene.clone(), names, target.rows.clone()))?;
        // The new manifest does not name the files of other clouds.
        let needed: Vec<Vec<u64>> = target.edited.iter().map(|e| generations(&e.cloud)).collect();
        self.files.retain(|file| needed.contains(&file.generations));
        Ok(())
    }

    /// Removes files that no manifest names.
    fn clean(&self) {
        let Some(session) = &self.session else { return };
        let latest = format!("-{}.scene.toml", self.n);
        for found in session.folder.read_dir().ok().into_iter().flatten().flatten() {
            let name = found.file_name().to_string_lossy().into_owned();
            let is_needed = self.files.iter().any(|file| file.file == name);
            if !is_needed && !name.ends_with(&latest) && name != "manifest.toml" {
                drop(fs::remove_file(found.path()));
            }
        }
    }

    fn remove_adopted(&self) {
        let adopted = std::mem::take(&mut self.lock().adopted);
        adopted.into_iter().for_each(|orphan| orphan.session.remove());
    }

    /// Names the file of an edited cloud in the scene and its row.
    fn put(&self, target: &mut JournalTarget, edited: &EditedCloud, file: String) {
        let Some(row) = target.rows.get_mut(edited.row) else { return };
        if let Some(cloud) = target.shown.clouds.get_mut(row.at)
            && let Some(session) = &self.session
        {
            match edited.layer.is_some() {
                true => cloud.layer = Some(session.folder.join(&file)),
                false => (cloud.path, cloud.transform) = (session.folder.join(&file), None),
            }
        }
        row.file = Some(file);
    }
}
