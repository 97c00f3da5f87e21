//! Whether a thread was still running when its owner was dropped.

use std::sync::atomic::{AtomicBool, Ordering};

static ABANDONED: AtomicBool = AtomicBool::new(false);

/// Whether a thread was still running when its owner was dropped. Returning from `main` would then
/// unload the graphics driver while the thread uses it.
pub(crate) fn any_abandoned() -> bool {
    ABANDONED.load(Ordering::Relaxed)
}

/// Records that a thread is left running.
pub(crate) fn mark_abandoned() {
    ABANDONED.store(true, Ordering::Relaxed);
}
