//! Commands to the thread, and the queue that orders them.

use super::view_request::{ViewRequest, ViewSlot};
use std::collections::{HashMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Instant;
use surfelshop_render::PreparedColumns;
use surfelshop_runtime::plugins::{Changed, Contents};

/// The thread's next piece of work.
pub(crate) enum RenderCommand {
    Draw(ViewSlot, Box<ViewRequest>),
    /// The queue is empty: a picture may be refined.
    Refine,
    /// The queue is empty and nothing is refined: memory that no visible picture needs may be freed.
    ReleaseUnused,
    /// A plugin, or a file that a parameter names, changed.
    FileChanged(Changed),
    /// The progress of a large cloud's upload in [0, 1], with the number of its thread.
    UploadProgress(u64, f32),
    /// A large cloud's upload is over.
    UploadFinished(Box<UploadedCloud>),
    /// Use a renderer again that was switched off.
    SwitchOn(String),
    /// The trust list changed; these contents are trusted until the window is closed.
    Trust(Option<Contents>),
    /// Use these plugin files besides the installed ones.
    AddPlugins(Vec<PathBuf>),
    /// Do not use a renderer.
    Avoid(String),
    /// There is more to see of the traced picture of this number.
    TraceProgress(ViewSlot, u64),
    /// Stop refining the picture of a slot.
    StopRefining(ViewSlot),
    /// Drop everything of a slot.
    Release(ViewSlot),
    /// Lose the device, as a driver loses it.
    #[cfg(test)]
    LoseDevice,
}

/// The result of a large cloud's upload.
pub(crate) struct UploadedCloud {
    pub(super) serial: u64,
    pub(super) prepared: Result<PreparedColumns, String>,
}

/// Work that has not begun.
#[derive(Default)]
struct PendingWork {
    requests: HashMap<ViewSlot, ViewRequest>,
    commands: VecDeque<RenderCommand>,
    closed: bool,
    /// The view of which a whole picture is being drawn, and what stops that.
    whole: Option<(ViewSlot, Arc<AtomicBool>)>,
}

/// The queue between the window and the thread; a clone is the same queue.
#[derive(Clone, Default)]
pub(crate) struct CommandQueue(Arc<(Mutex<PendingWork>, Condvar)>);

impl CommandQueue {
    fn change(&self, change: impl FnOnce(&mut PendingWork)) {
        let (pending, bell) = &*self.0;
        change(&mut pending.lock().unwrap_or_else(PoisonError::into_inner));
        bell.notify_one();
    }

    /// Adds a command, which is run before any picture is drawn.
    pub(super) fn add(&self, command: RenderCommand) {
        self.change(|pending| pending.commands.push_back(command));
    }

    /// Requests a picture; replaces a request for the same slot that has not begun.
    pub(crate) fn request(&self, slot: ViewSlot, request: ViewRequest) {
        self.change(|pending| {
            // A whole picture is of a view that is no more.
            if let Some((drawn, stop)) = &pending.whole
                && *drawn == slot
                && request.in_motion
            {
                stop.store(true, Ordering::Relaxed);
            }
            drop(pending.requests.insert(slot, request));
        });
    }

    /// Says that a whole picture of a view is being drawn, until another is or none; it is to be left once the view
    /// moves, which what is returned says.
    pub(crate) fn draws_whole(&self, slot: Option<ViewSlot>) -> Arc<AtomicBool> {
        let stop = Arc::new(AtomicBool::new(false));
        self.change(|pending| {
            let moves = |slot: &ViewSlot| pending.requests.get(slot).is_some_and(|r| r.in_motion);
            stop.store(slot.as_ref().is_some_and(moves), Ordering::Relaxed);
            pending.whole = slot.map(|slot| (slot, stop.clone()));
        });
        stop
    }

    /// Requests a picture, unless a request for the slot is pending.
    pub(super) fn request_if_none(&self, slot: ViewSlot, request: ViewRequest) {
        self.change(|pending| {
            pending.requests.entry(slot).or_insert(request);
        });
    }

    /// Removes a slot's request and adds [`RenderCommand::Release`].
    pub(super) fn release(&self, slot: ViewSlot) {
        self.change(|pending| {
            pending.requests.remove(&slot);
            pending.commands.push_back(RenderCommand::Release(slot));
        });
    }

    /// Ends the thread after its present command.
    pub(super) fn close(&self) {
        self.change(|pending| pending.closed = true);
    }

    /// Waits for the next command; `None` when the window is closed. Pictures are drawn in the order of
    /// their serial numbers, measured ones last. With an empty queue it returns [`RenderCommand::Refine`] from
    /// `refine` on, and else [`RenderCommand::ReleaseUnused`] from `release` on.
    pub(crate) fn next(
        &self,
        refine: Option<Instant>,
        release: Option<Instant>,
    ) -> Option<RenderCommand> {
        let (pending, bell) = &*self.0;
        let mut pending = pending.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if pending.closed {
                return None;
            }
            if let Some(command) = pending.commands.pop_front() {
                return Some(command);
            }
            let rank = |request: &ViewRequest| (request.for_measurement, request.serial);
            let oldest = pending.requests.iter().min_by_key(|(_, request)| rank(request));
            if let Some(slot) = oldest.map(|(slot, _)| *slot) {
                let request = pending.requests.remove(&slot)?;
                return Some(RenderCommand::Draw(slot, Box::new(request)));
            }
            let now = Instant::now();
            let is_due = |when: Option<Instant>| when.is_some_and(|when| when <= now);
            if is_due(refine) {
                return Some(RenderCommand::Refine);
            }
            if is_due(release) {
                return Some(RenderCommand::ReleaseUnused);
            }
            let Some(first) = [refine, release].into_iter().flatten().min() else {
                pending = bell.wait(pending).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            let woken = bell.wait_timeout(pending, first.saturating_duration_since(now));
            pending = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}
