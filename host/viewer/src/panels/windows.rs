//! The windows and questions over the views.

use super::manual;
use crate::dialogs::{recovery, unsaved};
use crate::document::recovery::Recovery;
use crate::export;
use crate::plugins::{crash, plugin_list, tool_window, trust};
use crate::window::Window;
use eframe::egui::{self, Context};

/// The mouse and the keys, for their list.
const KEYS: [(&str, &str); 16] = [
    ("drag", "orbit"),
    ("right or middle drag, Shift drag", "pan"),
    ("Ctrl drag", "look around"),
    ("wheel", "zoom to the pointer"),
    ("double click", "orbit about the surface under the pointer"),
    ("drag a light; Shift or Alt drag", "move the light across; nearer or farther"),
    ("W A S D, E Q", "fly: forward, left, back, right, up, down"),
    ("F", "see everything"),
    ("O", "perspective or parallel projection"),
    ("R", "next renderer"),
    ("1 … 5", "single, side by side, wipe, flicker, difference"),
    ("Space", "the other picture of a flicker"),
    ("N", "split the view"),
    ("M", "measure what is shown, and error against time"),
    ("Ctrl O, Ctrl S, Ctrl P, Ctrl Q", "open, save the scene, save pictures, quit"),
    ("Ctrl Z, Ctrl Shift Z", "undo, redo"),
];

/// Shows the windows that are open, and one question at a time.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    export::window::show(window, ctx);
    tool_window::show(window, ctx);
    crash::show(window, ctx);
    unsaved::show(window, ctx);
    let has_crash = window.plugins.crash.is_some();
    match !has_crash && window.document.recovery.as_ref().is_some_and(Recovery::asks) {
        true => recovery::show(window, ctx),
        false => trust::show(window, ctx),
    }
    window.messages.show_all(ctx);
    let mut open = window.panels.plugin_list;
    let plugins = egui::Window::new("Plugins").open(&mut open).default_width(1100.0);
    plugins.show(ctx, |ui| plugin_list::show(window, ui));
    window.panels.plugin_list = open;
    manual::show(&mut window.panels.manual, ctx);
    let keys = egui::Window::new("Mouse and keys").open(&mut window.panels.key_list);
    keys.show(ctx, |ui| {
        egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
            for (keys, what) in KEYS {
                ui.strong(keys);
                ui.label(what);
                ui.end_row();
            }
        });
    });
}
