//! How long the host waits for a plugin's code.
//!
//! Code that runs cannot be stopped from outside without harm, so what does not answer in time is
//! left alone on its thread: the thread is abandoned, nothing joins it, and the process ends
//! without waiting for it.

use crate::boundary::Fault;
use std::cell::Cell;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// As much as main threads have on most systems; plugins may count on it.
const STACK_BYTES: usize = 8 << 20;

/// How long the host waits for a plugin's code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeouts {
    /// For the library's own initialisers and the unit's description of itself, together.
    pub load: Duration,
    /// For an instance to be made.
    pub create: Duration,
    /// For a frame to be described.
    pub frame: Duration,
    /// For a tool to stop, once it was asked to; while it works, it has all the time it needs.
    pub cancel: Duration,
}

impl Default for Timeouts {
    fn default() -> Self {
        let (start, frame) = (Duration::from_secs(10), Duration::from_secs(5));
        Self { load: start, create: start, frame, cancel: Duration::from_secs(3) }
    }
}

impl Timeouts {
    /// The same for every call.
    #[must_use]
    pub fn of(limit: Duration) -> Self {
        Self { load: limit, create: limit, frame: limit, cancel: limit }
    }
}

/// Runs plugin code on a thread of its own and waits at most this long for what it returns.
pub(crate) fn within<T: Send + 'static>(
    limit: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Fault> {
    get_ready_to_wait();
    let (send, receive) = mpsc::sync_channel(1);
    on_own_thread(move || {
        // Nobody receives where the host stopped waiting.
        drop(send.send(work()));
    })?;
    receive.recv_timeout(limit).map_err(|error| missing(error, limit))
}

/// Does what a thread's first wait on a channel does once: it registers the end of a thread-local
/// value, for which the C library takes the lock of its loader. A library whose initialiser never
/// ends holds that lock for ever, so this must have happened before.
fn get_ready_to_wait() {
    thread_local! {
        static READY: Cell<bool> = const { Cell::new(false) };
    }
    if !READY.replace(true) {
        let (_send, receive) = mpsc::sync_channel::<()>(1);
        // Shorter waits may end before they begin.
        let _timed_out = receive.recv_timeout(Duration::from_millis(1));
    }
}

/// Starts a thread that nobody waits for.
pub(crate) fn on_own_thread(work: impl FnOnce() + Send + 'static) -> Result<(), Fault> {
    let builder = thread::Builder::new().name("plugin".to_owned()).stack_size(STACK_BYTES);
    match builder.spawn(work) {
        Ok(_abandoned) => Ok(()),
        Err(error) => Err(Fault::NotAsked(format!("there is no thread for it: {error}"))),
    }
}

/// Why there is no answer.
pub(super) fn missing(error: RecvTimeoutError, limit: Duration) -> Fault {
    match error {
        RecvTimeoutError::Timeout => Fault::TimedOut(limit),
        RecvTimeoutError::Disconnected => Fault::Misbehaved("it ended its thread".to_owned()),
    }
}
