//! Widgets for declared parameters.

use crate::theme::{Icon, icon_text, space};
use eframe::egui::{self, Role, Ui, WidgetInfo};
use surfelshop_api::params::{ParamDecl, ParamKind, Value, Values};

/// Shows every parameter with its help, unit, range and a reset button. `values` do not contain
/// parameters at their default.
///
/// Returns the parameter whose file is to be chosen in a dialog.
pub(crate) fn show(ui: &mut Ui, declared: &[ParamDecl], values: &mut Values) -> Option<ParamDecl> {
    if declared.is_empty() {
        ui.weak("no parameters");
        return None;
    }
    let mut chosen = None;
    let grid = egui::Grid::new("parameters").num_columns(3).spacing([8.0, 6.0]);
    grid.min_col_width(space::LABEL).show(ui, |ui| {
        for parameter in declared {
            let mut value = parameter.sanitise(values.get(&parameter.id));
            let before = value.clone();
            let label = ui.label(&parameter.id).on_hover_text(help(parameter));
            let response = match (&parameter.kind, &mut value) {
                (ParamKind::File { .. }, Value::Text(path)) => {
                    let (response, chooses) = edit_path(ui, &parameter.id, path);
                    chosen = chooses.then(|| parameter.clone()).or(chosen.take());
                    response
                }
                _ => edit(ui, parameter, &mut value),
            };
            response.labelled_by(label.id).on_hover_text(help(parameter));
            let is_default = value == parameter.default;
            let reset =
                egui::Button::new(icon_text(Icon::RotateCcw).small()).frame_when_inactive(false);
            let reset = ui.add_enabled(!is_default, reset);
            reset.widget_info(|| WidgetInfo::labeled(Role::Button, !is_default, "reset"));
            if reset.on_hover_text("back to the default").clicked() {
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
            ui.end_row();
        }
    });
    chosen
}

/// A text field for a path, and whether the button beside it was clicked. The path changes when the
/// field loses focus, since a part of it names no file.
fn edit_path(ui: &mut Ui, id: &str, path: &mut String) -> (egui::Response, bool) {
    ui.horizontal(|ui| {
        let id = ui.scope_id().with(id);
        let mut typed = ui.data(|data| data.get_temp(id)).unwrap_or_else(|| path.clone());
        let line = egui::TextEdit::singleline(&mut typed).hint_text("none").desired_width(140.0);
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
        (response, ui.button("…").on_hover_text("choose a file").clicked())
    })
    .inner
}

fn help(parameter: &ParamDecl) -> String {
    let quality = if parameter.quality { " Trades time for quality." } else { "" };
    format!("{}\n{}.{quality}", parameter.doc, capitalised(&parameter.expectation()))
}

fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |first| first.to_uppercase().chain(chars).collect())
}

/// The widget for a value of its kind.
fn edit(ui: &mut Ui, parameter: &ParamDecl, value: &mut Value) -> egui::Response {
    match (&parameter.kind, value) {
        (ParamKind::Bool, Value::Bool(value)) => ui.checkbox(value, ""),
        (ParamKind::Int, Value::Int(value)) => match parameter.range {
            Some([low, high]) => ui.add(
                egui::Slider::new(value, low as i64..=high as i64)
                    .logarithmic(parameter.logarithmic)
                    .suffix(suffix(parameter)),
            ),
            None => ui.add(egui::DragValue::new(value).suffix(suffix(parameter))),
        },
        (ParamKind::Float, Value::Float(value)) => match parameter.range {
            Some([low, high]) => ui.add(
                egui::Slider::new(value, low..=high)
                    .logarithmic(parameter.logarithmic)
                    .suffix(suffix(parameter)),
            ),
            None => ui.add(egui::DragValue::new(value).speed(0.01).suffix(suffix(parameter))),
        },
        (ParamKind::Text, Value::Text(value)) => ui.text_edit_singleline(value),
        (ParamKind::Color, Value::Color(value)) => {
            // The widget rounds on its way through another space: what nobody touches stays.
            let mut edited = *value;
            let response = ui.color_edit_button_rgb(&mut edited);
            if response.changed() {
                *value = edited;
            }
            response
        }
        (ParamKind::Choice(ids), Value::Text(value)) => {
            let combo = egui::ComboBox::from_id_salt(&parameter.id).selected_text(value.as_str());
            combo
                .show_ui(ui, |ui| {
                    for id in ids {
                        ui.selectable_value(value, id.clone(), id);
                    }
                })
                .response
        }
        _ => ui.weak("cannot be shown"),
    }
}

fn suffix(parameter: &ParamDecl) -> String {
    if parameter.unit.is_empty() { String::new() } else { format!(" {}", parameter.unit) }
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
            let reset = harness.get_by_label("reset");
            assert!(reset.accesskit_node().is_disabled(), "{color:?}");
        }
    }
}
