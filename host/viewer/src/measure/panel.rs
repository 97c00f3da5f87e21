//! The panel beside the pictures: results, progress, and the buttons that begin a measurement.

use super::fields::{knob, reference, size};
use super::form::Form;
use super::measurement::{Measurement, Status};
use super::plan::{Kind, with};
use super::run::{begin, cancel};
use super::{planning, plot, table};
use crate::theme::{Icon, iconed};
use crate::window::Window;
use eframe::egui::{self, ScrollArea, Ui};

/// Shows the panel.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    Form::update_values(window);
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        // The scroll bar lies over the right edge.
        ui.set_max_width(ui.available_width() - BAR);
        ui.add_enabled_ui(!window.measure.is_busy(), |ui| {
            reference(window, ui);
            size(window, ui);
        });
        ui.separator();
        section(ui, "This view", |ui| current_view(window, ui));
        section(ui, "Error against time", |ui| series(window, ui));
    });
}

/// Width of a scroll bar in points.
const BAR: f32 = 12.0;

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(true).show_unindented(ui, contents);
}

fn current_view(window: &mut Window, ui: &mut Ui) {
    run(window, ui, Kind::CurrentView);
    if let Some(measurement) = window.measure.of(Kind::CurrentView) {
        summary(window, ui, measurement, Kind::CurrentView);
        table::pictures(ui, measurement);
        copy(ui, measurement);
    }
}

fn series(window: &mut Window, ui: &mut Ui) {
    ui.add_enabled_ui(!window.measure.is_busy(), |ui| knob(window, ui));
    run(window, ui, Kind::Series);
    let Some(measurement) = window.measure.of(Kind::Series) else { return };
    summary(window, ui, measurement, Kind::Series);
    let now = present_value(window, measurement);
    let drawn = plot::show(ui, measurement, now.as_deref());
    let listed = table::values(ui, measurement, now.as_deref());
    copy(ui, measurement);
    if let Some(value) = drawn.or(listed) {
        set_knob(window, &value);
    }
}

/// The button that copies all numbers.
fn copy(ui: &mut Ui, measurement: &Measurement) {
    if measurement.cells.iter().all(Option::is_none) {
        return;
    }
    let button = egui::Button::new(iconed(ui, Icon::ClipboardCopy, "copy numbers"));
    let about = "All numbers with all their digits, as a table for a spreadsheet.";
    let response = ui.add(button);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, "copy numbers"));
    if response.on_hover_text(about).clicked() {
        ui.ctx().copy_text(table::as_text(measurement));
    }
}

/// Copies the numbers of what was measured last.
pub(crate) fn copy_numbers(window: &mut Window, ctx: &egui::Context) {
    let measure = &window.measure;
    let all = [&measure.current_view, &measure.series];
    let text: Vec<String> = all.into_iter().flatten().map(table::as_text).collect();
    ctx.copy_text(text.join("\n"));
    window.messages.report("the numbers are copied");
}

/// The button that begins a measurement, or its progress with the button that cancels it.
fn run(window: &mut Window, ui: &mut Ui, kind: Kind) {
    let what = match kind {
        Kind::CurrentView => "measure",
        Kind::Series => "sweep",
    };
    let running = window.measure.of(kind).filter(|measurement| measurement.is_running());
    if let Some((fraction, text)) = running.map(Measurement::progress) {
        ui.horizontal(|ui| {
            let width = (ui.available_width() - 70.0).max(80.0);
            ui.add(egui::ProgressBar::new(fraction).desired_width(width).text(text));
            if ui.button("cancel").clicked() {
                cancel(window);
            }
        });
        return;
    }
    let reason = planning::basis(window, kind).err();
    let is_free = reason.is_none() && !window.measure.is_busy() && window.plugins.crash.is_none();
    ui.horizontal_wrapped(|ui| {
        let button = ui.add_enabled(is_free, egui::Button::new(what));
        let description = match kind {
            Kind::CurrentView => "what the view shows",
            Kind::Series => "error against time, value by value",
        };
        match &reason {
            None => ui.add(egui::Label::new(egui::RichText::new(description).weak()).wrap()),
            Some(reason) => ui.add(egui::Label::new(egui::RichText::new(reason).weak()).wrap()),
        };
        if button.clicked()
            && let Err(reason) = begin(window, kind)
        {
            window.messages.warn(reason);
        }
    });
}

/// What was measured, and whether the result is stale.
fn summary(window: &Window, ui: &mut Ui, measurement: &Measurement, kind: Kind) {
    let basis = &measurement.basis;
    let size = basis.size.map_or(String::new(), |[w, h]| format!(", {w} x {h} pixels"));
    let of: Vec<&str> = basis.renderers.iter().map(|(name, _)| name.as_str()).collect();
    let what = match &basis.knob {
        Some(knob) => format!("{} by {knob}", of.join(", ")),
        None => of.join(", "),
    };
    ui.add(egui::Label::new(format!("{what} against {}{size}", basis.source.name())).wrap());
    let warns = ui.visuals().warn_fg_color;
    match &measurement.status {
        Status::Failed(line) => {
            let text = egui::RichText::new(line).color(ui.visuals().error_fg_color);
            ui.add(egui::Label::new(text).wrap());
        }
        Status::Cancelled => drop(ui.colored_label(warns, "cancelled: what is here is not all")),
        Status::Running | Status::Done => {}
    }
    if let Some(changed) = measurement.stale(window, kind) {
        ui.colored_label(warns, format!("stale: {changed}"))
            .on_hover_text("measured now, the numbers would be others");
    }
}

impl Measurement {
    /// What has changed since it began, so that its numbers are stale.
    pub(crate) fn stale(&self, window: &Window, kind: Kind) -> Option<&'static str> {
        match planning::basis(window, kind) {
            Ok(now) => self.basis.changed(&now),
            Err(_) => Some("there is no such view, knob or reference any more"),
        }
    }
}

/// The present value of the knob in the view.
fn present_value(window: &Window, measurement: &Measurement) -> Option<String> {
    let (renderer, _) = measurement.basis.renderers.first()?;
    let id = measurement.basis.knob.as_ref()?;
    let pane = window.settings.pane(measurement.basis.pane)?;
    let declared =
        window.plugins.declared.get(renderer)?.iter().find(|declared| declared.id == *id)?;
    let value = declared.sanitise(pane.values.get(renderer).and_then(|values| values.get(id)));
    // In the typed form, since 0.1 may be typed as .10.
    let is_value = |typed: &&String| declared.parse(typed).is_ok_and(|typed| typed == value);
    measurement.subjects.iter().map(|subject| &subject.value).find(is_value).cloned()
}

/// Sets the knob in the measured view, as any other change of a parameter.
fn set_knob(window: &mut Window, value: &str) {
    let Some(measurement) = &window.measure.series else { return };
    let basis = &measurement.basis;
    let Some(((renderer, _), id)) = basis.renderers.first().zip(basis.knob.as_ref()) else {
        return;
    };
    let (renderer, id, pane) = (renderer.clone(), id.clone(), basis.pane);
    let mut declared = window.plugins.declared.get(&renderer).into_iter().flatten();
    let declared = declared.find(|declared| declared.id == id).cloned();
    let (Some(declared), Some(pane)) = (declared, window.settings.pane_mut(pane)) else {
        window.messages.warn(format!("the view that `{id}` was measured in is gone"));
        return;
    };
    let values = pane.values.remove(&renderer).unwrap_or_default();
    match with(values.clone(), &declared, value) {
        Ok(set) if set.is_empty() => {}
        Ok(set) => drop(pane.values.insert(renderer, set)),
        Err(reason) => {
            pane.values.insert(renderer, values);
            window.messages.warn(reason);
        }
    }
}
