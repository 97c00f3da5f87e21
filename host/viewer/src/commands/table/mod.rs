//! All commands, by menu.

mod camera;
mod conditions;
mod file;
mod hands;
mod help;
mod look;
mod measures;
mod selection;
mod view;
mod window;

use super::command::Command;
use std::sync::LazyLock;

/// All commands, in the order of the menus.
pub(crate) static COMMANDS: LazyLock<Vec<&'static Command>> = LazyLock::new(|| {
    let tables: [&'static [Command]; 13] = [
        &file::FILE,
        &file::EDIT,
        &selection::SELECTION,
        &hands::HANDS,
        &measures::MEASURES,
        &view::CAMERA,
        &camera::CAMERAS,
        &view::OVER_PICTURES,
        &view::VIEWS,
        &view::MODES,
        &look::LOOK,
        &window::WINDOW,
        &help::HELP,
    ];
    tables.into_iter().flatten().collect()
});

/// The command of an id.
pub(crate) fn find(id: &str) -> Option<&'static Command> {
    COMMANDS.iter().find(|command| command.id == id).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::shortcut::{reserved, text};
    use std::collections::BTreeMap;

    /// Invariant: every command is described once, and no two share a shortcut
    #[test]
    fn every_command_has_a_name_a_tooltip_and_shortcuts_of_its_own() {
        let (mut ids, mut names, mut keys) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for command in COMMANDS.iter() {
            assert!(!command.name.is_empty() && command.id.is_ascii(), "{}", command.id);
            assert!(command.about.ends_with('.') && command.about.len() > 12, "{}", command.id);
            assert!(ids.insert(command.id, ()).is_none(), "{} twice", command.id);
            assert!(names.insert(command.name, ()).is_none(), "{} twice", command.name);
            for shortcut in command.shortcuts {
                assert_eq!(reserved(*shortcut), None, "{}", command.id);
                let other = keys.insert(text(*shortcut), command.id);
                assert_eq!(other, None, "{} and {other:?} share a shortcut", command.id);
            }
        }
        assert!(ids.len() > 50, "{}", ids.len());
    }

    /// Invariant: the manual lists every command with its shortcuts
    #[test]
    fn the_manual_lists_every_command_with_its_shortcuts() {
        let page = surfelshop_session::manual::PAGES.iter().find(|page| page.topic == "viewer");
        let page = page.unwrap().text;
        let rows = COMMANDS.iter().map(|command| {
            let keys: Vec<String> =
                command.shortcuts.iter().map(|key| format!("`{}`", text(*key))).collect();
            format!(
                "| {} | {} | `{}` | {} |",
                command.name,
                keys.join(", "),
                command.id,
                command.about
            )
        });
        let missing: Vec<String> = rows.filter(|row| !page.contains(row.as_str())).collect();
        assert!(missing.is_empty(), "use/viewer.md lacks:\n{}", missing.join("\n"));
        let n_rows =
            page.lines().filter(|line| line.starts_with("| ") && line.ends_with(". |")).count();
        assert_eq!(n_rows, COMMANDS.len(), "rows of the table and commands");
    }
}
