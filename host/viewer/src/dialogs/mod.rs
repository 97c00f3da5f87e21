//! Questions and file dialogs over the window.
//!
//! `state` holds the open file dialog, `request` describes it, and `files` opens it and takes in its
//! result: it is the desktop's, or where there is none the one in `file_dialog`.

mod file_dialog;
pub(crate) mod files;
mod portal;
pub(crate) mod recovery;
mod request;
mod state;
pub(crate) mod unsaved;

pub(crate) use state::{DialogPurpose, Dialogs, ParameterOwner};
