//! Unsaved edits survive a crash: they are written to disk, and the next start offers them again.
//!
//! Written are the clouds with all columns and their history of tools, and the scene; undo steps are
//! not.

mod journal;
mod restore;
mod session;
mod state;
mod update;

pub(crate) use journal::JournalEnd;
pub(crate) use restore::{restore, restored_clouds};
pub(crate) use session::{CloudRow, Manifest};
pub(crate) use state::Recovery;
pub(crate) use update::{end, update};
