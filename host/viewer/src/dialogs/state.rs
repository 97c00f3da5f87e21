//! The file dialog that is open, and what it is for.

use super::file_dialog::FileDialog;
use super::portal;
use std::path::PathBuf;
use std::sync::mpsc::Receiver;

/// What a file dialog is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum DialogPurpose {
    /// Open clouds or a scene.
    Open,
    /// Add clouds to what is open.
    Add,
    /// Save the scene.
    SaveScene,
    /// Save the cloud of this index.
    SaveCloud(usize),
    /// Export pictures.
    Pictures,
    /// Open an environment map.
    Probe,
    /// Choose a picture to measure against.
    Reference,
    /// Choose the file of a parameter.
    Value { owner: ParameterOwner, id: String, endings: Vec<String> },
}

/// The owner of a parameter whose file is chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ParameterOwner {
    /// A renderer in a pane.
    Renderer { pane: u32, renderer: String },
    /// A tool.
    Tool(String),
    /// A tracer that is measured against.
    Tracer(String),
}

/// The desktop's answer.
pub(super) enum SystemAnswer {
    /// The files; none if the user cancelled.
    Files(Vec<PathBuf>),
    /// It has no dialogs, and why.
    NoDialogs(String),
}

/// An open dialog.
pub(super) enum OpenDialog {
    System(Receiver<SystemAnswer>),
    Own(Box<FileDialog>),
}

/// The open dialog, and where dialogs come from.
pub(crate) struct Dialogs {
    pub(super) open: Option<(DialogPurpose, OpenDialog)>,
    /// Returns an error if the desktop has no dialogs.
    pub(crate) check_desktop: fn() -> Result<(), String>,
    /// Whether the user knows that the desktop has no dialogs.
    pub(super) reported: bool,
}

impl Default for Dialogs {
    fn default() -> Self {
        Self { open: None, check_desktop: portal::check_desktop, reported: false }
    }
}

impl Dialogs {
    /// Whether a dialog is open.
    pub(crate) fn are_open(&self) -> bool {
        self.open.is_some()
    }

    /// Whether the program's own dialog is open, which takes the keyboard.
    pub(crate) fn own_is_open(&self) -> bool {
        matches!(self.open, Some((_, OpenDialog::Own(_))))
    }
}
