//! The program's own file dialog, for desktops without one.

mod dialog;
mod listing;

pub(super) use dialog::{FileDialog, Outcome, Purpose, Request};
