//! The state of panels, menus and dialogs.

use super::Selection;
use super::manual::ManualWindow;
use super::outliner::BookmarkPictures;
use crate::commands::Palette;
use crate::dialogs::Dialogs;
use crate::export::{ExportForm, ExportJob};
use crate::preferences::SettingsWindow;
use crate::start::Thumbnails;

/// What panels, menus and dialogs remember from frame to frame.
#[derive(Default)]
pub(crate) struct Panels {
    pub(crate) dialogs: Dialogs,
    /// What is selected, and what is being renamed to which words.
    pub(crate) selection: Selection,
    pub(crate) renaming: Option<(Selection, String)>,
    /// Small pictures of remembered cameras on the screen.
    pub(super) pictures: BookmarkPictures,
    /// The typed name of a preset.
    pub(crate) preset: String,
    /// Whether the list of plugins is open.
    pub(crate) plugin_list: bool,
    /// Whether the list of mouse and keys is open.
    pub(crate) key_list: bool,
    pub(crate) palette: Palette,
    /// Whether the keyboard goes to the menus next.
    pub(crate) goes_to_menus: bool,
    /// Whether these windows are open.
    pub(crate) settings_window: bool,
    pub(crate) settings: SettingsWindow,
    pub(crate) about: bool,
    /// Whether the start page is shown although something is open.
    pub(crate) start_page: bool,
    pub(crate) thumbnails: Thumbnails,
    pub(crate) manual: ManualWindow,
    pub(crate) export_form: ExportForm,
    pub(crate) export_job: Option<ExportJob>,
}
