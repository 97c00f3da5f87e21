//! The status line: what is under the pointer, and the adapter.

use crate::views::hands;
use crate::window::Window;
use eframe::egui::{self, Label, Ui};

/// Shows the line.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.set_min_height(22.0);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let whole = match (window.render.no_device, window.render.adapter.as_str()) {
                (true, _) => "no graphics device",
                (false, "") => "opening the graphics device",
                (false, whole) => whole,
            };
            // The name of a driver is long, and in brackets.
            let name = whole.split(" (").next().unwrap_or(whole);
            ui.weak(name).on_hover_text(whole);
            let selected = hands::status(window);
            for text in selected.into_iter().chain(tracing(window)).chain(work(window)) {
                ui.label(text);
            }
            // It spins until the picture is final, also while it is refined.
            if window.works() {
                ui.spinner();
            }
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                let text = window.views.pointer_text.as_str();
                let hint = hands::hint(&window.views.hands.mode)
                    .unwrap_or_else(|| window.camera_mode().hint());
                let shows = window.document.clouds.is_some() && !window.shows_start_page();
                let text = if shows { text } else { "" };
                match text.is_empty() && shows {
                    true => ui.add(Label::new(egui::RichText::new(hint).weak()).truncate()),
                    false => ui.add(Label::new(text).truncate()),
                };
            });
        });
    });
}

/// What runs beside the pictures, and how far it is.
fn work(window: &Window) -> Vec<String> {
    let percent = |fraction: f32| format!("{:.0} %", 100.0 * fraction);
    let reading = window.document.loader.as_ref().map(|loader| loader.fraction());
    let reading = reading.map(|fraction| format!("reading {}", percent(fraction)));
    let uploading = window.render.upload_progress.map(|f| format!("uploading {}", percent(f)));
    let tool = window.plugins.tools.running().map(|(name, ..)| format!("{name} is at work"));
    let writing = window.document.cloud_writer.as_ref().map(|_| "writing a cloud".to_owned());
    [reading, uploading, tool, writing].into_iter().flatten().collect()
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
