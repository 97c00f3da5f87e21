//! The row above a picture: renderers, how two are shown, and the buttons of the view.

use super::{PaneAction, Panes, TOOL_ROW};
use crate::document::{Mode, PaneSettings};
use crate::theme::{Icon, icon_text, tokens};
use eframe::egui::{self, Rect, Sense, Ui, vec2};
use egui_tiles::UiResponse;

/// Least width of a box of choices.
const LEAST_BOX: f32 = 56.0;

impl Panes<'_> {
    /// The tool row above the picture; returns whether the pane is dragged by its handle.
    pub(super) fn tools(&mut self, ui: &mut Ui, id: u32) -> UiResponse {
        let renderers = self.window.drawers();
        let several = self.window.settings.panes.len() > 1;
        let mut response = UiResponse::None;
        let Some(settings) = self.window.settings.pane_mut(id) else { return response };
        let action = &mut self.action;
        let row = Rect::from_min_size(ui.max_rect().min, vec2(ui.max_rect().width(), TOOL_ROW));
        ui.painter().rect_filled(row, 0.0, tokens(ui).panel);
        ui.spacing_mut().item_spacing.y = 0.0;
        ui.horizontal(|ui| {
            // Of one height in all views, so that their pictures are.
            ui.set_min_height(TOOL_ROW);
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.add_space(4.0);
            if several {
                let grip =
                    egui::Button::new(icon_text(Icon::Grip)).frame(false).sense(Sense::drag());
                if ui.add(grip).on_hover_text("Drag the view to another place.").drag_started() {
                    response = UiResponse::DragStarted;
                }
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.add_space(4.0);
                if several && tool(ui, Icon::X, "close", "Closes this view.", false) {
                    *action = Some(PaneAction::Close(id));
                }
                let about = "A second view beside this one.";
                if tool(ui, Icon::SquareSplitHorizontal, "split", about, false) {
                    *action = Some(PaneAction::Split(id));
                }
                let about = "Moves the camera together with the other linked views.";
                if several && tool(ui, Icon::Link, "linked", about, settings.linked) {
                    settings.linked = !settings.linked;
                }
                ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                    choices(ui, &renderers, settings);
                });
            });
        });
        response
    }
}

/// The choices of a tool row: renderers, and how two are shown.
fn choices(ui: &mut Ui, renderers: &[String], settings: &mut PaneSettings) {
    let n_boxes = settings.mode.sides() + 1;
    // What does not fit into a narrow view is chosen by commands.
    let n_fitting = ((ui.available_width() / (LEAST_BOX + 8.0)) as usize).min(n_boxes);
    let width = (ui.available_width() / n_fitting.max(1) as f32 - 8.0).clamp(LEAST_BOX, 150.0);
    if n_fitting > 0 {
        choose(ui, "first renderer", renderers, &mut settings.renderers[0], width);
    }
    if n_fitting < 2 {
        return;
    }
    let modes = egui::ComboBox::from_id_salt("mode").selected_text(settings.mode.words());
    let shown = modes.width(width.min(124.0)).truncate().show_ui(ui, |ui| {
        for mode in Mode::ALL {
            ui.selectable_value(&mut settings.mode, mode, mode.words());
        }
    });
    name(&shown.response, "how two renderers are shown");
    if n_fitting > 2 {
        choose(ui, "second renderer", renderers, &mut settings.renderers[1], width);
    }
}

/// A small icon of a tool row; returns whether it was clicked.
fn tool(ui: &mut Ui, icon: Icon, label: &str, about: &str, is_on: bool) -> bool {
    let response = ui.add(egui::Button::selectable(is_on, icon_text(icon)));
    response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Button, true, is_on, label));
    response.on_hover_text(about).clicked()
}

fn choose(ui: &mut Ui, what: &str, names: &[String], chosen: &mut String, width: f32) {
    let menu = egui::ComboBox::from_id_salt(what).selected_text(chosen.as_str());
    let shown = menu.width(width).truncate().show_ui(ui, |ui| {
        for name in names {
            let is_chosen = name == chosen;
            let entry = ui.selectable_value(chosen, name.clone(), name);
            // The list has just opened: the arrows lead on from what is chosen.
            if is_chosen && ui.memory(|memory| memory.focused().is_none()) {
                entry.request_focus();
            }
        }
    });
    name(&shown.response, what);
}

/// Names a box without a label for screen readers.
fn name(response: &egui::Response, what: &str) {
    response
        .widget_info(|| egui::WidgetInfo::labeled(egui::Role::ComboBox, response.enabled(), what));
}
