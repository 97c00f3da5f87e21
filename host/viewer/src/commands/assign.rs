//! Shortcuts are assigned to commands: the usual ones, with the user's own in their place.

use super::command::Command;
use super::keymap::Keymap;
use super::shortcut::{parse, reserved, text};
use super::table::{COMMANDS, find};
use crate::window::Window;
use eframe::egui::KeyboardShortcut;
use std::collections::BTreeMap;

/// The usual shortcuts with the user's own; a line for each of those that cannot be used.
pub(super) fn assign(changes: &BTreeMap<String, Vec<String>>) -> (Keymap, Vec<String>) {
    let mut keymap = Keymap::default();
    let is_changed = |command: &Command| changes.contains_key(command.id);
    for command in COMMANDS.iter().filter(|command| !is_changed(command)) {
        command.shortcuts.iter().for_each(|shortcut| keymap.add(*shortcut, command.id));
    }
    let mut refused = Vec::new();
    for (id, typed) in changes {
        let Some(command) = find(id) else {
            refused.push(format!("settings.toml: shortcuts: there is no command `{id}`"));
            continue;
        };
        let own: Result<Vec<_>, String> = typed.iter().map(|one| free(&keymap, one)).collect();
        let own = own.unwrap_or_else(|reason| {
            let line = format!("shortcuts: {id}: {reason}; its usual shortcut stays");
            refused.push(format!("settings.toml: {line}"));
            // Unless another command has it now.
            let usual = command.shortcuts.iter().copied();
            usual.filter(|shortcut| keymap.command(*shortcut).is_none()).collect()
        });
        own.into_iter().for_each(|shortcut| keymap.add(shortcut, command.id));
    }
    (keymap, refused)
}

/// A shortcut that no other command has.
fn free(keymap: &Keymap, typed: &str) -> Result<KeyboardShortcut, String> {
    let shortcut = parse(typed)?;
    if let Some(what) = reserved(shortcut) {
        return Err(format!("{typed} {what}"));
    }
    match keymap.command(shortcut) {
        Some(id) => Err(format!("{typed} is already that of `{id}`")),
        None => Ok(shortcut),
    }
}

/// Why a command cannot have a shortcut.
pub(crate) fn check_shortcut(
    window: &Window,
    id: &str,
    shortcut: KeyboardShortcut,
) -> Result<(), String> {
    let typed = text(shortcut);
    if let Some(what) = reserved(shortcut) {
        return Err(format!("{typed} {what}"));
    }
    let other = window.keymap.command(shortcut).filter(|other| *other != id).and_then(find);
    match other {
        Some(other) => Err(format!("{typed} is already the shortcut of \"{}\"", other.name)),
        None => parse(&typed).map(|_shortcut| ()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(changes: &[(&str, &[&str])]) -> (Keymap, Vec<String>) {
        let owned = |keys: &[&str]| keys.iter().map(|key| (*key).to_owned()).collect();
        assign(&changes.iter().map(|(id, keys)| ((*id).to_owned(), owned(keys))).collect())
    }

    fn of(keymap: &Keymap, id: &str) -> Vec<String> {
        keymap.of(find(id).unwrap().id).into_iter().map(text).collect()
    }

    #[test]
    fn shortcuts_are_changed_swapped_and_taken_away() {
        let (keymap, refused) =
            changed(&[("split", &["F6", "Ctrl+2"]), ("measure", &[]), ("frame-all", &["M"])]);
        assert_eq!(refused, Vec::<String>::new());
        assert_eq!(of(&keymap, "split"), ["F6", "Ctrl+2"]);
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
            ("no-such", "F6", "there is no command `no-such`"),
        ] {
            let (keymap, refused) = changed(&[(id, &[typed])]);
            assert_eq!(refused.len(), 1, "{refused:?}");
            assert!(refused[0].contains(expected), "{refused:?}");
            assert_eq!(of(&keymap, "split"), ["N"]);
        }
        let (keymap, refused) = changed(&[("flicker", &["F6"]), ("split", &["F6"])]);
        assert!(refused[0].contains("`flicker`"), "{refused:?}");
        assert_eq!(
            (of(&keymap, "split"), of(&keymap, "flicker")),
            (vec!["N".into()], vec!["F6".into()])
        );
    }

    #[test]
    fn a_press_is_tried_with_more_modifiers_first() {
        let (usual, refused) = changed(&[]);
        assert!(refused.is_empty() && !usual.is_empty());
        let held = |(shortcut, _): &(KeyboardShortcut, &str)| {
            let modifiers = shortcut.modifiers;
            [modifiers.command, modifiers.shift, modifiers.alt].iter().filter(|on| **on).count()
        };
        assert!(usual.by_modifiers().windows(2).all(|pair| held(&pair[0]) >= held(&pair[1])));
    }
}
