//! The status line: what is under the pointer, and the adapter.

use crate::window::Window;
use eframe::egui::{self, Ui};

/// Shows the line.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(&window.views.pointer_text);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.weak(&window.render.adapter);
            // It spins until the picture is final, also while it is refined.
            if window.works() {
                ui.spinner();
            }
        });
    });
}
