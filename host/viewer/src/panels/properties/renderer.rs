//! The focused view's renderers: parameters, presets and errors.

use super::row_of;
use crate::dialogs::{ParameterOwner, files};
use crate::document::StateFolder;
use crate::panels::parameters;
use crate::theme::{Icon, iconed};
use crate::window::Window;
use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{self, Button, PopupCloseBehavior, Role, Ui, WidgetInfo};
use surfelshop_api::params::Values;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let mut chooses = None;
    let renderers = window.drawers();
    let Some(pane) = window.settings.pane_mut(focused) else { return };
    for side in 0..pane.mode.sides() {
        let name = pane.renderers[side].clone();
        choose(ui, &renderers, &mut pane.renderers[side], side, pane.mode.sides());
        if side == 1 && pane.renderers[0] == pane.renderers[1] {
            ui.weak("with the parameters above");
            continue;
        }
        match window.plugins.declared.get(&name) {
            Some(declared) => {
                let values = pane.values.entry(name.clone()).or_default();
                let chosen_file =
                    ui.push_id(side, |ui| parameters::show(ui, declared, values)).inner;
                let owner = ParameterOwner::Renderer { pane: focused, renderer: name.clone() };
                chooses = chosen_file.map(|parameter| (owner, parameter)).or(chooses);
                let chosen = presets(
                    ui,
                    &name,
                    values,
                    &mut window.panels.preset,
                    &window.document.state_folder,
                );
                match chosen {
                    Some(Ok(chosen)) => *values = chosen,
                    Some(Err(reason)) => window.messages.warn(reason),
                    None => {}
                }
                if values.is_empty() {
                    pane.values.remove(&name);
                }
            }
            None => {
                ui.weak("not loaded yet");
            }
        }
        let error =
            window.views.panes.get(&focused).and_then(|pane| pane.sides[side].error.clone());
        if let Some(error) = error {
            ui.colored_label(ui.visuals().error_fg_color, error);
        }
    }
    if let Some((owner, parameter)) = chooses {
        files::open_for_parameter(window, ui.ctx(), owner, &parameter);
    }
}

/// The menu of presets. Returns the values of a chosen one, or an error in one line.
fn presets(
    ui: &mut Ui,
    renderer: &str,
    values: &Values,
    typed: &mut String,
    state_folder: &Option<StateFolder>,
) -> Option<Result<Values, String>> {
    let state_folder = state_folder.as_ref()?;
    let mut chosen = None;
    // A click into the text field must not close the menu.
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let button = MenuButton::from_button(Button::new(iconed(ui, Icon::Bookmark, "presets")));
    let button = button.config(config);
    let (response, _) = button.ui(ui, |ui| {
        for name in state_folder.preset_names(renderer) {
            if ui.button(&name).clicked() {
                let loaded = state_folder.load_preset(renderer, &name);
                chosen = Some(loaded.map_err(|error| format!("{error:#}")));
                ui.close();
            }
        }
        let label = ui.label("save these as");
        ui.text_edit_singleline(typed).labelled_by(label.id);
        if ui.button("save").clicked() {
            if let Err(error) = state_folder.save_preset(renderer, typed, values) {
                chosen = Some(Err(format!("{error:#}")));
            }
            ui.close();
        }
    });
    response
        .widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("presets of {renderer}")));
    response.on_hover_text("Values that were saved under a name.");
    chosen
}

/// The choice of a renderer.
fn choose(ui: &mut Ui, names: &[String], chosen: &mut String, side: usize, of: usize) {
    let label = match (side, of) {
        (_, 1) => "renderer",
        (0, _) => "first renderer",
        _ => "second renderer",
    };
    let about = "What draws the view; the outliner lists all, to be dragged onto a view.";
    row_of(ui, label, about, |ui, _label| {
        let menu = egui::ComboBox::from_id_salt(("renderer of a side", side)).truncate();
        let shown = menu.selected_text(chosen.as_str()).show_ui(ui, |ui| {
            for name in names {
                ui.selectable_value(chosen, name.clone(), name);
            }
        });
        let what = format!("{label} of the view");
        shown.response.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &what));
        shown.response
    });
}
