//! Requests of the user or the system that the program end: Ctrl-C, and the signals for it.
//!
//! A command that looks at them stops its work in order. Any other ends at once; either way nothing
//! unfinished is left in the user's folders.

use crate::terminal;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_cloud::files;
use surfelshop_engine::plugins;

/// Exit code of a program that was interrupted twice, as shells count it: 128 and the signal's
/// number.
const INTERRUPTED: i32 = 130;

static ASKED: AtomicBool = AtomicBool::new(false);

/// Whether a command looks at [`ASKED`].
static LOOKED_AT: AtomicBool = AtomicBool::new(false);

/// Notices from now on that the program is asked to end.
///
/// Not under `nohup`: the program is to outlive a hangup then, which could not be told from the other signals
/// here. What one of those leaves unfinished goes with the next command that writes there.
pub(crate) fn watch() {
    if !ignores_hangups() {
        notice();
    }
}

fn notice() {
    if let Err(error) = ctrlc::set_handler(asked) {
        // There is one already, or the system has none.
        tracing::debug!("requests to end are noticed by another, or not at all: {error}");
    }
}

/// Whether who started the program wants it to outlive a hangup.
fn ignores_hangups() -> bool {
    // SIGHUP is 1 on Linux, whose bit is the first.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_some_and(|mask| mask & 1 != 0)
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

/// Whether the program was asked to end, for a command that stops by itself then. A second request ends it at
/// once.
pub(crate) fn looked_at() -> &'static AtomicBool {
    LOOKED_AT.store(true, Ordering::Relaxed);
    notice();
    &ASKED
}
