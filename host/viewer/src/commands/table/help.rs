//! Help.

use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::key;
use crate::theme::Icon;
use eframe::egui::Key;

pub(super) static HELP: [Command; 5] = [
    Command::new(
        ("keys", "Mouse and keys", Icon::Keyboard),
        Menu::Help,
        "Lists what the mouse does, and every shortcut.",
        |window, _| window.panels.key_list = !window.panels.key_list,
    )
    .keys(&[key(Key::F1), key(Key::Questionmark)])
    .state(|window| window.panels.key_list),
    Command::new(
        ("manual", "Manual", Icon::BookOpen),
        Menu::Help,
        "Shows the manual, page by page.",
        |window, _| window.panels.manual.open = !window.panels.manual.open,
    )
    .state(|window| window.panels.manual.open),
    Command::new(
        ("plugins", "Plugins", Icon::Plug),
        Menu::Help,
        "Lists the plugins that are installed, and what went wrong with them.",
        |window, _| window.panels.plugin_list = !window.panels.plugin_list,
    )
    .state(|window| window.panels.plugin_list)
    .group(),
    Command::new(
        ("messages", "Messages", Icon::MessageSquare),
        Menu::Help,
        "Lists everything that was said.",
        |window, _| window.messages.open = !window.messages.open,
    )
    .state(|window| window.messages.open),
    Command::new(
        ("about", "About Surfelshop", Icon::Info),
        Menu::Help,
        "Says which version this is, and what draws.",
        |window, _| window.panels.about = !window.panels.about,
    )
    .state(|window| window.panels.about),
];
