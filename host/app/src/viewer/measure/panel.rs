//! The panel beside the pictures: what is measured against what, and how far it is.

use super::form::{Against, Form};
use super::measurement::{Measurement, State};
use super::plan::{self, Kind};
use super::{begin, cancel, plot, table};
use crate::viewer::dialogs::{self, Asked, Whose};
use crate::viewer::parameters;
use crate::viewer::shelf::Readiness;
use crate::viewer::window::Window;
use eframe::egui::{self, Align, ComboBox, DragValue, Layout, ScrollArea, Ui};
use surfelshop_api::UnitKind;
use surfelshop_api::params::ParamKind;

/// The whole panel.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    Form::follow(window);
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.heading("Measure");
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.small_button("x").on_hover_text("close (M)").clicked() {
                window.measure.form.open = false;
            }
        });
    });
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        // The bar of the area lies over its right edge.
        ui.set_max_width(ui.available_width() - BAR);
        ui.add_enabled_ui(!window.measure.is_busy(), |ui| {
            against(window, ui);
            size(window, ui);
        });
        ui.separator();
        section(ui, "This view", |ui| present(window, ui));
        section(ui, "Error against time", |ui| sweep(window, ui));
    });
}

/// Width of a scroll bar in points.
const BAR: f32 = 12.0;

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(true).show_unindented(ui, contents);
}

fn present(window: &mut Window, ui: &mut Ui) {
    run(window, ui, Kind::Present);
    if let Some(measurement) = window.measure.of(Kind::Present) {
        told(window, ui, measurement, Kind::Present);
        table::pictures(ui, measurement);
    }
}

fn sweep(window: &mut Window, ui: &mut Ui) {
    ui.add_enabled_ui(!window.measure.is_busy(), |ui| knob(window, ui));
    run(window, ui, Kind::Sweep);
    let Some(measurement) = window.measure.of(Kind::Sweep) else { return };
    told(window, ui, measurement, Kind::Sweep);
    let now = present_value(window, measurement);
    let drawn = plot::show(ui, measurement, now.as_deref());
    let listed = table::values(ui, measurement, now.as_deref());
    if let Some(value) = drawn.or(listed) {
        turn(window, &value);
    }
}

/// What is measured against.
fn against(window: &mut Window, ui: &mut Ui) {
    let chosen = window.measure.form.against(window);
    let knob = window.measure.form.knob(window).map(|knob| knob.id.clone());
    let itself = window.measure.form.renderer(window).unwrap_or_default().to_owned();
    let said = |against: &Against| match (against, &knob) {
        (Against::Itself, Some(id)) => format!("{itself}, with the best {id}"),
        (Against::Itself, None) => itself.clone(),
        (Against::Renderer(name), _) => name.clone(),
        (Against::Tracer(name), _) => format!("{name} (traced)"),
        (Against::Picture, _) => "a picture (.exr)".to_owned(),
    };
    let mut choices: Vec<Against> = knob.iter().map(|_| Against::Itself).collect();
    choices.extend(window.renderers().into_iter().map(Against::Renderer));
    let tracers = window.registry.names(UnitKind::Tracer);
    choices.extend(tracers.into_iter().map(Against::Tracer));
    choices.push(Against::Picture);
    ui.horizontal(|ui| {
        let label = ui.label("against");
        let combo = ComboBox::from_id_salt("against").selected_text(said(&chosen)).width(220.0);
        let shown = combo.show_ui(ui, |ui| {
            for choice in choices {
                let is_chosen = choice == chosen;
                if ui.selectable_label(is_chosen, said(&choice)).clicked() {
                    window.measure.form.against = Some(choice);
                }
            }
        });
        shown.response.labelled_by(label.id);
    });
    match window.measure.form.against(window) {
        Against::Itself => {
            ui.horizontal(|ui| {
                let label = ui.label(format!("best {}", knob.unwrap_or_default()));
                let line = egui::TextEdit::singleline(&mut window.measure.form.best);
                ui.add(line.desired_width(100.0)).labelled_by(label.id);
            });
        }
        Against::Renderer(_) => {}
        Against::Tracer(name) => tracer(window, ui, &name),
        Against::Picture => {
            ui.horizontal(|ui| {
                let label = ui.label("file");
                let line = egui::TextEdit::singleline(&mut window.measure.form.path);
                ui.add(line.desired_width(220.0)).labelled_by(label.id);
                if ui.button("choose …").clicked() {
                    dialogs::dialog(window, ui.ctx(), Asked::Reference);
                }
            });
            ui.weak("its size is the size of the pictures that are measured");
        }
    }
}

/// The parameters of a tracer.
fn tracer(window: &mut Window, ui: &mut Ui, name: &str) {
    // Until the user has decided about a crash, no plugin's code runs.
    if window.crash.is_some() {
        return;
    }
    window.measure.shelf.prepare(ui.ctx(), &window.registry, name);
    let declared = match window.measure.shelf.readiness(name) {
        Readiness::Loading => {
            ui.weak("loading");
            return;
        }
        Readiness::Refused(reason) => {
            ui.colored_label(ui.visuals().error_fg_color, reason.to_owned());
            return;
        }
        Readiness::Ready(unit) => unit.description.params.clone(),
    };
    let values = window.measure.form.tracer_values.entry(name.to_owned()).or_default();
    let header = egui::CollapsingHeader::new(format!("parameters of {name}"));
    let asked = header.show(ui, |ui| parameters::show(ui, &declared, values)).body_returned;
    if let Some(parameter) = asked.flatten() {
        dialogs::value_dialog(window, ui.ctx(), Whose::Tracer(name.to_owned()), &parameter);
    }
}

/// Size of the pictures, where no file says it.
fn size(window: &mut Window, ui: &mut Ui) {
    if window.measure.form.against(window) == Against::Picture {
        return;
    }
    let [width, height] = window.measure.form.size_px(window);
    let form = &mut window.measure.form;
    ui.horizontal(|ui| {
        let label = ui.label("size");
        let of_view = ui.checkbox(&mut form.as_view, "as the view");
        if of_view.changed() && !form.as_view {
            form.size = [width, height];
        }
        if form.as_view {
            ui.weak(format!("{width} x {height} pixels"));
        } else {
            for side in &mut form.size {
                ui.add(DragValue::new(side).range(1..=16384)).labelled_by(label.id);
            }
            ui.weak("pixels");
        }
    });
}

/// The parameter that is turned, and its values.
fn knob(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.settings.pane(window.focused) else { return };
    let (renderers, n_sides) = (pane.renderers.clone(), pane.mode.sides());
    let mut side = window.measure.form.side(pane);
    if n_sides == 2 {
        ui.horizontal(|ui| {
            ui.label("renderer");
            for (i, name) in renderers.iter().enumerate() {
                ui.selectable_value(&mut side, i, name);
            }
        });
        window.measure.form.side = side;
    }
    let mut declared = window.measure.form.declared(window).to_vec();
    declared.retain(|knob| !matches!(knob.kind, ParamKind::File { .. } | ParamKind::Color));
    // Those that are made to be turned come first.
    declared.sort_by_key(|knob| !knob.quality);
    let chosen = window.measure.form.knob(window).map(|knob| knob.id.clone());
    let form = &mut window.measure.form;
    if declared.is_empty() {
        ui.weak(format!("{} has no parameter to turn", renderers[side]));
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("turn").on_hover_text("the parameter that is turned");
        let shown = chosen.as_deref().unwrap_or("choose a parameter");
        let combo = ComboBox::from_id_salt("knob").selected_text(shown).width(160.0);
        let shown = combo.show_ui(ui, |ui| {
            for knob in &declared {
                let text = match knob.quality {
                    true => format!("{}: trades time for quality", knob.id),
                    false => knob.id.clone(),
                };
                if ui.selectable_label(chosen.as_ref() == Some(&knob.id), text).clicked() {
                    form.knob = Some(knob.id.clone());
                }
            }
        });
        shown.response.labelled_by(label.id);
        let label = ui.label("times").on_hover_text("frames of each that are timed, in turns");
        ui.add(DragValue::new(&mut form.repeats).range(1..=100)).labelled_by(label.id);
    });
    if chosen.is_some() {
        ui.horizontal(|ui| {
            let label = ui.label("values");
            let line = egui::TextEdit::singleline(&mut form.typed);
            ui.add(line.desired_width(f32::INFINITY)).labelled_by(label.id);
        });
    }
}

/// The button that begins a measurement, or how far it is and the button that ends it.
fn run(window: &mut Window, ui: &mut Ui, kind: Kind) {
    let what = match kind {
        Kind::Present => "measure",
        Kind::Sweep => "sweep",
    };
    let at_work = window.measure.of(kind).filter(|measurement| measurement.is_at_work());
    if let Some((fraction, text)) = at_work.map(Measurement::progress) {
        ui.horizontal(|ui| {
            let width = (ui.available_width() - 70.0).max(80.0);
            ui.add(egui::ProgressBar::new(fraction).desired_width(width).text(text));
            if ui.button("cancel").clicked() {
                cancel(window);
            }
        });
        return;
    }
    let reason = plan::basis(window, kind).err();
    let is_free = reason.is_none() && !window.measure.is_busy() && window.crash.is_none();
    ui.horizontal(|ui| {
        let button = ui.add_enabled(is_free, egui::Button::new(what));
        let said = match kind {
            Kind::Present => "what the view shows",
            Kind::Sweep => "error against time, value by value",
        };
        match &reason {
            None => ui.weak(said),
            Some(reason) => ui.weak(reason),
        };
        if button.clicked()
            && let Err(reason) = begin(window, kind)
        {
            window.messages.warn(reason);
        }
    });
}

/// What was measured, and whether it still is what would be measured now.
fn told(window: &Window, ui: &mut Ui, measurement: &Measurement, kind: Kind) {
    let basis = &measurement.basis;
    let size = basis.size.map_or(String::new(), |[w, h]| format!(", {w} x {h} pixels"));
    let of: Vec<&str> = basis.renderers.iter().map(|(name, _)| name.as_str()).collect();
    let what = match &basis.knob {
        Some(knob) => format!("{} by {knob}", of.join(", ")),
        None => of.join(", "),
    };
    ui.add(egui::Label::new(format!("{what} against {}{size}", basis.source.name())).wrap());
    let warns = ui.visuals().warn_fg_color;
    match &measurement.state {
        State::Failed(line) => {
            let text = egui::RichText::new(line).color(ui.visuals().error_fg_color);
            ui.add(egui::Label::new(text).wrap());
        }
        State::Cancelled => drop(ui.colored_label(warns, "cancelled: what is here is not all")),
        State::AtWork | State::Done => {}
    }
    if let Some(changed) = measurement.stale(window, kind) {
        ui.colored_label(warns, format!("stale: {changed}"))
            .on_hover_text("measured now, the numbers would be others");
    }
}

impl Measurement {
    /// What has changed since it began, so that its numbers are not those of what is shown now.
    pub(crate) fn stale(&self, window: &Window, kind: Kind) -> Option<&'static str> {
        match plan::basis(window, kind) {
            Ok(now) => self.basis.changed(&now),
            Err(_) => Some("there is no such view, knob or reference any more"),
        }
    }
}

/// The value that the swept knob has in the view now.
fn present_value(window: &Window, measurement: &Measurement) -> Option<String> {
    let (renderer, _) = measurement.basis.renderers.first()?;
    let id = measurement.basis.knob.as_ref()?;
    let pane = window.settings.pane(measurement.basis.pane)?;
    let declared = window.declared.get(renderer)?.iter().find(|declared| declared.id == *id)?;
    let value = declared.sanitise(pane.values.get(renderer).and_then(|values| values.get(id)));
    // As it was typed, since 0.1 may have been typed as .10.
    let is_value = |typed: &&String| declared.parse(typed).is_ok_and(|typed| typed == value);
    measurement.subjects.iter().map(|subject| &subject.value).find(is_value).cloned()
}

/// Sets the swept knob in the view that was measured, a change like any other of a parameter.
fn turn(window: &mut Window, value: &str) {
    let Some(measurement) = &window.measure.sweep else { return };
    let basis = &measurement.basis;
    let Some(((renderer, _), id)) = basis.renderers.first().zip(basis.knob.as_ref()) else {
        return;
    };
    let (renderer, id, pane) = (renderer.clone(), id.clone(), basis.pane);
    let mut declared = window.declared.get(&renderer).into_iter().flatten();
    let declared = declared.find(|declared| declared.id == id).cloned();
    let (Some(declared), Some(pane)) = (declared, window.settings.pane_mut(pane)) else {
        window.messages.warn(format!("the view that `{id}` was measured in is gone"));
        return;
    };
    let values = pane.values.remove(&renderer).unwrap_or_default();
    match plan::with(values.clone(), &declared, value) {
        Ok(set) if set.is_empty() => {}
        Ok(set) => drop(pane.values.insert(renderer, set)),
        Err(reason) => {
            pane.values.insert(renderer, values);
            window.messages.warn(reason);
        }
    }
}
