//! The status line: what is under the pointer, and the adapter.

use crate::window::Window;
use eframe::egui::{self, Ui};

/// Shows the line.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(&window.views.pointer_text);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.weak(&window.render.adapter);
            for text in tracing(window) {
                ui.label(text);
            }
            // It spins until the picture is final, also while it is refined.
            if window.works() {
                ui.spinner();
            }
        });
    });
}

/// How far the traced pictures of the focused view are.
fn tracing(window: &Window) -> Vec<String> {
    let focused = window.views.focused;
    let n_sides = window.settings.pane(focused).map_or(1, |pane| pane.mode.sides());
    let sides = window.views.panes.get(&focused).into_iter().flat_map(|pane| &pane.sides);
    sides
        .take(n_sides)
        .filter_map(|side| side.shown.as_ref())
        .filter_map(|shown| {
            let traced = shown.rendered.traced.as_ref()?;
            shown.rendered.refines.then(|| format!("{}: {}", shown.renderer, traced.describe()))
        })
        .collect()
}
