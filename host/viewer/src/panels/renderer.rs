//! The panel of the focused view's renderers: parameters, presets and errors.

use super::parameters;
use crate::dialogs::{ParameterOwner, files};
use crate::document::{Mode, StateFolder};
use crate::window::Window;
use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{self, PopupCloseBehavior, Ui};
use surfelshop_api::params::Values;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let mut chooses = None;
    let Some(pane) = window.settings.pane_mut(focused) else { return };
    for side in 0..pane.mode.sides() {
        let name = pane.renderers[side].clone();
        ui.strong(&name);
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
        if side == 1
            && pane.mode == Mode::Difference
            && let Some(pane) = window.views.panes.get_mut(&focused)
        {
            let full = egui::Slider::new(&mut pane.heat_full, 1.0 / 255.0..=1.0);
            ui.add(full.logarithmic(true).text("brightest at a difference of"));
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
    let button = MenuButton::new(format!("presets of {renderer}")).config(config);
    button.ui(ui, |ui| {
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
    chosen
}
