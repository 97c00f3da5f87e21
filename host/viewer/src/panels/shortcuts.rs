//! The keyboard shortcuts.

use super::actions::{next_renderer, toggle_measure, toggle_projection};
use crate::dialogs::{DialogPurpose, files};
use crate::document::recovery::Recovery;
use crate::document::{Mode, undo};
use crate::views::layout;
use crate::window::Window;
use eframe::egui::{self, Context, Key, KeyboardShortcut, Modifiers};

pub(super) const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
pub(super) const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
pub(super) const SAVE_AS: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S);
pub(super) const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);
pub(super) const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
pub(super) const REDO: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
pub(super) const PICTURE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::P);
pub(super) const FRAME: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::F);
pub(super) const INSIDE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::I);
pub(super) const PROJECTION: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::O);
pub(super) const FLICKER: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::Space);
pub(super) const NEXT_RENDERER: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::R);
pub(super) const MEASURE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::M);
pub(super) const SPLIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::N);

/// Handles the keys of this frame.
pub(crate) fn handle(window: &mut Window, ctx: &Context) {
    let asks = window.document.unsaved_prompt.is_some()
        || window.document.recovery.as_ref().is_some_and(Recovery::asks);
    if ctx.egui_wants_keyboard_input() || asks || window.panels.dialogs.own_is_open() {
        return;
    }
    let pressed =
        |shortcut: &KeyboardShortcut| ctx.input_mut(|input| input.consume_shortcut(shortcut));
    // The longer shortcut first: its modifiers include the other's.
    if pressed(&REDO) {
        undo::redo(window);
    }
    if pressed(&UNDO) {
        undo::undo(window);
    }
    if pressed(&OPEN) {
        files::open(window, ctx, DialogPurpose::Open);
    }
    if pressed(&SAVE_AS) {
        files::open(window, ctx, DialogPurpose::SaveScene);
    }
    if pressed(&SAVE) {
        files::save_scene(window, ctx);
    }
    if pressed(&PICTURE) {
        window.panels.export_form.open = true;
    }
    if pressed(&QUIT) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }
    if pressed(&FRAME) {
        window.frame_all();
    }
    if pressed(&INSIDE) {
        window.stand_inside();
    }
    if pressed(&PROJECTION) {
        toggle_projection(window);
    }
    if pressed(&MEASURE) {
        toggle_measure(window);
    }
    // A key may be hit several times within a frame.
    let times = |shortcut: &KeyboardShortcut| {
        ctx.input_mut(|input| input.count_and_consume_key(shortcut.modifiers, shortcut.logical_key))
    };
    for _ in 0..times(&NEXT_RENDERER) {
        next_renderer(window);
    }
    for _ in 0..times(&SPLIT) {
        layout::split_focused(window);
    }
    if pressed(&FLICKER)
        && let Some(pane) = window.views.panes.get_mut(&window.views.focused)
    {
        pane.flicker = !pane.flicker;
    }
    let keys = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5];
    for (key, mode) in keys.into_iter().zip(Mode::ALL) {
        if pressed(&KeyboardShortcut::new(Modifiers::NONE, key))
            && let Some(pane) = window.settings.pane_mut(window.views.focused)
        {
            pane.mode = mode;
        }
    }
}
