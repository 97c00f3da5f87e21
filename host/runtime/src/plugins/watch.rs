//! Notices that plugin files change.
//!
//! A linker writes in pieces, removes and renames, and whoever reads too early reads half a file,
//! so a change is reported once a file has stayed the same for [`QUIET`]. What has changed is
//! found by looking at the files; what the system tells is only taken as a hint to look, since
//! paths, kinds and completeness of its events differ from system to system, and some file
//! systems have none.

use super::discover::{Place, SearchPath, libraries_in};
use notify::{RecommendedWatcher, RecursiveMode, Watcher as _};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant, SystemTime};
use std::{io, thread};

/// How long a file must stay the same before its change is reported.
pub const QUIET: Duration = Duration::from_millis(150);
/// How often files are looked at while one of them changes.
const BUSY: Duration = Duration::from_millis(20);
/// How often files are looked at without a hint, in case one got lost.
const IDLE: Duration = Duration::from_secs(1);

/// A plugin file that changed, appeared or went away.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// The file, as its place names it.
    pub path: PathBuf,
    /// Whether it is there.
    pub exists: bool,
    /// When it was first seen to have changed.
    pub detected_at: Instant,
    /// When it had stayed the same for long enough.
    pub settled_at: Instant,
}

impl Changed {
    /// How long it took to make sure that the file is complete.
    #[must_use]
    pub fn debounce(&self) -> Duration {
        self.settled_at - self.detected_at
    }
}

/// Watches plugin files and folders until it is dropped.
pub struct Watcher {
    messages: Sender<Message>,
}

enum Message {
    /// Something happened somewhere.
    Look,
    Watch(Place, Vec<(PathBuf, Stamp)>),
    Stop,
}

impl Watcher {
    /// Watches the places of a search path, and calls `report` on a thread of its own for each
    /// file that changes. Start it before the registry is scanned, so that nothing happens
    /// between the two unseen.
    ///
    /// # Errors
    /// Where there is no thread for it.
    pub fn start(
        search: &SearchPath,
        report: impl FnMut(Changed) + Send + 'static,
    ) -> io::Result<Self> {
        let (messages, received) = mpsc::channel();
        let hint = messages.clone();
        let mut watch = Watch::new(Box::new(report), hint);
        for place in search.folders.iter().chain(&search.files) {
            watch.add(place, known(place));
        }
        thread::Builder::new()
            .name("plugin watch".to_owned())
            .spawn(move || watch.run(&received))?;
        Ok(Self { messages })
    }

    /// Watches another file or folder; what changes from now on is reported.
    pub fn add(&self, place: Place) {
        let known = known(&place);
        // The other end is there for as long as this one.
        drop(self.messages.send(Message::Watch(place, known)));
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        drop(self.messages.send(Message::Stop));
    }
}

/// What tells one state of a file from another without reading it; `None` where it is missing.
type Stamp = Option<(u64, Option<SystemTime>, u64)>;

/// A file that is watched.
struct Watched {
    stamp: Stamp,
    /// When it was first and last seen to change, since it was last reported.
    changing: Option<(Instant, Instant)>,
}

/// The watching thread's own.
struct Watch {
    report: Box<dyn FnMut(Changed) + Send>,
    /// `None` where the system gives no hints.
    hints: Option<RecommendedWatcher>,
    hinted: BTreeSet<PathBuf>,
    folders: Vec<Place>,
    files: BTreeMap<PathBuf, Watched>,
}

impl Watch {
    fn new(report: Box<dyn FnMut(Changed) + Send>, hint: Sender<Message>) -> Self {
        let hints = notify::recommended_watcher(move |event: notify::Result<notify::Event>| {
            if !event.is_ok_and(|event| event.kind.is_access()) {
                drop(hint.send(Message::Look));
            }
        });
        let hints = hints
            .inspect_err(|error| tracing::warn!(%error, "files are looked at once a second"))
            .ok();
        let (hinted, folders, files) = Default::default();
        Self { report, hints, hinted, folders, files }
    }

    fn add(&mut self, place: &Place, known: Vec<(PathBuf, Stamp)>) {
        // Files are replaced, and a watch on one would go with it: its folder is watched.
        let folder = if is_file(place) { place.path.parent() } else { Some(place.path.as_path()) };
        if let Some(folder) = folder {
            self.ask_for_hints(folder);
        }
        for (path, stamp) in known {
            self.files.entry(path).or_insert(Watched { stamp, changing: None });
        }
        if !is_file(place) && !self.folders.contains(place) {
            self.folders.push(place.clone());
        }
    }

    fn ask_for_hints(&mut self, folder: &Path) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if let Some(hints) = &mut self.hints
            && !self.hinted.contains(folder)
        {
            match hints.watch(folder, RecursiveMode::NonRecursive) {
                Ok(()) => drop(self.hinted.insert(folder.to_owned())),
                // A folder that does not exist yet, most often; it is looked for all the same.
                Err(error) => {
                    tracing::debug!(%error, folder = %folder.display(), "no hints from a folder");
                }
            }
        }
    }

    fn run(mut self, received: &Receiver<Message>) {
        loop {
            let busy = self.files.values().any(|watched| watched.changing.is_some());
            match received.recv_timeout(if busy { BUSY } else { IDLE }) {
                Ok(Message::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(Message::Watch(place, known)) => self.add(&place, known),
                Ok(Message::Look) => {
                    // A linker causes hundreds; one look is enough for all of them.
                    thread::sleep(BUSY / 4);
                    for message in received.try_iter() {
                        match message {
                            Message::Stop => return,
                            Message::Watch(place, known) => self.add(&place, known),
                            Message::Look => {}
                        }
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            self.look();
        }
    }

    fn look(&mut self) {
        let found: Vec<PathBuf> = self.folders.iter().flat_map(paths_in).collect();
        for path in found {
            self.files.entry(path).or_insert(Watched { stamp: None, changing: None });
        }
        for place in self.folders.clone() {
            self.ask_for_hints(&place.path);
        }
        let now = Instant::now();
        for (path, watched) in &mut self.files {
            let stamp = stamp(path);
            if stamp != watched.stamp {
                watched.stamp = stamp;
                let (first, _) = watched.changing.unwrap_or((now, now));
                watched.changing = Some((first, now));
            } else if let Some((detected_at, last)) = watched.changing
                && now.duration_since(last) >= QUIET
            {
                watched.changing = None;
                let (path, exists) = (path.clone(), stamp.is_some());
                (self.report)(Changed { path, exists, detected_at, settled_at: now });
            }
        }
    }
}

/// Whether a place is a file or will be one: what is missing and has an extension.
fn is_file(place: &Place) -> bool {
    place.path.is_file() || (!place.path.is_dir() && place.path.extension().is_some())
}

/// The files of a place as they are now.
fn known(place: &Place) -> Vec<(PathBuf, Stamp)> {
    let paths = if is_file(place) { vec![place.path.clone()] } else { paths_in(place) };
    paths.into_iter().map(|path| (path.clone(), stamp(&path))).collect()
}

fn paths_in(folder: &Place) -> Vec<PathBuf> {
    libraries_in(folder).into_iter().map(|place| place.path).collect()
}

fn stamp(path: &Path) -> Stamp {
    let metadata = path.metadata().ok().filter(|metadata| metadata.is_file())?;
    #[cfg(unix)]
    let file = std::os::unix::fs::MetadataExt::ino(&metadata);
    #[cfg(not(unix))]
    let file = 0;
    Some((metadata.len(), metadata.modified().ok(), file))
}
