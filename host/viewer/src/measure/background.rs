//! A value that a thread computes.

use eframe::egui::Context;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// A value that a thread computes.
pub(super) struct BackgroundJob<T>(Receiver<T>);

impl<T: Send + 'static> BackgroundJob<T> {
    /// Starts the thread, which wakes the window at its end.
    pub(super) fn start(
        ctx: &Context,
        make: impl FnOnce() -> T + Send + 'static,
    ) -> Result<Self, String> {
        let (send, receive) = channel();
        let wake = ctx.clone();
        let thread = std::thread::Builder::new().name("measure".to_owned()).spawn(move || {
            // The measurement may be cancelled already.
            drop(send.send(make()));
            wake.request_repaint();
        });
        thread.map(|_| Self(receive)).map_err(|error| format!("nothing can be measured: {error}"))
    }

    /// The value, once it is there; an error where the thread ended without it.
    pub(super) fn result(&self) -> Option<Result<T, String>> {
        match self.0.try_recv() {
            Ok(made) => Some(Ok(made)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                Some(Err("a measurement ended without a word".to_owned()))
            }
        }
    }
}
