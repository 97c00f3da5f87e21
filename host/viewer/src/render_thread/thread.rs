//! The window's end of the thread.

use super::abandoned::mark_abandoned;
use super::command::{CommandQueue, RenderCommand};
use super::event::{EventSender, RenderEvent};
use super::view_request::{ViewRequest, ViewSlot};
use super::worker::RenderWorker;
use std::cell::RefCell;
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::time::{Duration, Instant};
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;

/// How long dropping waits for the thread's end: most pictures are done by then.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(2);

/// The render thread; dropping it ends the thread.
pub(crate) struct RenderThread {
    queue: CommandQueue,
    events: Receiver<RenderEvent>,
    /// The event that was waited for, until it is taken.
    arrived: RefCell<Option<RenderEvent>>,
}

impl RenderThread {
    /// Starts the thread, which calls `wake` after each event.
    pub(crate) fn start(
        device: DeviceArguments,
        plugins: PluginFiles,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let queue = CommandQueue::default();
        let (send, events) = channel();
        let commands = queue.clone();
        std::thread::Builder::new().name("render".to_owned()).spawn(move || {
            let events = EventSender { send, wake: Box::new(wake) };
            if let Some(mut worker) = RenderWorker::open(device, plugins, events, &commands) {
                worker.run(&commands);
            }
        })?;
        Ok(Self { queue, events, arrived: RefCell::default() })
    }

    /// Requests a picture; replaces a request for the same slot that has not begun.
    pub(crate) fn request(&self, slot: ViewSlot, request: ViewRequest) {
        self.queue.request(slot, request);
    }

    /// Adds a command, which is run before any picture is drawn.
    pub(crate) fn add(&self, command: RenderCommand) {
        self.queue.add(command);
    }

    /// Drops the renderer of a slot, and a pending request for it.
    pub(crate) fn release(&self, slot: ViewSlot) {
        self.queue.release(slot);
    }

    /// Waits until there is an event, at most so long.
    pub(crate) fn wait(&self, most: Duration) {
        let mut arrived = self.arrived.borrow_mut();
        if arrived.is_none() {
            *arrived = self.events.recv_timeout(most).ok();
        }
    }

    /// The events since the last call; [`RenderEvent::NoDevice`] once the thread has ended by a fault.
    pub(crate) fn events(&self) -> Vec<RenderEvent> {
        let mut all: Vec<RenderEvent> = self.arrived.borrow_mut().take().into_iter().collect();
        loop {
            match self.events.try_recv() {
                Ok(event) => all.push(event),
                Err(TryRecvError::Empty) => return all,
                Err(TryRecvError::Disconnected) => {
                    if all.is_empty() {
                        let reason = "the thread that makes pictures has ended; save your scene \
                                      and start again";
                        all.push(RenderEvent::NoDevice(reason.to_owned()));
                    }
                    return all;
                }
            }
        }
    }
}

impl Drop for RenderThread {
    /// Ends the thread after its present picture, and waits at most [`SHUTDOWN_TIMEOUT`].
    fn drop(&mut self) {
        self.queue.close();
        let deadline = Instant::now() + SHUTDOWN_TIMEOUT;
        loop {
            match self.events.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => break,
            }
        }
        mark_abandoned();
    }
}
