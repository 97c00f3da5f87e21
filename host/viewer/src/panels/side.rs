//! The panels at the left.

use super::{breakdown, camera, clouds, colors, environment_map, passes, picture, renderer};
use crate::theme::space;
use crate::window::Window;
use eframe::egui::{self, ScrollArea, Sense, Ui, UiBuilder};

/// Shows all panels.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    // The panel is as wide as its user makes it, and not as a long line would.
    let room = ui.available_rect_before_wrap();
    let mut inside = ui.new_child(UiBuilder::new().max_rect(room));
    ui.allocate_rect(room, Sense::hover());
    ScrollArea::vertical().auto_shrink(false).show(&mut inside, |ui| {
        section(ui, "Clouds", |ui| clouds::show(window, ui));
        section(ui, "Colours", |ui| colors::show(window, ui));
        section(ui, "Renderer", |ui| renderer::show(window, ui));
        section(ui, "Camera", |ui| camera::show(window, ui));
        section(ui, "Light and picture", |ui| picture::show(window, ui));
        section(ui, "Environment", |ui| environment_map::show(window, ui));
        section(ui, "Surface", |ui| picture::show_surface(window, ui));
        section(ui, "Passes", |ui| passes::show(window, ui));
        let title = egui::RichText::new("What it is made of").strong().size(14.0);
        let breakdown = egui::CollapsingHeader::new(title);
        breakdown.default_open(false).show(ui, |ui| breakdown::show(window, ui));
    });
}

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    let title = egui::RichText::new(title).strong().size(14.0);
    egui::CollapsingHeader::new(title).default_open(true).show_unindented(ui, |ui| {
        contents(ui);
        ui.add_space(space::SMALL);
    });
    ui.separator();
}
