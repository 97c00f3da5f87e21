//! The state of panels, menus and dialogs.

use super::manual::ManualWindow;
use crate::dialogs::Dialogs;
use crate::export::{ExportForm, ExportJob};

/// What panels, menus and dialogs remember from frame to frame.
#[derive(Default)]
pub(crate) struct Panels {
    pub(crate) dialogs: Dialogs,
    /// The typed name of a preset.
    pub(crate) preset: String,
    /// Whether the list of plugins is open.
    pub(crate) plugin_list: bool,
    /// Whether the list of keys is open.
    pub(crate) key_list: bool,
    pub(crate) manual: ManualWindow,
    pub(crate) export_form: ExportForm,
    pub(crate) export_job: Option<ExportJob>,
}
