//! What the window of settings remembers.

use surfelshop_session::trust_file::TrustFile;

/// A page of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Page {
    #[default]
    Appearance,
    Views,
    Drawing,
    Shortcuts,
    Plugins,
}

impl Page {
    /// All, in the order of the list.
    pub(crate) const ALL: [Self; 5] =
        [Self::Appearance, Self::Views, Self::Drawing, Self::Shortcuts, Self::Plugins];

    /// The name in the list.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Appearance => "Appearance",
            Self::Views => "Views",
            Self::Drawing => "Drawing",
            Self::Shortcuts => "Shortcuts",
            Self::Plugins => "Plugins",
        }
    }
}

/// What the window remembers from frame to frame.
#[derive(Default)]
pub(crate) struct SettingsWindow {
    pub(crate) page: Page,
    /// Words that the shown shortcuts have.
    pub(super) search: String,
    /// The command that waits for a new shortcut.
    pub(crate) waits: Option<&'static str>,
    /// Why the last one was refused.
    pub(super) refused: Option<String>,
    /// The trusted plugins, or why they cannot be read.
    pub(super) trusted: Option<Result<TrustFile, String>>,
    /// What the folder of what can be made again takes, bytes.
    pub(super) cache: Option<u64>,
}
