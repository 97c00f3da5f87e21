//! The fields of the panel: reference, size, and the varied parameter.

use super::form::ReferenceChoice;
use crate::dialogs::{DialogPurpose, ParameterOwner, files};
use crate::panels::parameters;
use crate::plugins::Readiness;
use crate::window::Window;
use eframe::egui::{self, ComboBox, DragValue, Ui};
use surfelshop_api::UnitKind;
use surfelshop_api::params::ParamKind;

/// The choice of the reference.
pub(super) fn reference(window: &mut Window, ui: &mut Ui) {
    let chosen = window.measure.form.against(window);
    let knob = window.measure.form.knob(window).map(|knob| knob.id.clone());
    let itself = window.measure.form.renderer(window).unwrap_or_default().to_owned();
    let label_of = |against: &ReferenceChoice| match (against, &knob) {
        (ReferenceChoice::Itself, Some(id)) => format!("{itself}, with the best {id}"),
        (ReferenceChoice::Itself, None) => itself.clone(),
        (ReferenceChoice::Renderer(name), _) => name.clone(),
        (ReferenceChoice::Tracer(name), _) => format!("{name} (traced)"),
        (ReferenceChoice::Picture, _) => "a picture (.exr)".to_owned(),
    };
    let mut choices: Vec<ReferenceChoice> = knob.iter().map(|_| ReferenceChoice::Itself).collect();
    choices.extend(window.renderers().into_iter().map(ReferenceChoice::Renderer));
    let tracers = window.plugins.registry.names(UnitKind::Tracer);
    choices.extend(tracers.into_iter().map(ReferenceChoice::Tracer));
    choices.push(ReferenceChoice::Picture);
    ui.horizontal(|ui| {
        let label = ui.label("against");
        let combo = ComboBox::from_id_salt("against").selected_text(label_of(&chosen)).width(220.0);
        let shown = combo.show_ui(ui, |ui| {
            for choice in choices {
                let is_chosen = choice == chosen;
                if ui.selectable_label(is_chosen, label_of(&choice)).clicked() {
                    window.measure.form.against = Some(choice);
                }
            }
        });
        shown.response.labelled_by(label.id);
    });
    match window.measure.form.against(window) {
        ReferenceChoice::Itself => {
            ui.horizontal(|ui| {
                let label = ui.label(format!("best {}", knob.unwrap_or_default()));
                let line = egui::TextEdit::singleline(&mut window.measure.form.best);
                ui.add(line.desired_width(100.0)).labelled_by(label.id);
            });
        }
        ReferenceChoice::Renderer(_) => {}
        ReferenceChoice::Tracer(name) => tracer(window, ui, &name),
        ReferenceChoice::Picture => {
            ui.horizontal(|ui| {
                let label = ui.label("file");
                let line = egui::TextEdit::singleline(&mut window.measure.form.path);
                ui.add(line.desired_width(220.0)).labelled_by(label.id);
                if ui.button("choose …").clicked() {
                    files::open(window, ui.ctx(), DialogPurpose::Reference);
                }
            });
            ui.weak("its size is the size of the pictures that are measured");
        }
    }
}

/// The parameters of a tracer.
fn tracer(window: &mut Window, ui: &mut Ui, name: &str) {
    // After a crash no plugin runs until the user has decided.
    if window.plugins.crash.is_some() {
        return;
    }
    window.measure.units.prepare(ui.ctx(), &window.plugins.registry, name);
    let declared = match window.measure.units.readiness(name) {
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
    let chosen_file = header.show(ui, |ui| parameters::show(ui, &declared, values)).body_returned;
    if let Some(parameter) = chosen_file.flatten() {
        files::open_for_parameter(
            window,
            ui.ctx(),
            ParameterOwner::Tracer(name.to_owned()),
            &parameter,
        );
    }
}

/// The size of the pictures, unless the reference is a file.
pub(super) fn size(window: &mut Window, ui: &mut Ui) {
    if window.measure.form.against(window) == ReferenceChoice::Picture {
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

/// The choice of the varied parameter, and its values.
pub(super) fn knob(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.settings.pane(window.views.focused) else { return };
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
    // Quality parameters come first.
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
