//! The fields of the panel: reference, size, and the varied parameter.

use super::form::ReferenceChoice;
use crate::dialogs::{DialogPurpose, ParameterOwner, files};
use crate::panels::parameters;
use crate::panels::row::{row, row_of};
use crate::plugins::Readiness;
use crate::window::Window;
use eframe::egui::{self, ComboBox, DragValue, Ui};
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, ParamKind};

/// The choice of the reference.
pub(super) fn reference(window: &mut Window, ui: &mut Ui) {
    let chosen = window.measure.form.against(window);
    let knob = window.measure.form.knob(window).map(|knob| knob.title().to_owned());
    let itself = window.measure.form.renderer(window).unwrap_or_default().to_owned();
    let label_of = |against: &ReferenceChoice| match (against, &knob) {
        (ReferenceChoice::Itself, Some(knob)) => format!("{itself}, with the best {knob}"),
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
    row_of(ui, "against", "What counts as right.", |ui, label| {
        let combo = ComboBox::from_id_salt("against").selected_text(label_of(&chosen)).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for choice in choices {
                let is_chosen = choice == chosen;
                if ui.selectable_label(is_chosen, label_of(&choice)).clicked() {
                    window.measure.form.against = Some(choice);
                }
            }
        });
        shown.response.labelled_by(label)
    });
    match window.measure.form.against(window) {
        ReferenceChoice::Itself => {
            let about = format!("The value of {} that counts as right.", knob.unwrap_or_default());
            row(ui, "best value", &about, |ui| {
                ui.text_edit_singleline(&mut window.measure.form.best)
            });
        }
        ReferenceChoice::Renderer(_) => {}
        ReferenceChoice::Tracer(name) => tracer(window, ui, &name),
        ReferenceChoice::Picture => {
            row_of(ui, "file", "A picture of linear radiance (.exr).", |ui, label| {
                let line = egui::TextEdit::singleline(&mut window.measure.form.path);
                let width = (ui.available_width() - 40.0).max(60.0);
                let line = ui.add(line.desired_width(width)).labelled_by(label);
                let choose = ui.button("…").on_hover_text("choose a file");
                choose.widget_info(|| {
                    egui::WidgetInfo::labeled(egui::Role::Button, true, "choose a file")
                });
                if choose.clicked() {
                    files::open(window, ui.ctx(), DialogPurpose::Reference);
                }
                line
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
    row(ui, "as the view", &format!("Pictures of {width} x {height} pixels."), |ui| {
        let of_view = ui.checkbox(&mut form.as_view, format!("{width} x {height}"));
        if of_view.changed() && !form.as_view {
            form.size = [width, height];
        }
        of_view
    });
    if !form.as_view {
        row_of(ui, "size, pixels", "Width and height.", |ui, label| {
            let [width, height] = &mut form.size;
            let width = ui.add(DragValue::new(width).range(1..=16384)).labelled_by(label);
            width | ui.add(DragValue::new(height).range(1..=16384)).labelled_by(label)
        });
    }
}

/// The choice of the varied parameter, and its values.
pub(super) fn knob(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.settings.pane(window.views.focused) else { return };
    let (renderers, n_sides) = (pane.renderers.clone(), pane.mode.sides());
    let mut side = window.measure.form.side(pane);
    if n_sides == 2 {
        row_of(ui, "renderer", "Whose parameter is varied.", |ui, _label| {
            let shown = ui.horizontal_wrapped(|ui| {
                for (i, name) in renderers.iter().enumerate() {
                    ui.selectable_value(&mut side, i, name);
                }
            });
            shown.response
        });
        window.measure.form.side = side;
    }
    let mut declared = window.measure.form.declared(window).to_vec();
    declared.retain(|knob| !matches!(knob.kind, ParamKind::File { .. } | ParamKind::Color));
    // Quality parameters come first.
    declared.sort_by_key(|knob| !knob.quality);
    let chosen = window.measure.form.knob(window).cloned();
    let form = &mut window.measure.form;
    if declared.is_empty() {
        ui.weak(format!("{} has no parameter to vary", renderers[side]));
        return;
    }
    let about = "The parameter that is varied.";
    row_of(ui, "vary", about, |ui, label| {
        let shown = chosen.as_ref().map_or("choose one", ParamDecl::title);
        let combo = ComboBox::from_id_salt("knob").selected_text(shown).truncate();
        let shown = combo.show_ui(ui, |ui| {
            for knob in &declared {
                let text = match knob.quality {
                    true => format!("{}: trades time for quality", knob.title()),
                    false => knob.title().to_owned(),
                };
                if ui.selectable_label(chosen.as_ref() == Some(knob), text).clicked() {
                    form.knob = Some(knob.id.clone());
                }
            }
        });
        shown.response.labelled_by(label)
    });
    if chosen.is_some() {
        row(ui, "values", "Its values, separated by commas.", |ui| {
            ui.text_edit_singleline(&mut form.typed)
        });
    }
    let about = "How often each picture is timed, in turns; the median counts.";
    row(ui, "pictures to time", about, |ui| {
        ui.add(DragValue::new(&mut form.repeats).range(1..=100))
    });
}
