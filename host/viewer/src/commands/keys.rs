//! What is pressed runs commands.

use super::assign::assign;
use super::command;
use super::table::find;
use crate::document::recovery::Recovery;
use crate::window::Window;
use eframe::egui::{Context, Key, Modifiers, Popup};

/// Handles the keys of this frame.
pub(crate) fn handle(window: &mut Window, ctx: &Context) {
    if window.keymap.is_empty() {
        let (keymap, refused) = assign(&window.preferences.shortcuts);
        window.keymap = keymap;
        refused.into_iter().for_each(|line| window.messages.warn(line));
    }
    let asks = window.document.unsaved_prompt.is_some()
        || window.document.recovery.as_ref().is_some_and(Recovery::asks)
        // A new shortcut is pressed, or a name typed.
        || window.panels.settings.waits.is_some()
        || window.panels.renaming.is_some();
    if asks || window.panels.dialogs.own_is_open() || window.panels.palette.is_open() {
        return;
    }
    let types = ctx.egui_wants_keyboard_input();
    // A number that is meant for a field of the form is no view.
    let fills_form = types || window.panels.export_form.open;
    for (shortcut, id) in window.keymap.by_modifiers() {
        // What has a letter alone is typed.
        if fills_form && !(shortcut.modifiers.command || is_function(shortcut.logical_key)) {
            continue;
        }
        // Copying and the like in a text field.
        if types && is_of_text(shortcut.logical_key) {
            continue;
        }
        // A key may be hit several times within a frame.
        let times = ctx.input_mut(|input| {
            input.count_and_consume_key(shortcut.modifiers, shortcut.logical_key)
        });
        let Some(found) = find(id).filter(|_| times > 0) else { continue };
        for _ in 0..times {
            command::run(window, ctx, found);
        }
    }
    // Menus close themselves.
    if !types
        && !Popup::is_any_open(ctx)
        && ctx.input(|input| input.key_pressed(Key::Escape))
        && window.close_topmost()
    {
        ctx.input_mut(|input| input.consume_key(Modifiers::NONE, Key::Escape));
    }
}

fn is_function(key: Key) -> bool {
    matches!(key, Key::F1 | Key::F2 | Key::F10 | Key::F11)
}

/// Keys that text fields use with Ctrl.
fn is_of_text(key: Key) -> bool {
    matches!(key, Key::A | Key::C | Key::V | Key::X | Key::Z | Key::W | Key::B)
}
