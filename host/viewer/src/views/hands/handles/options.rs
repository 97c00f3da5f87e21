//! The numbers of a box or a plane, and what it does with what was selected before.

use super::shape::{BoxShape, PlaneShape, Shape};
use crate::window::Window;
use eframe::egui::{Button, DragValue, Grid, Response, Role, Ui, WidgetInfo};
use glam::DVec3;
use surfelshop_cloud::selection::Combine;

/// What it does with what was selected before.
const HOW: [(Combine, &str, &str); 4] = [
    (Combine::Replace, "only", "Selects what is in it, and nothing else."),
    (Combine::Add, "add", "Selects what is in it, too."),
    (Combine::Subtract, "remove", "Deselects what is in it."),
    (Combine::Intersect, "both", "Selects what is in it and was selected before."),
];

/// Shows them.
pub(in crate::views::hands) fn show(window: &mut Window, ui: &mut Ui) {
    let Some(shape) = window.shape() else {
        ui.weak("No cloud that is in memory is shown.");
        return;
    };
    let changed = match shape {
        Shape::Box(shape) => {
            show_box(window, ui, shape).map(|(shape, at_rest)| (Shape::Box(shape), at_rest))
        }
        Shape::Plane(shape) => {
            show_plane(window, ui, shape).map(|(shape, at_rest)| (Shape::Plane(shape), at_rest))
        }
    };
    if let Some((changed, at_rest)) = changed {
        let is_another = window.set_shape(changed);
        if is_another || at_rest {
            window.select_by_shape(at_rest);
        }
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
        let about = "Copies the words by which `surfelshop select` selects the same; filters, and what was selected before, are not among them.";
        if ui.button("copy for the command line").on_hover_text(about).clicked() {
            let typed = shape.typed(before, window.document.up.axis());
            window.messages.report(format!("copied {typed}"));
            ui.ctx().copy_text(typed);
        }
    });
}

/// What was done with numbers.
#[derive(Default)]
struct Typed {
    /// Whether one was changed.
    is_changed: bool,
    /// Whether one is dragged: others will follow.
    is_dragged: bool,
    /// Whether a drag has ended.
    has_ended: bool,
}

impl Typed {
    fn take(&mut self, response: &Response) {
        self.is_changed |= response.changed();
        self.is_dragged |= response.dragged();
        self.has_ended |= response.drag_stopped();
    }

    /// A shape with these numbers, where there are others, and whether it stays.
    fn changed<T>(&self, shape: T) -> Option<(T, bool)> {
        (self.is_changed || self.has_ended).then_some((shape, !self.is_dragged))
    }
}

/// A row of three numbers, of a shape that is so large.
fn row(ui: &mut Ui, name: &str, numbers: &mut DVec3, size: f64, typed: &mut Typed) {
    let label = ui.label(name);
    // Five digits of the size are what shapes have.
    let decimals = (5.0 - size.log10().floor()).clamp(0.0, 15.0) as usize;
    for (axis, number) in ["x", "y", "z"].into_iter().zip(numbers.as_mut()) {
        let drag = DragValue::new(number).speed(2e-3 * size).max_decimals(decimals);
        let response = ui.add(drag).labelled_by(label.id);
        named(&response, &format!("{name} {axis}"));
        typed.take(&response);
    }
    ui.end_row();
}

fn named(response: &Response, name: &str) {
    response.widget_info(|| WidgetInfo::labeled(Role::SpinButton, true, name));
}

fn show_box(window: &Window, ui: &mut Ui, shape: BoxShape) -> Option<(BoxShape, bool)> {
    let BoxShape { low, high, mut degrees } = shape;
    let (mut middle, mut size) = (0.5 * (low + high), high - low);
    let longest = size.max_element();
    let mut typed = Typed::default();
    Grid::new("box of a hand").num_columns(4).show(ui, |ui| {
        row(ui, "middle", &mut middle, longest, &mut typed);
        row(ui, "size", &mut size, longest, &mut typed);
        let label = ui.label("turned");
        let drag = DragValue::new(&mut degrees).speed(0.5).suffix("°").max_decimals(2);
        typed.take(&ui.add(drag.range(-180.0..=180.0)).labelled_by(label.id));
        ui.end_row();
    });
    let fitted = ui.horizontal(|ui| {
        let all = ui.button("around all").on_hover_text("Puts the box around all surfels.");
        let about = "Puts the box around what is selected.";
        let is_any = window.n_selected().0 > 0;
        let button = ui.add_enabled(is_any, Button::new("around the selection"));
        match (all.clicked(), button.on_hover_text(about).clicked()) {
            (false, false) => None,
            (_, selected) => window.fitted_box(selected),
        }
    });
    let half = 0.5 * size.max(DVec3::ZERO);
    let changed = BoxShape { low: middle - half, high: middle + half, degrees };
    fitted.inner.map(|fitted| (fitted, true)).or_else(|| typed.changed(changed))
}

fn show_plane(window: &Window, ui: &mut Ui, shape: PlaneShape) -> Option<(PlaneShape, bool)> {
    let PlaneShape { mut point, mut normal, reach } = shape;
    let mut typed = Typed::default();
    Grid::new("plane of a hand").num_columns(4).show(ui, |ui| {
        row(ui, "place", &mut point, reach, &mut typed);
        row(ui, "normal", &mut normal, 1.0, &mut typed);
    });
    ui.horizontal(|ui| {
        if ui.button("flip").on_hover_text("Selects what lies on its other side.").clicked() {
            (normal, typed.is_changed) = (-normal, true);
        }
        if ui.button("level").on_hover_text("Turns its normal upwards.").clicked() {
            (normal, typed.is_changed) = (window.document.up.axis().direction(), true);
        }
    });
    ui.weak("A click on the cloud puts it there.");
    let normal = normal.try_normalize()?;
    typed.changed(PlaneShape { point, normal, reach })
}
