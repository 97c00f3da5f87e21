//! A remembered camera.

use super::{command_button, row};
use crate::window::Window;
use eframe::egui::Ui;

/// Shows it.
pub(super) fn show(window: &mut Window, ui: &mut Ui, index: usize) {
    let now = window.camera_of(window.views.focused);
    let Some(bookmark) = window.settings.bookmarks.get_mut(index) else { return };
    row(ui, "name", "", |ui| ui.text_edit_singleline(&mut bookmark.name));
    let is_there = bookmark.camera == now;
    ui.horizontal_wrapped(|ui| {
        command_button(window, ui, "zoom-selected", "look from there");
        command_button(window, ui, "remove-selected", "remove");
    });
    ui.weak(match is_there {
        true => "The focused view looks from there.",
        false => "The focused view looks from elsewhere.",
    });
}
