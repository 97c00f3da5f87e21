//! The numbers of a box or a plane, and what it does with what was selected before.

use super::shape::{BoxShape, PlaneShape, Shape};
use crate::window::Window;
use eframe::egui::{DragValue, Grid, Response, Role, Ui, WidgetInfo};
use glam::DVec3;
use surfelshop_cloud::selection::Combine;

/// What it does with what was selected before.
const HOW: [(Combine, &str, &str); 4] = [
    (Combine::Replace, "only", "Selects what is in it, and nothing else."),
    (Combine::Add, "add", "Selects what is in it, too."),
    (Combine::Subtract, "remove", "Selects no more what is in it."),
    (Combine::Intersect, "both", "Selects what is in it and was selected before."),
];

/// Shows them.
pub(in crate::views::hands) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(shape) = window.shape() else {
        ui.weak("No cloud that is in memory is shown.");
        return;
    };
    let changed = match shape {
        Shape::Box(shape) => show_box(window, ui, shape).map(Shape::Box),
        Shape::Plane(shape) => show_plane(window, ui, shape).map(Shape::Plane),
    };
    if let Some(changed) = changed {
        window.set_shape(changed);
        window.select_by_shape(true);
    }
    let before = window.views.hands.handles.how;
    ui.horizontal(|ui| {
        for (how, word, about) in HOW {
            if ui.selectable_label(before == how, word).on_hover_text(about).clicked() {
                window.combine_handles(how);
            }
        }
        let about =
            "What is selected now stays, and the next box or plane adds to it or takes from it.";
        if ui.button("keep").on_hover_text(about).clicked() {
            window.keep_selection_of_handles();
            window.views.hands.handles.how = Combine::Add;
        }
    });
    ui.horizontal(|ui| {
        if ui.button("select").on_hover_text("Selects by it as it is.").clicked() {
            window.select_by_shape(true);
        }
        let about = "Copies what `surfelshop select` takes to select the same.";
        if ui.button("copy for the command line").on_hover_text(about).clicked() {
            let typed = shape.typed();
            window.messages.report(format!("copied {typed}"));
            ui.ctx().copy_text(typed);
        }
    });
}

/// A row of three numbers; whether one was changed.
fn row(ui: &mut Ui, name: &str, numbers: &mut DVec3, speed: f64) -> bool {
    let label = ui.label(name);
    let mut is_changed = false;
    for (axis, number) in ["x", "y", "z"].into_iter().zip(numbers.as_mut()) {
        let drag = DragValue::new(number).speed(speed).max_decimals(6);
        let response = ui.add(drag).labelled_by(label.id);
        named(&response, &format!("{name} {axis}"));
        is_changed |= response.changed();
    }
    ui.end_row();
    is_changed
}

fn named(response: &Response, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, name));
}

fn show_box(window: &mut Window, ui: &mut Ui, shape: BoxShape) -> Option<BoxShape> {
    let BoxShape { low, high, mut degrees } = shape;
    let (mut middle, mut size) = (0.5 * (low + high), high - low);
    let speed = 2e-3 * size.max_element();
    let mut is_changed = false;
    Grid::new("box of a hand").num_columns(4).show(ui, |ui| {
        is_changed |= row(ui, "middle", &mut middle, speed);
        is_changed |= row(ui, "size", &mut size, speed);
        let label = ui.label("turned");
        let drag = DragValue::new(&mut degrees).speed(0.5).suffix("°").max_decimals(2);
        let response = ui.add(drag.range(-180.0..=180.0)).labelled_by(label.id);
        is_changed |= response.changed();
        ui.end_row();
    });
    ui.horizontal(|ui| {
        if ui.button("around all").clicked() {
            window.fit_box(false);
        }
        let about = "Puts the box around what is selected.";
        let is_any = window.n_selected().0 > 0;
        ui.add_enabled_ui(is_any, |ui| {
            if ui.button("around the selection").on_hover_text(about).clicked() {
                window.fit_box(true);
            }
        });
    });
    let half = 0.5 * size.max(DVec3::splat(1e-6 * size.max_element().max(0.0)));
    let changed = BoxShape { low: middle - half, high: middle + half, degrees };
    is_changed.then_some(changed)
}

fn show_plane(window: &Window, ui: &mut Ui, shape: PlaneShape) -> Option<PlaneShape> {
    let PlaneShape { mut point, mut normal, reach } = shape;
    let mut is_changed = false;
    Grid::new("plane of a hand").num_columns(4).show(ui, |ui| {
        is_changed |= row(ui, "place", &mut point, 2e-3 * reach);
        is_changed |= row(ui, "normal", &mut normal, 0.01);
    });
    ui.horizontal(|ui| {
        if ui.button("flip").on_hover_text("Selects what lies on its other side.").clicked() {
            (normal, is_changed) = (-normal, true);
        }
        if ui.button("level").on_hover_text("Turns its normal upwards.").clicked() {
            (normal, is_changed) = (window.document.up.axis().direction(), true);
        }
    });
    ui.weak("A click on the cloud puts it there.");
    let normal = normal.try_normalize()?;
    is_changed.then_some(PlaneShape { point, normal, reach })
}
