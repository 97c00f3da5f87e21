//! The page of shortcuts: each command's, to be changed by pressing another one.

use crate::commands::{self, COMMANDS, Command, Keymap, check_shortcut, shortcut_text};
use crate::theme::{Icon, icon_text, space};
use crate::window::Window;
use eframe::egui::{
    self, Button, Event, Key, KeyboardShortcut, Label, Layout, Modifiers, Response, RichText, Role,
    TextEdit, Ui, WidgetInfo, vec2,
};

/// Shows the page.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    take_press(window, ui);
    let search = TextEdit::singleline(&mut window.panels.settings.search);
    let search = ui.add(search.hint_text("search").desired_width(ui.available_width()));
    search.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "search shortcuts"));
    if let Some(reason) = &window.panels.settings.refused {
        let text = RichText::new(reason).color(ui.visuals().error_fg_color);
        ui.add(Label::new(text).wrap());
    }
    ui.add_space(space::SMALL);
    let words = window.panels.settings.search.to_lowercase();
    for &command in COMMANDS.iter() {
        let keys = commands::shortcuts(window, command).join(", ");
        let text = format!("{} {keys}", command.name).to_lowercase();
        if words.split_whitespace().all(|word| text.contains(word)) {
            row(window, ui, command, &keys);
        }
    }
}

fn row(window: &mut Window, ui: &mut Ui, command: &'static Command, keys: &str) {
    let waits = window.panels.settings.waits == Some(command.id);
    let is_own = window.preferences.shortcuts.contains_key(command.id);
    ui.horizontal(|ui| {
        let width = (ui.available_width() - 210.0).max(80.0);
        ui.allocate_ui_with_layout(
            vec2(width, 22.0),
            Layout::left_to_right(egui::Align::Center),
            |ui| {
                ui.set_min_width(width);
                ui.add(Label::new(command.name).truncate()).on_hover_text(command.about);
            },
        );
        let text = match (waits, keys) {
            (true, _) => "press the keys …",
            (false, "") => "none",
            (false, keys) => keys,
        };
        let change = ui.add_sized(vec2(132.0, 22.0), Button::selectable(waits, text).truncate());
        let name = format!("shortcut of {}", command.name);
        change.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        if change.on_hover_text("Click, then press the new shortcut; Escape leaves it.").clicked() {
            window.panels.settings.waits = if waits { None } else { Some(command.id) };
            window.panels.settings.refused = None;
        }
        let none = small(ui, Icon::X, !keys.is_empty(), &format!("no {name}"));
        if none.on_hover_text("No shortcut.").clicked() {
            set(window, command.id, Some(Vec::new()));
        }
        let usual = small(ui, Icon::RotateCcw, is_own, &format!("usual {name}"));
        if usual.on_hover_text("The usual shortcut.").clicked() {
            set(window, command.id, None);
        }
    });
}

fn small(ui: &mut Ui, icon: Icon, is_enabled: bool, name: &str) -> Response {
    let button = Button::new(icon_text(icon).small()).frame_when_inactive(false);
    let response = ui.add_enabled(is_enabled, button);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, is_enabled, name));
    response
}

/// Gives a command shortcuts of the user's own, or the usual ones.
fn set(window: &mut Window, id: &str, own: Option<Vec<String>>) {
    match own {
        Some(own) => drop(window.preferences.shortcuts.insert(id.to_owned(), own)),
        None => drop(window.preferences.shortcuts.remove(id)),
    }
    // Assigned again in the next frame.
    window.keymap = Keymap::default();
    window.panels.settings.refused = None;
}

/// Whether a key only says what the next one means.
fn is_modifier(key: Key) -> bool {
    matches!(
        key,
        Key::ShiftLeft
            | Key::ShiftRight
            | Key::ControlLeft
            | Key::ControlRight
            | Key::AltLeft
            | Key::AltRight
            | Key::SuperLeft
            | Key::SuperRight
            | Key::CapsLock
            | Key::NumLock
    )
}

/// Takes the keys that are pressed for the command that waits for them.
fn take_press(window: &mut Window, ui: &Ui) {
    let Some(id) = window.panels.settings.waits else { return };
    ui.ctx().memory_mut(|memory| memory.stop_text_input());
    let pressed = ui.input_mut(|input| {
        let press = input.events.iter().find_map(|event| match event {
            Event::Key { key, pressed: true, modifiers, .. } if !is_modifier(*key) => {
                Some((*key, *modifiers))
            }
            _ => None,
        });
        input.events.retain(|event| !matches!(event, Event::Key { .. } | Event::Text(_)));
        press
    });
    let Some((key, modifiers)) = pressed else { return };
    window.panels.settings.waits = None;
    if key == Key::Escape {
        return;
    }
    let held = Modifiers { ctrl: false, mac_cmd: false, ..modifiers };
    let shortcut = KeyboardShortcut::new(held, key);
    match check_shortcut(window, id, shortcut) {
        Ok(()) => set(window, id, Some(vec![shortcut_text(shortcut)])),
        Err(reason) => window.panels.settings.refused = Some(reason),
    }
    // The list is that of the frame before.
    ui.ctx().request_repaint();
}
