//! Widgets for declared parameters.

use super::row::{Row, Scale, slider};
use crate::views::hands::can_be_picked;
use eframe::egui::{self, Role, Ui, WidgetInfo};
use surfelshop_api::params::{ParamDecl, ParamKind, Value, Values};

/// Shows every parameter with its help, unit, range and a button that brings the usual value back. `values` do not
/// contain parameters at their default.
///
/// Returns the parameter whose file is to be chosen in a dialog.
pub(crate) fn show(ui: &mut Ui, declared: &[ParamDecl], values: &mut Values) -> Option<ParamDecl> {
    show_all(ui, declared, values, false)
}

/// Shows every parameter of a tool, as [`show`] does.
///
/// Returns the parameter whose file is to be chosen, or whose pairs are to be clicked.
pub(crate) fn show_of_tool(
    ui: &mut Ui,
    declared: &[ParamDecl],
    values: &mut Values,
) -> Option<ParamDecl> {
    show_all(ui, declared, values, true)
}

fn show_all(
    ui: &mut Ui,
    declared: &[ParamDecl],
    values: &mut Values,
    is_of_tool: bool,
) -> Option<ParamDecl> {
    if declared.is_empty() {
        ui.weak("no parameters");
        return None;
    }
    let mut chosen = None;
    for parameter in declared {
        let mut value = parameter.sanitise(values.get(&parameter.id));
        let before = value.clone();
        let (label, about) = (label(parameter), help(parameter));
        let row = Row::new(&label, &about).reset(value == parameter.default);
        let shown = row.show(ui, |ui, label| match (&parameter.kind, &mut value) {
            (ParamKind::File { .. }, Value::Text(path)) => {
                let (response, chooses) = edit_path(ui, &parameter.id, path);
                chosen = chooses.then(|| parameter.clone()).or(chosen.take());
                response.labelled_by(label)
            }
            (ParamKind::Text, Value::Text(text)) if is_of_tool && can_be_picked(parameter) => {
                let (response, picks) = edit_pairs(ui, text);
                chosen = picks.then(|| parameter.clone()).or(chosen.take());
                response.labelled_by(label)
            }
            _ => edit(ui, label, parameter, &mut value),
        });
        if shown.reset {
            value = parameter.default.clone();
        }
        if value != before {
            // Typed values are clamped as for the plugin.
            let value = parameter.sanitise(Some(&value));
            if value == parameter.default {
                values.remove(&parameter.id);
            } else {
                values.insert(parameter.id.clone(), value);
            }
        }
    }
    chosen
}

/// The label, with the unit where that is too long to stand beside the number.
fn label(parameter: &ParamDecl) -> String {
    match parameter.unit.as_str() {
        "" => parameter.title().to_owned(),
        unit if unit.chars().count() <= SHORT_UNIT => parameter.title().to_owned(),
        unit => format!("{}, {unit}", parameter.title()),
    }
}

/// Characters of a unit that fits beside a number.
const SHORT_UNIT: usize = 4;

/// A range beyond this ratio or bound is no range for a slider.
const WIDEST: f64 = 1e12;

/// A text field for a path, and whether the button beside it was clicked. The path changes when the
/// field loses focus, since a part of it names no file.
fn edit_path(ui: &mut Ui, id: &str, path: &mut String) -> (egui::Response, bool) {
    ui.horizontal(|ui| {
        let id = ui.scope_id().with(id);
        let mut typed = ui.data(|data| data.get_temp(id)).unwrap_or_else(|| path.clone());
        let line = egui::TextEdit::singleline(&mut typed)
            .hint_text("none")
            .desired_width((ui.available_width() - 40.0).max(60.0));
        let response = ui.add(line);
        if response.has_focus() {
            ui.data_mut(|data| data.insert_temp(id, typed));
        } else {
            ui.data_mut(|data| data.remove_temp::<String>(id));
            if response.lost_focus() {
                // Absolute, so that it names the same file in a scene of any folder.
                let typed = typed.trim();
                let whole = std::path::absolute(typed).map(|whole| whole.display().to_string());
                *path = whole.unwrap_or_else(|_empty| typed.to_owned());
            }
        }
        let choose = ui.button("…");
        choose.widget_info(|| WidgetInfo::labeled(Role::Button, true, "choose a file"));
        (response, choose.on_hover_text("choose a file").clicked())
    })
    .inner
}

/// A text field for pairs of places, and whether the button beside it was clicked.
fn edit_pairs(ui: &mut Ui, text: &mut String) -> (egui::Response, bool) {
    ui.horizontal(|ui| {
        let line = egui::TextEdit::singleline(text).hint_text("none");
        let response = ui.add(line.desired_width((ui.available_width() - 60.0).max(60.0)));
        let pick = ui.button("pick").on_hover_text("pick them in the picture");
        pick.widget_info(|| WidgetInfo::labeled(Role::Button, true, "pick pairs in the picture"));
        (response, pick.clicked())
    })
    .inner
}

fn help(parameter: &ParamDecl) -> String {
    let quality = if parameter.quality { " Trades time for quality." } else { "" };
    // Nobody types the largest number there is.
    let expected = match parameter.range {
        Some([_, high]) if high >= WIDEST => String::new(),
        _ => format!("\n{}.", capitalised(&parameter.expectation())),
    };
    // By the id scripts set it.
    let id = if parameter.title() == parameter.id {
        String::new()
    } else {
        format!("\nOn the command line: `--set {}=…`.", parameter.id)
    };
    format!("{}{expected}{quality}{id}", parameter.doc)
}

fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// The widget for a value of its kind.
fn edit(ui: &mut Ui, label: egui::Id, parameter: &ParamDecl, value: &mut Value) -> egui::Response {
    let unit = suffix(parameter);
    match (&parameter.kind, value) {
        (ParamKind::Bool, Value::Bool(value)) => ui.checkbox(value, "").labelled_by(label),
        (ParamKind::Int, Value::Int(value)) => match scale(parameter) {
            Some(scale) => slider(ui, label, value, (&scale, &unit)),
            None => number(ui, value, parameter.range, 0.1, &unit).labelled_by(label),
        },
        (ParamKind::Float, Value::Float(value)) => match scale(parameter) {
            Some(scale) => slider(ui, label, value, (&scale, &unit)),
            None => {
                let speed = (0.01 * value.abs()).max(0.001);
                number(ui, value, parameter.range, speed, &unit).labelled_by(label)
            }
        },
        (ParamKind::Text, Value::Text(value)) => ui.text_edit_singleline(value).labelled_by(label),
        (ParamKind::Color, Value::Color(value)) => {
            // The widget rounds on its way through another space: what nobody touches stays.
            let mut edited = *value;
            let response = ui.color_edit_button_rgb(&mut edited).labelled_by(label);
            if response.changed() {
                *value = edited;
            }
            response
        }
        (ParamKind::Choice(ids), Value::Text(value)) => {
            let combo = egui::ComboBox::from_id_salt(&parameter.id).selected_text(value.as_str());
            let shown = combo.truncate().show_ui(ui, |ui| {
                for id in ids {
                    ui.selectable_value(value, id.clone(), id);
                }
            });
            let is_enabled = shown.response.enabled();
            shown
                .response
                .widget_info(|| WidgetInfo::labeled(Role::ComboBox, is_enabled, &parameter.id));
            shown.response
        }
        _ => ui.weak("cannot be shown"),
    }
}

/// The slider's range; `None` where a slider cannot be aimed.
fn scale(parameter: &ParamDecl) -> Option<Scale> {
    let [low, high] = parameter.range.filter(|[low, high]| {
        low.is_finite() && high.is_finite() && high.abs().max(low.abs()) < WIDEST
    })?;
    Some(match parameter.logarithmic {
        true => Scale::logarithmic(low..=high, ""),
        false => Scale::linear(low..=high, ""),
    })
}

/// A number without a slider.
fn number<N: egui::emath::Numeric>(
    ui: &mut Ui,
    value: &mut N,
    range: Option<[f64; 2]>,
    speed: f64,
    unit: &str,
) -> egui::Response {
    let mut drag = egui::DragValue::new(value).speed(speed).suffix(unit);
    if let Some([low, high]) = range {
        drag = drag.range(N::from_f64(low)..=N::from_f64(high));
    }
    let size = egui::vec2(ui.available_width(), ui.spacing().interact_size.y);
    ui.add_sized(size, drag)
}

fn suffix(parameter: &ParamDecl) -> String {
    match parameter.unit.chars().count() {
        1..=SHORT_UNIT => format!(" {}", parameter.unit),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;
    use egui_kittest::kittest::{NodeT as _, Queryable as _};

    #[test]
    fn a_color_that_nobody_touches_stays_the_default() {
        for color in [[0.0, 0.1, 0.9], [0.2, 0.4, 1.0], [1.0, 1.0 / 3.0, 1e-4], [2.0, 0.5, 0.1]] {
            let declared = [ParamDecl::new("paint", &color, "A colour.")];
            let mut harness = Harness::new_ui_state(
                |ui, values: &mut Values| {
                    // The icons are there from the second frame on.
                    crate::theme::apply(ui.ctx(), &Default::default());
                    if ui.ctx().cumulative_frame_nr() > 0 {
                        drop(show(ui, &declared, values));
                    }
                },
                Values::new(),
            );
            harness.run_steps(4);
            assert_eq!(*harness.state(), Values::new(), "{color:?}");
            let reset = harness.get_by_label("reset paint");
            assert!(reset.accesskit_node().is_disabled(), "{color:?}");
        }
    }
}
