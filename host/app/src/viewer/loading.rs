//! Clouds being read on a thread of their own.

use crate::clouds::Clouds;
use crate::scenes::{Inputs, Source};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, mpsc::TryRecvError};
use surfelshop_cloud::scene::OpenedScene;
use surfelshop_cloud::{ReadError, ReadOptions};

/// What was read.
pub(crate) struct Read {
    pub(crate) clouds: Clouds,
    /// The scene, where one was among the files.
    pub(crate) scene: Option<OpenedScene>,
    /// For each cloud its place among all clouds of the scene, hidden ones too, and the files that
    /// were opened beside it, which follow them.
    pub(crate) entries: Vec<usize>,
}

/// Files on their way into memory.
pub(crate) struct Loading {
    pub(crate) files: Vec<PathBuf>,
    shared: Arc<Shared>,
    result: Receiver<Result<Read, String>>,
}

#[derive(Default)]
struct Shared {
    /// Thousandths of the whole.
    progress: AtomicU64,
    cancelled: AtomicBool,
}

impl Loading {
    /// Starts to read; `wake` is called now and then and at the end.
    pub(crate) fn start(
        files: Vec<PathBuf>,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let (send, result) = channel();
        let (read, state) = (files.clone(), shared.clone());
        std::thread::Builder::new().name("loading".to_owned()).spawn(move || {
            let read = read_all(&read, &state, &wake);
            // The window may be gone already.
            drop(send.send(read));
            wake();
        })?;
        Ok(Self { files, shared, result })
    }

    /// How far it is, in [0, 1].
    pub(crate) fn fraction(&self) -> f32 {
        self.shared.progress.load(Ordering::Relaxed) as f32 / 1000.0
    }

    /// Asks the reading to stop.
    pub(crate) fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// The clouds, or why they could not be read, once that is known.
    pub(crate) fn finished(&self) -> Option<Result<Read, String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("reading ended without a word".to_owned())),
        }
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.cancel();
    }
}

fn read_all(files: &[PathBuf], shared: &Shared, wake: &dyn Fn()) -> Result<Read, String> {
    let inputs = Inputs::open(files).map_err(|error| format!("{error:#}"))?;
    let n_sources = inputs.sources.len().max(1);
    let mut n_read = 0u32;
    let read = |file: &Path| -> Result<_, ReadError> {
        let progress = |fraction: f64| {
            let whole = (f64::from(n_read) + fraction.clamp(0.0, 1.0)) / n_sources as f64;
            let now = (whole * 1000.0) as u64;
            if shared.progress.swap(now, Ordering::Relaxed) != now {
                wake();
            }
            if shared.cancelled.load(Ordering::Relaxed) {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        };
        let options = ReadOptions { progress: &progress, ..ReadOptions::default() };
        let loaded = surfelshop_cloud::read(file, &options);
        n_read += 1;
        loaded
    };
    let clouds = Clouds::read_with(&inputs.sources, read).map_err(|error| format!("{error:#}"))?;
    let entries = entries(&inputs);
    Ok(Read { clouds, scene: inputs.opened, entries })
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

    fn result(loading: &Loading) -> Result<Read, String> {
        loop {
            if let Some(result) = loading.finished() {
                return result;
            }
            std::thread::yield_now();
        }
    }

    #[test]
    fn a_missing_file_is_named() {
        let loading = Loading::start(vec!["no/such/cloud.ply".into()], || ()).unwrap();
        let error = result(&loading).err().unwrap();
        assert!(error.contains("no/such/cloud.ply"), "{error}");
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
        let shared = Shared::default();
        shared.cancelled.store(true, Ordering::Relaxed);
        assert!(read_all(std::slice::from_ref(&path), &shared, &|| ()).is_err());
        let whole = read_all(&[path], &Shared::default(), &|| ()).unwrap();
        assert_eq!(whole.clouds.facts.n_surfels, 20_000);
    }
}
