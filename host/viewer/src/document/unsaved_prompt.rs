//! The state of the question before unsaved edits are lost.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the system ends the program, which asks no question.
static TERMINATES: AtomicBool = AtomicBool::new(false);

/// Records that the system ends the program.
pub(crate) fn set_terminating() {
    TERMINATES.store(true, Ordering::Relaxed);
}

/// Whether the system ends the program.
pub(crate) fn is_terminating() -> bool {
    TERMINATES.load(Ordering::Relaxed)
}

/// What would lose the edits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PromptCause {
    /// The window is closed.
    Close,
    /// Other files are opened.
    Open,
}

/// The question, or the saving that its answer began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct UnsavedPrompt {
    pub(crate) cause: PromptCause,
    /// While edits are saved: the cloud whose dialog was opened last, if any.
    pub(crate) saves: Option<Option<usize>>,
}
