//! A command.

use super::shortcut::text;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::{Context, KeyboardShortcut};

/// The menu that a command stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Menu {
    File,
    Edit,
    Select,
    Measure,
    Camera,
    View,
    Look,
    Window,
    Help,
}

impl Menu {
    /// All, in the order of the menu bar.
    pub(crate) const ALL: [Self; 9] = [
        Self::File,
        Self::Edit,
        Self::Select,
        Self::Measure,
        Self::Camera,
        Self::View,
        Self::Look,
        Self::Window,
        Self::Help,
    ];

    /// The name in the menu bar.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Edit => "Edit",
            Self::Select => "Select",
            Self::Measure => "Measure",
            Self::Camera => "Camera",
            Self::View => "View",
            Self::Look => "Look",
            Self::Window => "Window",
            Self::Help => "Help",
        }
    }
}

/// Something that the user can ask for.
pub(crate) struct Command {
    /// The word that the file of settings names it by.
    pub(crate) id: &'static str,
    pub(crate) name: &'static str,
    /// What it does, in a sentence.
    pub(crate) about: &'static str,
    pub(crate) icon: Icon,
    pub(crate) menu: Menu,
    /// Whether a line stands above it in the menu.
    pub(crate) begins_group: bool,
    /// The usual shortcuts, the first shown in menus.
    pub(crate) shortcuts: &'static [KeyboardShortcut],
    /// Why it cannot be used now.
    pub(crate) applies: fn(&Window) -> Result<(), &'static str>,
    /// Whether it is on, where it is one of several states.
    pub(crate) is_on: Option<fn(&Window) -> bool>,
    pub(crate) run: fn(&mut Window, &Context),
}

impl Command {
    /// A command that always applies and has no shortcut.
    pub(super) const fn new(
        (id, name, icon): (&'static str, &'static str, Icon),
        menu: Menu,
        about: &'static str,
        run: fn(&mut Window, &Context),
    ) -> Self {
        let (begins_group, shortcuts, is_on) = (false, &[] as &[_], None);
        let applies = always;
        Self { id, name, about, icon, menu, begins_group, shortcuts, applies, is_on, run }
    }

    /// With a line above it in the menu.
    pub(super) const fn group(self) -> Self {
        Self { begins_group: true, ..self }
    }

    /// With shortcuts.
    pub(super) const fn keys(self, shortcuts: &'static [KeyboardShortcut]) -> Self {
        Self { shortcuts, ..self }
    }

    /// With a condition.
    pub(super) const fn when(self, applies: fn(&Window) -> Result<(), &'static str>) -> Self {
        Self { applies, ..self }
    }

    /// With a state.
    pub(super) const fn state(self, is_on: fn(&Window) -> bool) -> Self {
        Self { is_on: Some(is_on), ..self }
    }
}

fn always(_window: &Window) -> Result<(), &'static str> {
    Ok(())
}

/// The shortcuts of a command, as text; the first is the one that menus show.
pub(crate) fn shortcuts(window: &Window, command: &Command) -> Vec<String> {
    window.keymap.of(command.id).into_iter().map(text).collect()
}

/// Why a command cannot be used now; `None` where it can.
pub(crate) fn why_not(window: &Window, command: &Command) -> Option<&'static str> {
    (command.applies)(window).err()
}

/// Runs a command, or says why it cannot be used.
pub(crate) fn run(window: &mut Window, ctx: &Context, command: &Command) {
    match why_not(window, command) {
        None => (command.run)(window, ctx),
        Some(reason) => window.messages.report(format!("{}: {reason}", command.name)),
    }
}
