//! Clouds being written on a thread of their own.

use super::dialogs;
use super::window::Window;
use eframe::egui::Context;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use surfelshop_cloud::{Cloud, WriteError, WriteOptions};

/// A cloud on its way to a file.
pub(crate) struct Saving {
    item: usize,
    /// Which opening of files the cloud is of.
    n_opened: u64,
    path: PathBuf,
    cloud: Cloud,
    written: Receiver<Result<(), WriteError>>,
}

impl Window {
    /// Begins to write one of the clouds, as it stands in the scene.
    pub(crate) fn save_cloud(&mut self, ctx: &Context, item: usize, path: &Path) {
        let Some(found) = self.shown.as_ref().and_then(|shown| shown.stock.items().get(item))
        else {
            return;
        };
        if let Some(saving) = &self.saving {
            let (first, path) = (saving.path.display(), path.display());
            self.messages.warn(format!("{path} was not written: {first} is still being written"));
            return;
        }
        // Named with its ending, so that it can be opened again.
        let path = dialogs::cloud_name(path);
        let path = std::path::absolute(&path).unwrap_or(path);
        let (send, written) = channel();
        let (cloud, target, wake) = (found.loaded.cloud.clone(), path.clone(), ctx.clone());
        let comments = found.loaded.summary.comments.clone();
        let writes = cloud.clone();
        let thread = std::thread::Builder::new().name("saving".to_owned()).spawn(move || {
            let options = WriteOptions { comments, ..WriteOptions::default() };
            // The window may be gone already.
            drop(send.send(surfelshop_cloud::write(&target, &writes, &options)));
            wake.request_repaint();
        });
        match thread {
            Ok(_) => {
                self.saving = Some(Saving { item, n_opened: self.n_opened, path, cloud, written })
            }
            Err(error) => self.messages.warn(format!("nothing can be written: {error}")),
        }
    }

    /// Notes a cloud that was written.
    pub(crate) fn take_saved(&mut self) {
        let Some(saving) = &self.saving else { return };
        let result = match saving.written.try_recv() {
            Err(TryRecvError::Empty) => return,
            Err(TryRecvError::Disconnected) => Err("writing ended without a word".to_owned()),
            Ok(result) => result.map_err(|error| error.to_string()),
        };
        let Some(Saving { item, n_opened, path, cloud, .. }) = self.saving.take() else { return };
        match result {
            Err(reason) => self.messages.warn(reason),
            Ok(()) => {
                self.messages.tell(format!("wrote {}", path.display()));
                if let Some(shown) = self.shown.as_mut().filter(|_| n_opened == self.n_opened) {
                    shown.stock = shown.stock.saved(item, &path, &cloud);
                }
            }
        }
    }
}
