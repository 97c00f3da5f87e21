//! A row of a panel: a label, its control, and a button that brings the usual value back, each in its column.

use crate::theme::{Icon, icon_text, space};
use eframe::egui::{
    self, Align, Button, DragValue, Label, Layout, Response, Role, Slider, SliderClamping, Ui,
    WidgetInfo, emath::Numeric, vec2,
};
use std::ops::RangeInclusive;
use surfelshop_cloud::scene::Axis;

/// Width of the column of buttons that bring a usual value back.
const RESET: f32 = 26.0;

/// Width of the number beside a slider.
const NUMBER: f32 = 66.0;

/// Narrowest column of controls.
const LEAST_CONTROL: f32 = 110.0;

/// A label, what it means, and whether its value is the usual one.
pub(crate) struct Row<'a> {
    label: &'a str,
    about: &'a str,
    is_usual: Option<bool>,
}

/// What happened to a row.
pub(crate) struct RowResponse {
    pub(crate) response: Response,
    /// Whether the usual value is wanted.
    pub(crate) reset: bool,
}

impl<'a> Row<'a> {
    pub(crate) fn new(label: &'a str, about: &'a str) -> Self {
        Self { label, about, is_usual: None }
    }

    /// With a button that brings the usual value back.
    pub(crate) fn reset(self, is_usual: bool) -> Self {
        Self { is_usual: Some(is_usual), ..self }
    }

    /// Shows it; the controls get the label's id, which names them.
    pub(crate) fn show(
        self,
        ui: &mut Ui,
        controls: impl FnOnce(&mut Ui, egui::Id) -> Response,
    ) -> RowResponse {
        let height = ui.spacing().interact_size.y;
        let gaps = 2.0 * ui.spacing().item_spacing.x;
        let control = (ui.available_width() - space::LABEL - RESET - gaps).max(LEAST_CONTROL);
        ui.horizontal(|ui| {
            let size = vec2(space::LABEL, height);
            let place = Layout::left_to_right(Align::Center).with_main_wrap(true);
            let name = ui.allocate_ui_with_layout(size, place, |ui| {
                ui.set_width(space::LABEL);
                ui.add(Label::new(self.label).wrap())
            });
            let name = name.inner;
            let size = vec2(control, height);
            let shown =
                ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                    ui.set_min_width(control);
                    ui.set_max_width(control);
                    let spacing = ui.spacing_mut();
                    spacing.slider_width = (control - NUMBER - spacing.item_spacing.x).max(24.0);
                    spacing.combo_width = control;
                    spacing.text_edit_width = control;
                    controls(ui, name.id)
                });
            let reset = self.is_usual.is_some_and(|is_usual| reset(ui, self.label, is_usual));
            if self.about.is_empty() {
                return RowResponse { response: shown.inner, reset };
            }
            name.on_hover_text(self.about);
            let response = shown.inner.on_hover_text(self.about);
            RowResponse { response, reset }
        })
        .inner
    }
}

fn reset(ui: &mut Ui, label: &str, is_usual: bool) -> bool {
    let icon = icon_text(Icon::RotateCcw).small();
    let button = Button::new(icon).frame_when_inactive(false);
    let size = vec2(RESET, ui.spacing().interact_size.y);
    let response = ui.add_enabled_ui(!is_usual, |ui| ui.add_sized(size, button)).inner;
    response.widget_info(|| WidgetInfo::labeled(Role::Button, !is_usual, format!("reset {label}")));
    response.on_hover_text("back to the usual value").clicked()
}

/// Shows a label and a control that it names; `about` is shown for both.
pub(crate) fn row(
    ui: &mut Ui,
    label: &str,
    about: &str,
    control: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    row_of(ui, label, about, |ui, label| control(ui).labelled_by(label))
}

/// The same for several controls, which name themselves.
pub(crate) fn row_of(
    ui: &mut Ui,
    label: &str,
    about: &str,
    controls: impl FnOnce(&mut Ui, egui::Id) -> Response,
) -> Response {
    Row::new(label, about).show(ui, controls).response
}

/// The numbers of a slider.
pub(crate) struct Scale {
    /// What the slider spans.
    pub(crate) range: RangeInclusive<f64>,
    /// What can be typed.
    pub(crate) typed: RangeInclusive<f64>,
    pub(crate) logarithmic: bool,
    pub(crate) unit: &'static str,
}

impl Scale {
    pub(crate) fn linear(range: RangeInclusive<f64>, unit: &'static str) -> Self {
        Self { typed: range.clone(), range, logarithmic: false, unit }
    }

    pub(crate) fn logarithmic(range: RangeInclusive<f64>, unit: &'static str) -> Self {
        Self { typed: range.clone(), range, logarithmic: true, unit }
    }

    /// The same, where numbers beyond the slider's ends can be typed.
    pub(crate) fn typed(self, typed: RangeInclusive<f64>) -> Self {
        Self { typed, ..self }
    }
}

/// A slider with its number beside it; both fill the column of controls. A number outside of the range stays until it is
/// changed.
pub(crate) fn slider<N: Numeric>(
    ui: &mut Ui,
    label: egui::Id,
    value: &mut N,
    (scale, suffix): (&Scale, &str),
) -> Response {
    let (low, high) = (N::from_f64(*scale.range.start()), N::from_f64(*scale.range.end()));
    let slider = Slider::new(value, low..=high).logarithmic(scale.logarithmic);
    let slider = slider.clamping(SliderClamping::Edits).show_value(false);
    let slider = ui.add(slider).labelled_by(label);
    let span = scale.range.end() - scale.range.start();
    let speed = match scale.logarithmic {
        true => 0.01 * value.to_f64().abs().max(1e-6 * span),
        false if N::INTEGRAL => 0.1,
        false => span / 300.0,
    };
    let (low, high) = (N::from_f64(*scale.typed.start()), N::from_f64(*scale.typed.end()));
    let number = DragValue::new(value).range(low..=high).clamp_existing_to_range(false);
    let number = number.speed(speed).suffix(suffix);
    let room = vec2(ui.available_width().max(40.0), ui.spacing().interact_size.y);
    let number = ui.add_sized(room, number).labelled_by(label);
    slider | number
}

/// A row with a slider.
pub(crate) fn slider_row<N: Numeric>(
    ui: &mut Ui,
    label: &str,
    about: &str,
    value: &mut N,
    scale: &Scale,
) -> Response {
    row_of(ui, label, about, |ui, label| slider(ui, label, value, (scale, scale.unit)))
}

/// The six axes, of which one is chosen.
pub(crate) fn axes(ui: &mut Ui, chosen: &mut Axis) -> Response {
    let all = [Axis::PlusY, Axis::PlusZ, Axis::PlusX, Axis::MinusY, Axis::MinusZ, Axis::MinusX];
    let shown = all.map(|axis| ui.selectable_value(chosen, axis, axis.name()));
    let [first, others @ ..] = shown;
    others.into_iter().fold(first, |all, one| all | one)
}

/// A row with a box to tick.
pub(crate) fn check_row(ui: &mut Ui, label: &str, about: &str, value: &mut bool) -> Response {
    row(ui, label, about, |ui| ui.checkbox(value, ""))
}
