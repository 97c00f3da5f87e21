//! How the focused view compares two pictures: of two renderers, or of two clouds.

use super::{Scale, command_button, row_of, slider_row};
use crate::document::Mode;
use crate::window::Window;
use eframe::egui::{self, Role, Ui, WidgetInfo};

/// Shows the section.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let names: Vec<String> = window
        .document
        .clouds
        .iter()
        .flat_map(|shown| shown.open_clouds.all())
        .filter(|cloud| cloud.visible)
        .map(|cloud| cloud.name())
        .collect();
    let Some(pane) = window.settings.pane_mut(focused) else { return };
    row_of(ui, "shown as", "How one or two pictures are shown.", |ui, _label| {
        let combo = egui::ComboBox::from_id_salt("how").selected_text(pane.mode.words());
        let shown = combo.truncate().show_ui(ui, |ui| {
            for mode in Mode::ALL {
                ui.selectable_value(&mut pane.mode, mode, mode.words());
            }
        });
        shown
            .response
            .widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "how pictures are shown"));
        shown.response
    });
    if names.len() > 1 {
        let n_sides = pane.mode.sides();
        for (side, chosen) in pane.clouds.iter_mut().take(n_sides).enumerate() {
            let label = match (n_sides, side) {
                (1, _) => "clouds",
                (_, 0) => "clouds of the first",
                _ => "clouds of the second",
            };
            clouds(ui, label, &names, chosen);
        }
    }
    if pane.mode == Mode::Wipe {
        let mut percent = 100.0 * pane.wipe;
        let scale = Scale::linear(0.0..=100.0, " %");
        let about = "Where the line stands: share of the width that the first picture has.";
        if slider_row(ui, "line at", about, &mut percent, &scale).changed() {
            pane.wipe = (0.01 * percent).clamp(0.0, 1.0);
        }
    }
    if pane.mode == Mode::Difference
        && let Some(pane) = window.views.panes.get_mut(&focused)
    {
        let mut levels = 255.0 * pane.heat_full;
        let scale = Scale::logarithmic(1.0..=255.0, "");
        let about = "The difference that is shown brightest, in levels of 255.";
        if slider_row(ui, "brightest at, levels", about, &mut levels, &scale).changed() {
            pane.heat_full = (levels / 255.0).clamp(1.0 / 255.0, 1.0);
        }
    }
    ui.horizontal_wrapped(|ui| {
        command_button(window, ui, "measure", "measure quality");
        command_button(window, ui, "compare-clouds", "two clouds");
    });
}

/// Which cloud a side shows.
fn clouds(ui: &mut Ui, label: &str, names: &[String], chosen: &mut Option<String>) {
    let about = "All visible clouds, or one of them alone.";
    row_of(ui, label, about, |ui, _label| {
        let text = chosen.clone().unwrap_or_else(|| "all".to_owned());
        let combo = egui::ComboBox::from_id_salt(("clouds of a side", label)).truncate();
        let shown = combo.selected_text(text).show_ui(ui, |ui| {
            ui.selectable_value(chosen, None, "all");
            for name in names {
                ui.selectable_value(chosen, Some(name.clone()), name);
            }
        });
        shown.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, label));
        shown.response
    });
}
