//! The state of recovery: this window's journal, and the edits of earlier sessions.

use super::journal::Journal;
use super::session::{self, OrphanSession};
use crate::document::open_clouds::OpenClouds;
use std::path::{Path, PathBuf};
use surfelshop_runtime::plugins::state_folder;

/// The edits of this window, and those of earlier sessions.
pub(crate) struct Recovery {
    pub(crate) journal: Journal,
    /// The clouds and the scene that the journal was updated with last.
    pub(super) last: Option<(OpenClouds, Option<PathBuf>)>,
    /// Sessions about which the user has not decided yet.
    pub(crate) offered: Vec<OrphanSession>,
    /// Whether the user has chosen to delete the first one, which is asked again.
    pub(crate) deletes: bool,
    /// The session that is being read.
    pub(crate) reading: Option<OrphanSession>,
}

impl Recovery {
    /// In the user's state folder; none where the system has no such folder.
    pub(crate) fn of_user() -> Option<Self> {
        state_folder().map(|folder| Self::in_folder(&folder))
    }

    /// In a folder for the program's state.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        let folder = folder.join("recovery");
        let offered = session::orphans(&folder);
        Self { journal: Journal::new(folder), last: None, offered, deletes: false, reading: None }
    }

    /// Whether the user has to decide about a session.
    pub(crate) fn asks(&self) -> bool {
        !self.offered.is_empty() && self.reading.is_none()
    }
}
