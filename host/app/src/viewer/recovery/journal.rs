//! Keeps edited clouds on disk while they are in no file of the user's, on a thread of its own.
//!
//! What is wanted on disk is told after every change; what was told last counts, and writing what is not
//! wanted any more stops. An edit goes on whether it can be kept or not.

use super::session::{Left, Manifest, Row, Session};
use crate::viewer::stock::generations;
use anyhow::Context as _;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use surfelshop_cloud::scene::SceneFile;
use surfelshop_cloud::{Cloud, WriteError, WriteOptions};

/// Most bytes of columns that are kept for the case of a crash: it is the disk of the user's home.
pub(crate) const MOST_BYTES: u64 = 4 << 30;

/// How long the end of the thread is waited for: writing a gigabyte takes seconds.
const FAREWELL: Duration = Duration::from_secs(10);

/// An edited cloud.
#[derive(Clone)]
pub(super) struct Edited {
    /// Which of the rows is about it.
    pub(super) row: usize,
    pub(super) cloud: Cloud,
    pub(super) comments: Vec<String>,
}

/// What is to be on disk.
#[derive(Clone, Default)]
pub(super) struct Wish {
    pub(super) scene: Option<PathBuf>,
    pub(super) rows: Vec<Row>,
    pub(super) edited: Vec<Edited>,
    pub(super) shown: SceneFile,
    pub(super) opened: SceneFile,
}

/// How it ends.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    /// What is on disk stays for the next start.
    Keep,
    /// It is not needed any more.
    Remove,
}

#[derive(Default)]
struct Shared {
    wish: Option<Wish>,
    works: bool,
    end: Option<End>,
    /// Sessions whose edits are open here again: to be removed once these are on disk anew.
    adopted: Vec<Left>,
    faults: Vec<String>,
}

/// The window's end of the thread, which starts with the first edit.
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

    /// Says what is to be on disk; `wake` is called when something went wrong.
    pub(super) fn want(&mut self, wish: Wish, wake: impl Fn() + Send + 'static) {
        if !self.has_thread && wish.edited.is_empty() && self.lock().adopted.is_empty() {
            return;
        }
        {
            let mut shared = self.lock();
            shared.wish = Some(wish);
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

    /// Takes on what another window left, which is open here now.
    pub(super) fn adopt(&self, left: Left) {
        self.lock().adopted.push(left);
    }

    /// What went wrong since the last call.
    pub(super) fn faults(&self) -> Vec<String> {
        std::mem::take(&mut self.lock().faults)
    }

    /// Whether all that is wanted is on disk.
    #[cfg(test)]
    pub(crate) fn is_idle(&self) -> bool {
        !self.lock().works
    }

    #[cfg(test)]
    pub(crate) fn keep_at_most(&mut self, bytes: u64) {
        self.most_bytes = bytes;
    }

    /// Ends the thread, and waits for that a while.
    pub(crate) fn finish(&mut self, end: End) {
        let mut shared = self.lock();
        shared.end = Some(end);
        self.shared.1.notify_all();
        if self.has_thread {
            let works = |shared: &mut Shared| shared.works || shared.end.is_some();
            let waited = self.shared.1.wait_timeout_while(shared, FAREWELL, works);
            shared = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        if end == End::Remove {
            shared.adopted.drain(..).for_each(|left| left.session.remove());
        }
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        let mut shared = self.lock();
        shared.end.get_or_insert(End::Keep);
        self.shared.1.notify_all();
    }
}

/// A cloud that is on disk.
struct Kept {
    generations: Vec<u64>,
    file: String,
}

/// The thread.
struct Writer {
    folder: PathBuf,
    most_bytes: u64,
    shared: Arc<(Mutex<Shared>, Condvar)>,
    session: Option<Session>,
    files: Vec<Kept>,
    /// Counts the files.
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
            let idles = |shared: &mut Shared| shared.wish.is_none() && shared.end.is_none();
            let waited = self.shared.1.wait_while(shared, idles);
            let mut shared = waited.unwrap_or_else(PoisonError::into_inner);
            let (wish, end) = (shared.wish.take(), shared.end);
            drop(shared);
            if let Some(wish) = wish.filter(|_| end != Some(End::Remove)) {
                if let Err(error) = self.fulfil(&wish) {
                    let line = format!("edits are not kept for the case of a crash: {error:#}");
                    self.lock().faults.push(line);
                    wake();
                }
                let mut shared = self.lock();
                shared.works = shared.wish.is_some();
                continue;
            }
            if end == Some(End::Remove) {
                self.session.take().into_iter().for_each(Session::remove);
            }
            // Unlocked before the window is told.
            self.session = None;
            let mut shared = self.lock();
            (shared.works, shared.end) = (false, None);
            self.shared.1.notify_all();
            return;
        }
    }

    /// Whether a cloud is not wanted any more.
    fn is_stale(&self, generations_of: &[u64]) -> bool {
        let shared = self.lock();
        let wanted =
            |wish: &Wish| wish.edited.iter().any(|e| generations(&e.cloud) == generations_of);
        shared.end == Some(End::Remove) || shared.wish.as_ref().is_some_and(|wish| !wanted(wish))
    }

    fn fulfil(&mut self, wish: &Wish) -> anyhow::Result<()> {
        if wish.edited.is_empty() {
            self.session.take().into_iter().for_each(Session::remove);
            self.files.clear();
            self.remove_adopted();
            return Ok(());
        }
        if self.session.is_none() {
            self.session = Some(Session::begin(&self.folder)?);
        }
        let (mut wish, mut refused, mut sum) = (wish.clone(), Vec::new(), 0);
        for edited in wish.edited.clone() {
            sum += bytes(&edited.cloud);
            let kept = match sum > self.most_bytes {
                true => Err(format!(
                    "together they are larger than {:.1} GB; save them",
                    self.most_bytes as f64 / 1e9
                )),
                false => self.kept(&edited),
            };
            match kept {
                Ok(Some(file)) => self.put(&mut wish, &edited, file),
                // Something else is wanted by now.
                Ok(None) => return Ok(()),
                Err(reason) => refused.push((edited.row, reason)),
            }
        }
        let written = self.write_manifest(&wish);
        self.clean();
        written?;
        if let Some((row, reason)) = refused.first() {
            let name = wish.rows.get(*row).map(|row| row.name.clone()).unwrap_or_default();
            anyhow::bail!("{name}: {reason}");
        }
        self.remove_adopted();
        Ok(())
    }

    /// The file of a cloud, written where it is not there yet; nothing where it is not wanted any more.
    fn kept(&mut self, edited: &Edited) -> Result<Option<String>, String> {
        let Some(session) = &self.session else { return Ok(None) };
        let key = generations(&edited.cloud);
        if let Some(known) = self.files.iter().find(|known| known.generations == key) {
            return Ok(Some(known.file.clone()));
        }
        self.n += 1;
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
            Ok(()) => {}
        }
        // Also where the machine stops, not only the program.
        File::open(&path).and_then(|file| file.sync_all()).map_err(|error| error.to_string())?;
        self.files.push(Kept { generations: key, file: file.clone() });
        Ok(Some(file))
    }

    fn write_manifest(&mut self, wish: &Wish) -> anyhow::Result<()> {
        let Some(session) = &self.session else { return Ok(()) };
        self.n += 1;
        let names = ["shown", "opened"].map(|what| format!("{what}-{}.scene.toml", self.n));
        for (name, scene) in names.iter().zip([&wish.shown, &wish.opened]) {
            let path = session.folder.join(name);
            scene.write(&path).with_context(|| "the scene cannot be kept".to_owned())?;
        }
        session.write(&Manifest::new(wish.scene.clone(), names, wish.rows.clone()))?;
        // Files of clouds that are not wanted any more can go now.
        let wanted: Vec<Vec<u64>> = wish.edited.iter().map(|e| generations(&e.cloud)).collect();
        self.files.retain(|kept| wanted.contains(&kept.generations));
        Ok(())
    }

    /// Removes files that are of nothing wanted.
    fn clean(&self) {
        let Some(session) = &self.session else { return };
        let latest = format!("-{}.scene.toml", self.n);
        for found in session.folder.read_dir().ok().into_iter().flatten().flatten() {
            let name = found.file_name().to_string_lossy().into_owned();
            let is_kept = self.files.iter().any(|kept| kept.file == name);
            if !is_kept && !name.ends_with(&latest) && name != "manifest.toml" {
                drop(fs::remove_file(found.path()));
            }
        }
    }

    fn remove_adopted(&self) {
        let adopted = std::mem::take(&mut self.lock().adopted);
        adopted.into_iter().for_each(|left| left.session.remove());
    }

    /// Has the scene name the file of an edited cloud, which stands as it is.
    fn put(&self, wish: &mut Wish, edited: &Edited, file: String) {
        let Some(row) = wish.rows.get_mut(edited.row) else { return };
        if let Some(cloud) = wish.shown.clouds.get_mut(row.at)
            && let Some(session) = &self.session
        {
            (cloud.path, cloud.transform) = (session.folder.join(&file), None);
        }
        row.file = Some(file);
    }
}
