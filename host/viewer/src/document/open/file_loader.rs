//! Files are read on a thread of their own.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, mpsc::TryRecvError};
use std::time::{Duration, Instant};
use surfelshop_cloud::scene::OpenedScene;
use surfelshop_cloud::{Loaded, PreviewSink, ReadError, ReadOptions};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::inside;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::UpAxis;

/// The files that were read.
pub(crate) struct LoadedFiles {
    pub(crate) clouds: Clouds,
    /// The scene, where one was among the files.
    pub(crate) scene: Option<OpenedScene>,
    /// The index of each cloud among all clouds of the scene, hidden ones too; files opened beside a
    /// scene follow.
    pub(crate) entries: Vec<usize>,
    /// Files that could not be read while others could, and why.
    pub(crate) unread: Vec<(PathBuf, String)>,
}

/// Files being read; dropping it stops the thread.
pub(crate) struct FileLoader {
    pub(crate) files: Vec<PathBuf>,
    /// Whether they come beside what is open; else they replace it.
    pub(crate) adds: bool,
    started: Instant,
    state: Arc<Progress>,
    previews: Receiver<Clouds>,
    result: Receiver<Result<LoadedFiles, String>>,
}

#[derive(Default)]
struct Progress {
    /// Thousandths of the whole.
    progress: AtomicU64,
    /// When the window was woken last, milliseconds from the start.
    woken: AtomicU64,
    cancelled: AtomicBool,
}

/// Time between two frames that show how far it is: more would take the processor from the reading.
const WAKE_INTERVAL: Duration = Duration::from_millis(80);

impl FileLoader {
    /// Starts the thread, which calls `wake` with its progress and at its end; `up` points upwards where no scene says
    /// another axis.
    pub(crate) fn start(
        files: Vec<PathBuf>,
        adds: bool,
        (formats, up): (SessionFormats, UpAxis),
        wake: impl Fn() + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let state = Arc::new(Progress::default());
        let (send, result) = channel();
        let (send_preview, previews) = channel();
        let (paths, progress) = (files.clone(), state.clone());
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        std::thread::Builder::new().name("loading".to_owned()).spawn(move || {
            let read = read_all(&paths, (&formats, up), &progress, &wake, &send_preview);
            // The window may be closed already.
            drop(send.send(read));
            wake();
        })?;
        Ok(Self { files, adds, started: Instant::now(), state, previews, result })
    }

    /// The progress in [0, 1].
    pub(crate) fn fraction(&self) -> f32 {
        self.state.progress.load(Ordering::Relaxed) as f32 / 1000.0
    }

    /// The time since the start.
    pub(crate) fn elapsed(&self) -> Duration {
        self.started.elapsed()
    }

    /// Stops the thread.
    pub(crate) fn cancel(&self) {
        self.state.cancelled.store(true, Ordering::Relaxed);
    }

    /// Some of the points of what was read so far, where they are new.
    pub(crate) fn preview(&self) -> Option<Clouds> {
        self.previews.try_iter().last()
    }

    /// The files, or why they could not be read, once the thread has ended.
    pub(crate) fn finished(&self) -> Option<Result<LoadedFiles, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("reading ended without a word".to_owned())),
        }
    }
}

impl Drop for FileLoader {
    fn drop(&mut self) {
        self.cancel();
    }
}

fn read_all(
    files: &[PathBuf],
    (formats, up): (&SessionFormats, UpAxis),
    state: &Progress,
    wake: &Arc<dyn Fn() + Send + Sync>,
    previews: &Sender<Clouds>,
) -> Result<LoadedFiles, String> {
    let mut inputs = Inputs::open(files).map_err(|error| format!("{error:#}"))?;
    let (n_sources, started) = (inputs.sources.len().max(1), Instant::now());
    let (is_scene, mut n_read) = (inputs.opened.is_some(), 0u32);
    let (mut done, fault) = (Vec::<(PathBuf, Loaded)>::new(), RefCell::new(None));
    let mut read = |file: &Path| -> Result<_, ReadError> {
        // Read before one of the others could not be.
        if let Some((_, loaded)) = done.iter().find(|(known, _)| known == file) {
            return Ok(loaded.clone());
        }
        let progress = |fraction: f64| {
            let whole = (f64::from(n_read) + fraction.clamp(0.0, 1.0)) / n_sources as f64;
            let now = (whole * 1000.0) as u64;
            if state.progress.swap(now, Ordering::Relaxed) != now {
                let passed = started.elapsed().as_millis() as u64;
                let woken = state.woken.load(Ordering::Relaxed);
                if passed.saturating_sub(woken) >= WAKE_INTERVAL.as_millis() as u64 {
                    state.woken.store(passed, Ordering::Relaxed);
                    wake();
                }
            }
            if state.cancelled.load(Ordering::Relaxed) {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        };
        let before = done.iter().map(|(_, loaded)| loaded.clone()).collect();
        let preview = preview_of(file, before, up, previews, wake);
        // Clouds of scenes move to their places when they are there.
        let preview = Some(&preview).filter(|_| !is_scene);
        let options = ReadOptions { preview, ..formats.reading(&progress) };
        let loaded = surfelshop_cloud::read(file, &options);
        n_read += 1;
        match &loaded {
            Ok(loaded) => done.push((file.to_owned(), loaded.clone())),
            Err(error) => *fault.borrow_mut() = Some((file.to_owned(), error.to_string())),
        }
        loaded
    };
    let mut unread = Vec::new();
    let clouds = loop {
        match Clouds::read_with(&inputs.sources, Some(formats), &mut read) {
            Ok(clouds) => break clouds,
            // Of several files the others are shown; a scene is not what it was without one.
            Err(error) => match fault.borrow_mut().take() {
                Some((file, line))
                    if !is_scene
                        && !state.cancelled.load(Ordering::Relaxed)
                        && inputs.sources.iter().any(|source| source.path != file) =>
                {
                    inputs.sources.retain(|source| source.path != file);
                    unread.push((file, line));
                }
                _ => return Err(all_lines(unread, format!("{error:#}"))),
            },
        }
    };
    // Where a scan is to be looked at from within is found here, since it takes a while.
    let of_scene = inputs.opened.as_ref().and_then(|opened| opened.scene.up);
    let clouds = inside::with_standpoint(clouds, of_scene.map_or(up, UpAxis::from));
    let entries = entries(&inputs);
    Ok(LoadedFiles { clouds, scene: inputs.opened, entries, unread })
}

/// Why none of the files could be read.
fn all_lines(unread: Vec<(PathBuf, String)>, last: String) -> String {
    let lines = unread.into_iter().map(|(_, line)| line).chain([last]);
    lines.collect::<Vec<_>>().join("\n")
}

/// Sends on what comes of a file before all of it is read, beside those that are there.
fn preview_of(
    file: &Path,
    done: Vec<Loaded>,
    up: UpAxis,
    previews: &Sender<Clouds>,
    wake: &Arc<dyn Fn() + Send + Sync>,
) -> PreviewSink {
    let name = file.display().to_string();
    let (previews, wake) = (previews.clone(), wake.clone());
    Arc::new(move |mut loaded: Loaded| {
        loaded.summary.file.clone_from(&name);
        // What holds of the whole is said of the whole.
        loaded.summary.warnings.clear();
        let all = done.iter().cloned().chain([loaded]).collect();
        // The window may be closed already.
        drop(previews.send(inside::with_standpoint(Clouds::of(all), up)));
        wake();
    })
}

fn entries(inputs: &Inputs) -> Vec<usize> {
    let of_scene = inputs.opened.iter().flat_map(|opened| &opened.scene.clouds);
    let n_in_scene = of_scene.clone().count();
    let mut shown = of_scene.enumerate().filter(|(_, cloud)| cloud.visible).map(|(i, _)| i);
    let mut beside = n_in_scene..;
    let entry = |source: &Source| {
        let next = if source.place.is_some() { shown.next() } else { beside.next() };
        next.unwrap_or(n_in_scene)
    };
    inputs.sources.iter().map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(loader: &FileLoader) -> Result<LoadedFiles, String> {
        loop {
            if let Some(result) = loader.finished() {
                return result;
            }
            std::thread::yield_now();
        }
    }

    fn formats() -> SessionFormats {
        SessionFormats::new(&Default::default())
    }

    #[test]
    fn a_missing_file_is_named() {
        let loader = FileLoader::start(
            vec!["no/such/cloud.ply".into()],
            false,
            (formats(), UpAxis::Auto),
            || (),
        )
        .unwrap();
        let error = result(&loader).err().unwrap();
        assert!(error.contains("no/such/cloud.ply"), "{error}");
    }

    #[test]
    fn the_others_are_shown_where_a_file_cannot_be_read() {
        let folder = tempfile::tempdir().unwrap();
        let [good, bad, other] = ["a.ply", "b.ply", "c.ply"].map(|name| folder.path().join(name));
        let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
                    property float z\nend_header\n1 2 3\n";
        std::fs::write(&good, text).unwrap();
        std::fs::write(&other, text).unwrap();
        std::fs::write(&bad, "ply\nformat").unwrap();
        let read = |files: &[&PathBuf]| {
            let files = files.iter().map(|file| file.to_path_buf()).collect();
            let loader = FileLoader::start(files, false, (formats(), UpAxis::Auto), || ()).unwrap();
            result(&loader)
        };
        let loaded = read(&[&good, &bad, &other]).unwrap();
        let files: Vec<_> =
            loaded.clouds.loaded.iter().map(|one| one.summary.file.clone()).collect();
        assert_eq!(files, [good.display().to_string(), other.display().to_string()]);
        assert_eq!((loaded.unread.len(), loaded.entries.len()), (1, 2));
        assert!(loaded.unread[0].1.contains("b.ply"), "{:?}", loaded.unread);
        let missing = folder.path().join("none.ply");
        let error = read(&[&bad, &missing]).err().unwrap();
        assert!(error.contains("b.ply") && error.contains("none.ply"), "{error}");
    }

    #[test]
    fn reading_can_be_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.ply");
        let mut text = "ply\nformat ascii 1.0\nelement vertex 20000\nproperty float x\n\
                        property float y\nproperty float z\nend_header\n"
            .to_owned();
        for i in 0..20_000 {
            text += &format!("{} {} 0\n", i % 141, i / 141);
        }
        std::fs::write(&path, text).unwrap();
        let state = Progress::default();
        state.cancelled.store(true, Ordering::Relaxed);
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(|| ());
        let (formats, previews) = (formats(), channel().0);
        let read = |state: &Progress| {
            let files = std::slice::from_ref(&path);
            read_all(files, (&formats, UpAxis::Auto), state, &wake, &previews)
        };
        assert!(read(&state).is_err());
        let whole = read(&Progress::default()).unwrap();
        assert_eq!(whole.clouds.facts.n_surfels, 20_000);
    }
}
