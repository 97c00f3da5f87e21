//! Which shortcut runs which command.

use eframe::egui::KeyboardShortcut;

/// The shortcuts that are in use, by the ids of their commands; empty until they are assigned.
#[derive(Clone, Debug, Default)]
pub(crate) struct Keymap {
    /// In the order in which menus show those of a command.
    entries: Vec<(KeyboardShortcut, &'static str)>,
}

impl Keymap {
    /// Whether nothing is assigned yet.
    pub(super) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(super) fn add(&mut self, shortcut: KeyboardShortcut, id: &'static str) {
        self.entries.push((shortcut, id));
    }

    /// The command of a shortcut.
    pub(super) fn command(&self, shortcut: KeyboardShortcut) -> Option<&'static str> {
        self.entries.iter().find(|(other, _)| *other == shortcut).map(|(_, id)| *id)
    }

    /// All, in the order in which a press is tried: those with more modifiers first, since it holds the others, too.
    pub(super) fn by_modifiers(&self) -> Vec<(KeyboardShortcut, &'static str)> {
        let mut entries = self.entries.clone();
        entries.sort_by_key(|(shortcut, _)| {
            let modifiers = shortcut.modifiers;
            let held = [modifiers.command, modifiers.shift, modifiers.alt];
            std::cmp::Reverse(held.iter().filter(|held| **held).count())
        });
        entries
    }

    /// The shortcuts of a command.
    pub(super) fn of(&self, id: &str) -> Vec<KeyboardShortcut> {
        let own = self.entries.iter().filter(|(_, other)| *other == id);
        own.map(|(shortcut, _)| *shortcut).collect()
    }
}
