//! The panels beside the views: the outliner at the left, and at the right the properties of what is selected or the
//! measurement of quality. In a narrow window all of them share one panel at the left.

use super::{outliner, properties};
use crate::measure;
use crate::theme::{Icon, icon_text, space};
use crate::window::Window;
use eframe::egui::{
    self, Button, Panel, Response, Role, ScrollArea, Sense, Ui, UiBuilder, WidgetInfo,
};

/// Width of a window in which the panels stand at both sides.
const WIDE: f32 = 840.0;

/// Widths between which the panels are dragged.
const OUTLINERS: std::ops::RangeInclusive<f32> = 150.0..=420.0;
const PROPERTIES_OF: std::ops::RangeInclusive<f32> = 290.0..=640.0;

/// Width of a scroll bar.
const BAR: f32 = 10.0;

/// Shows the panels that the user wants.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let shows_right = window.preferences.properties || window.measure.form.open;
    if ui.max_rect().width() < WIDE {
        let both = (window.preferences.panels, shows_right);
        if both != (false, false) {
            narrow(window, ui, both);
        }
        return;
    }
    if window.preferences.panels {
        let width = window.preferences.outliner_width;
        let panel = Panel::left("outliner").default_size(width).size_range(OUTLINERS);
        let shown = panel.show(ui, |ui| scrolled(ui, "outliner", |ui| outliner::show(window, ui)));
        remember(ui, &shown.response, &mut window.preferences.outliner_width);
    }
    if shows_right {
        let width = window.preferences.properties_width;
        let panel = Panel::right("properties").default_size(width).size_range(PROPERTIES_OF);
        let shown = panel.show(ui, |ui| right(window, ui));
        remember(ui, &shown.response, &mut window.preferences.properties_width);
    }
}

/// The width that the user has dragged a panel to.
fn remember(ui: &Ui, shown: &Response, width: &mut f32) {
    let now = shown.rect.width().round();
    let is_dragged = ui.input(|input| input.pointer.any_down());
    if !is_dragged && (now - *width).abs() > 1.0 {
        *width = now;
    }
}

/// The properties, or the measurement of quality in their place.
fn right(window: &mut Window, ui: &mut Ui) {
    tabs(window, ui);
    match window.measure.form.open {
        true => inset(ui, |ui| measure::panel::show(window, ui)),
        // Each kind of thing is scrolled by itself: the next begins at its top.
        false => {
            let kind = std::mem::discriminant(&window.selection());
            scrolled(ui, ("properties", kind), |ui| properties::show(window, ui));
        }
    }
}

/// What the panel at the right shows.
fn tabs(window: &mut Window, ui: &mut Ui) {
    ui.add_space(space::SMALL);
    ui.horizontal(|ui| {
        let measures = window.measure.form.open;
        if ui.selectable_label(!measures, "Properties").clicked() {
            window.measure.form.open = false;
            window.preferences.properties = true;
        }
        if ui.selectable_label(measures, "Compare quality").clicked() {
            window.measure.form.open = true;
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let button = Button::new(icon_text(Icon::X)).frame_when_inactive(false);
            let close = ui.add(button);
            close.widget_info(|| WidgetInfo::labeled(Role::Button, true, "close the panel"));
            if close.on_hover_text("Close the panel.").clicked() {
                match measures {
                    true => window.measure.form.open = false,
                    false => window.preferences.properties = false,
                }
            }
        });
    });
    ui.separator();
}

/// Both in one panel.
fn narrow(window: &mut Window, ui: &mut Ui, (outliner, right): (bool, bool)) {
    let width = 300f32.min(0.55 * ui.max_rect().width());
    Panel::left("both").exact_size(width).resizable(false).show(ui, |ui| {
        if window.measure.form.open {
            tabs(window, ui);
            inset(ui, |ui| measure::panel::show(window, ui));
            return;
        }
        scrolled(ui, "both", |ui| {
            if outliner {
                outliner::show(window, ui);
            }
            if right {
                ui.spacing_mut().item_spacing.y = 5.0;
                ui.separator();
                properties::show(window, ui);
            }
        });
    });
}

/// The panel is as wide as its user makes it, and not as a long line would.
fn inset(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    let room = ui.available_rect_before_wrap();
    let mut inside = ui.new_child(UiBuilder::new().max_rect(room));
    ui.allocate_rect(room, Sense::hover());
    contents(&mut inside);
}

fn scrolled(ui: &mut Ui, id: impl egui::AsIdSalt, contents: impl FnOnce(&mut Ui)) {
    inset(ui, |ui| {
        ScrollArea::vertical().id_salt(id).auto_shrink(false).show(ui, |ui| {
            // The scroll bar lies over the right edge.
            ui.set_max_width(ui.available_width() - BAR);
            contents(ui);
        });
    });
}
