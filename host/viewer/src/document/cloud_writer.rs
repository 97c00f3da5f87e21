//! A cloud is written on a thread of its own.

use super::open_clouds::OpenCloud;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_cloud::display::unhidden;
use surfelshop_cloud::{Cloud, WriteError, WriteOptions, Written, silent};
use surfelshop_session::input::formats::SessionFormats;

/// A cloud being written.
pub(crate) struct CloudWriter {
    /// Its index among the open clouds.
    pub(super) index: usize,
    /// [`Document::n_opened`](super::Document::n_opened) at the start.
    pub(super) n_opened: u64,
    pub(super) path: PathBuf,
    pub(super) cloud: Cloud,
    written: Receiver<Result<Written, WriteError>>,
}

impl CloudWriter {
    /// Starts the thread, which calls `wake` at its end.
    pub(super) fn start(
        open_cloud: &OpenCloud,
        (index, n_opened): (usize, u64),
        path: PathBuf,
        formats: Arc<SessionFormats>,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (send, written) = channel();
        // What a scene hides, files have all the same.
        let cloud = unhidden(&open_cloud.loaded.cloud);
        let (target, source) = (path.clone(), cloud.clone());
        let comments = open_cloud.loaded.summary.comments.clone();
        std::thread::Builder::new().name("saving".to_owned()).spawn(move || {
            let options = WriteOptions { comments, ..formats.writing(&silent) };
            // The window may be closed already.
            drop(send.send(surfelshop_cloud::write(&target, &source, &options)));
            wake();
        })?;
        Ok(Self { index, n_opened, path, cloud, written })
    }

    /// What the format could not hold, once the thread has ended.
    pub(super) fn finished(&self) -> Option<Result<Vec<String>, String>> {
        match self.written.try_recv() {
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("writing ended without a word".to_owned())),
            Ok(result) => {
                Some(result.map(|written| written.lost).map_err(|error| error.to_string()))
            }
        }
    }
}
