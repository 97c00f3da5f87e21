//! Requests of the user or the system that the program end: Ctrl-C, and the signals for it.
//!
//! A command that looks at them stops its work in order. Any other ends at once; either way nothing
//! unfinished is left in the user's folders.

use crate::output::terminal;
#[cfg(unix)]
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_cloud::files;
use surfelshop_runtime::plugins;

/// Exit code of a program that was interrupted twice, as shells count it: 128 and the signal's
/// number.
const INTERRUPTED: i32 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);

/// Whether a command looks at [`ASKED`].
static LOOKED_AT: AtomicBool = AtomicBool::new(false);

/// Notices from now on that the program is asked to end.
pub fn watch() {
    on_request(asked);
}

/// Has `asked` called, on a thread of its own, whenever the program is asked to end.
///
/// What was ignored when the program was started stays ignored, each signal by itself: under `nohup` the program
/// outlives a hangup and still ends in order at the others.
#[cfg(unix)]
pub fn on_request(asked: impl Fn() + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    let ignored = ignored();
    let is_wanted = |signal: &i32| ignored & 1 << (signal - 1) == 0;
    match signal_hook::iterator::Signals::new(
        [SIGINT, SIGTERM, SIGHUP].into_iter().filter(is_wanted),
    ) {
        Ok(mut signals) => {
            // Not waited for: it ends with the program.
            let noticed = move || signals.forever().for_each(|_signal| asked());
            let thread = std::thread::Builder::new().name("signals".to_owned()).spawn(noticed);
            if let Err(error) = thread {
                tracing::debug!("no thread could be started to notice requests to end: {error}");
            }
        }
        Err(error) => tracing::debug!("requests to end are not noticed: {error}"),
    }
    // A write beyond the limit of `ulimit -f` is an error with its line then, and not the end of the program.
    if let Err(error) = signal_hook::flag::register(SIGXFSZ, Arc::default()) {
        tracing::debug!("writes beyond a limit end the program: {error}");
    }
}

/// Has `asked` called, on a thread of its own, whenever the program is asked to end.
#[cfg(not(unix))]
pub fn on_request(asked: impl Fn() + Send + 'static) {
    if let Err(error) = ctrlc::set_handler(asked) {
        tracing::debug!("requests to end are not noticed: {error}");
    }
}

/// The signals that whoever started the program wants it to outlive: a bit each, the first the lowest.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

fn asked() {
    let looked_at = LOOKED_AT.load(Ordering::Relaxed);
    if looked_at && !ASKED.swap(true, Ordering::Relaxed) {
        return;
    }
    // Held to the end, so that nobody begins another file.
    let _nobody_writes = files::abandon();
    if looked_at {
        plugins::leave(INTERRUPTED);
    }
    terminal::note("cancelled");
    plugins::leave(1)
}

/// Whether the program was asked to end, for a command that stops by itself then: as long as this is there, a first request
/// does no more than to set it. A second one ends the program at once.
#[derive(Debug)]
pub struct StopRequest(());

impl std::ops::Deref for StopRequest {
    type Target = AtomicBool;

    fn deref(&self) -> &AtomicBool {
        &ASKED
    }
}

impl Drop for StopRequest {
    fn drop(&mut self) {
        LOOKED_AT.store(false, Ordering::Relaxed);
    }
}

/// Looks at requests to end from now on.
#[must_use]
pub fn looked_at() -> StopRequest {
    LOOKED_AT.store(true, Ordering::Relaxed);
    StopRequest(())
}

/// Whether the program was asked to end while a command looked, for what runs several.
pub fn was_asked() -> bool {
    ASKED.load(Ordering::Relaxed)
}
