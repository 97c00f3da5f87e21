//! A row of a panel: a label, and its control in the column of all controls.

use crate::theme::space;
use eframe::egui::{self, Align, Layout, Response, Ui, vec2};

/// Shows a label and a control that it names; `about` is shown for both.
pub(super) fn row(
    ui: &mut Ui,
    label: &str,
    about: &str,
    control: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    row_of(ui, label, about, |ui, label| control(ui).labelled_by(label))
}

/// The same for several controls, which name themselves.
pub(super) fn row_of(
    ui: &mut Ui,
    label: &str,
    about: &str,
    controls: impl FnOnce(&mut Ui, egui::Id) -> Response,
) -> Response {
    ui.horizontal(|ui| {
        let size = vec2(space::LABEL, ui.spacing().interact_size.y);
        let name = ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(space::LABEL);
            ui.add(egui::Label::new(label).truncate())
        });
        let name = name.inner;
        let response = controls(ui, name.id);
        match about.is_empty() {
            true => response,
            false => {
                name.on_hover_text(about);
                response.on_hover_text(about)
            }
        }
    })
    .inner
}
