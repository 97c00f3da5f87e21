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
pub(crate) fn watch() {
    if let Err(error) = ctrlc::set_handler(asked) {
        tracing::debug!("requests to end will not be noticed: {error}");
    }
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
    &ASKED
}
