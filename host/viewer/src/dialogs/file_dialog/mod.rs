//! The program's own file dialog, for desktops without one.

mod dialog;
mod listing;

pub(super) use dialog::{Completion, FileDialog, Outcome, Purpose, Request};
