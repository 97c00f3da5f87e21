//! The small window while something is measured: what, and how far it is.

use super::state::icon;
use crate::theme::icon_text;
use crate::views::hands::HandMode;
use crate::window::Window;
use eframe::egui::{Button, Role, Ui, WidgetInfo};
use surfelshop_cloud::scene::MeasureKind;

/// Shows it.
pub(in crate::views) fn show(window: &mut Window, ui: &mut Ui, kind: MeasureKind) {
    ui.horizontal(|ui| {
        for other in MeasureKind::ALL {
            let button = Button::selectable(other == kind, icon_text(icon(other)));
            let response = ui.add(button);
            let name = format!("measure: {}", other.name());
            let is_on = other == kind;
            response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_on, &name));
            if response.on_hover_text(other.name()).clicked() && other != kind {
                window.views.measuring.places.clear();
                window.views.hands.mode = HandMode::Measure(other);
            }
        }
    });
    let n = window.views.measuring.places.len();
    let (least, most) = kind.n_places().into_inner();
    let of = if least == most { format!("{least}") } else { format!("{least} or more") };
    ui.label(format!("{}: {n} of {of} places", kind.name()));
    ui.weak(super::hint(kind));
}
