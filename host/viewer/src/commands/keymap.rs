//! Which shortcut runs which command: the usual ones, with the user's own in their place.

use super::command::Command;
use super::shortcut::{parse, reserved, text};
use super::table::{COMMANDS, find};
use eframe::egui::KeyboardShortcut;
use std::collections::BTreeMap;

/// The shortcuts that are in use.
#[derive(Clone)]
pub(crate) struct Keymap {
    /// In the order in which they are tried: those with more modifiers first, since a press holds the others, too.
    entries: Vec<(KeyboardShortcut, &'static Command)>,
}

fn n_modifiers(shortcut: KeyboardShortcut) -> usize {
    let modifiers = shortcut.modifiers;
    [modifiers.command, modifiers.shift, modifiers.alt].iter().filter(|held| **held).count()
}

impl Keymap {
    /// The usual shortcuts with the user's own; a line for each of those that cannot be used.
    pub(crate) fn new(changes: &BTreeMap<String, Vec<String>>) -> (Self, Vec<String>) {
        let is_changed = |command: &Command| changes.contains_key(command.id);
        let usual = COMMANDS.iter().filter(|command| !is_changed(command));
        let entries =
            usual.flat_map(|command| command.shortcuts.iter().map(move |s| (*s, *command)));
        let mut keymap = Self { entries: entries.collect() };
        let mut refused = Vec::new();
        for (id, typed) in changes {
            let Some(command) = find(id) else {
                refused.push(format!("settings.toml: shortcuts: there is no command `{id}`"));
                continue;
            };
            let own: Result<Vec<_>, String> = typed.iter().map(|one| keymap.free(one)).collect();
            let own = own.unwrap_or_else(|reason| {
                refused.push(format!(
                    "settings.toml: shortcuts: {id}: {reason}; its usual shortcut stays"
                ));
                // Unless another command has it now.
                let usual = command.shortcuts.iter().copied();
                usual.filter(|shortcut| keymap.command(*shortcut).is_none()).collect()
            });
            keymap.entries.extend(own.into_iter().map(|shortcut| (shortcut, command)));
        }
        keymap.entries.sort_by_key(|(shortcut, _)| std::cmp::Reverse(n_modifiers(*shortcut)));
        (keymap, refused)
    }

    /// A shortcut that no other command has.
    fn free(&self, typed: &str) -> Result<KeyboardShortcut, String> {
        let shortcut = parse(typed)?;
        if let Some(what) = reserved(shortcut) {
            return Err(format!("{typed} {what}"));
        }
        match self.command(shortcut) {
            Some(command) => Err(format!("{typed} is already that of `{}`", command.id)),
            None => Ok(shortcut),
        }
    }

    fn command(&self, shortcut: KeyboardShortcut) -> Option<&'static Command> {
        self.entries.iter().find(|(other, _)| *other == shortcut).map(|(_, command)| *command)
    }

    /// All, in the order in which they are tried.
    pub(super) fn entries(&self) -> &[(KeyboardShortcut, &'static Command)] {
        &self.entries
    }

    /// The shortcuts of a command, as text.
    pub(crate) fn of(&self, command: &Command) -> Vec<String> {
        let own = self.entries.iter().filter(|(_, other)| other.id == command.id);
        let mut own: Vec<KeyboardShortcut> = own.map(|(shortcut, _)| *shortcut).collect();
        // The first of the usual ones is the one that menus show.
        let place = |shortcut: &KeyboardShortcut| {
            let usual = command.shortcuts.iter().position(|usual| usual == shortcut);
            (usual.unwrap_or(usize::MAX), n_modifiers(*shortcut))
        };
        own.sort_by_key(place);
        own.into_iter().map(text).collect()
    }
}

impl Default for Keymap {
    fn default() -> Self {
        Self::new(&BTreeMap::new()).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(changes: &[(&str, &[&str])]) -> (Keymap, Vec<String>) {
        let owned = |keys: &[&str]| keys.iter().map(|key| (*key).to_owned()).collect();
        Keymap::new(&changes.iter().map(|(id, keys)| ((*id).to_owned(), owned(keys))).collect())
    }

    fn of(keymap: &Keymap, id: &str) -> Vec<String> {
        keymap.of(find(id).unwrap())
    }

    #[test]
    fn shortcuts_are_changed_swapped_and_taken_away() {
        let (keymap, refused) =
            changed(&[("split", &["F2", "Ctrl+2"]), ("measure", &[]), ("frame-all", &["M"])]);
        assert_eq!(refused, Vec::<String>::new());
        assert_eq!(of(&keymap, "split"), ["F2", "Ctrl+2"]);
        assert!(of(&keymap, "measure").is_empty());
        assert_eq!(of(&keymap, "frame-all"), ["M"]);
    }

    #[test]
    fn conflicts_are_refused_by_a_line() {
        for (id, typed, expected) in [
            ("split", "M", "M is already that of `measure`"),
            ("split", "W", "W flies forward"),
            ("split", "Shift+D", "flies to the right"),
            ("split", "Hyper+N", "expected a shortcut such as Ctrl+Shift+P"),
            ("no-such", "F2", "there is no command `no-such`"),
        ] {
            let (keymap, refused) = changed(&[(id, &[typed])]);
            assert_eq!(refused.len(), 1, "{refused:?}");
            assert!(refused[0].contains(expected), "{refused:?}");
            assert_eq!(of(&keymap, "split"), ["N"]);
        }
        let (keymap, refused) = changed(&[("flicker", &["F2"]), ("split", &["F2"])]);
        assert!(refused[0].contains("`flicker`"), "{refused:?}");
        assert_eq!(
            (of(&keymap, "split"), of(&keymap, "flicker")),
            (vec!["N".into()], vec!["F2".into()])
        );
    }

    #[test]
    fn a_press_is_tried_with_more_modifiers_first() {
        let order = Keymap::default();
        assert!(
            order.entries.windows(2).all(|pair| n_modifiers(pair[0].0) >= n_modifiers(pair[1].0))
        );
    }
}
