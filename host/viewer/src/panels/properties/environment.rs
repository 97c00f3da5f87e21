//! The light around the scene.

use super::{Scale, command_button, row, row_of, slider_row};
use crate::dialogs::{DialogPurpose, files};
use crate::document::set_environment_map;
use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_cloud::environment_map::Mapping;
use surfelshop_cloud::scene::{Axis, ProbeSource};
use surfelshop_session::input::environment_map::name;

/// The name of an environment map, without its folder.
fn short_name(source: &ProbeSource) -> String {
    match source {
        ProbeSource::File(path) => {
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        }
        built_in => name(built_in),
    }
}

/// The renderer of natural light, and what else uses it.
const NATURAL: &str = "environment";
const USES: [&str; 2] = [NATURAL, "reference"];

/// Shows it.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let chosen = window.settings.environment.as_ref().map(|known| short_name(&known.source));
    let text = chosen.unwrap_or_else(|| "none".to_owned());
    let mut chosen_entry = None;
    row_of(ui, "light probe", "The light around the scene.", |ui, _label| {
        let combo = egui::ComboBox::from_id_salt("environment").selected_text(text);
        let shown = combo.truncate().show_ui(ui, |ui| {
            for what in ["none", "studio", "sky", "a probe …"] {
                if ui.selectable_label(false, what).clicked() {
                    chosen_entry = Some(what);
                }
            }
        });
        shown.response.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "light around the scene")
        });
        shown.response
    });
    match chosen_entry {
        Some("none") => window.settings.environment = None,
        Some("studio") => set_environment_map(window, ProbeSource::Studio),
        Some("sky") => set_environment_map(window, ProbeSource::Sky),
        Some(_) => files::open(window, ui.ctx(), DialogPurpose::Probe),
        None => {}
    }
    let Some(environment) = &mut window.settings.environment else {
        let text = "Pictures of the light around a place (.hdr, .exr) can be dropped here.";
        ui.add(egui::Label::new(egui::RichText::new(text).weak()).wrap());
        offer(window, ui);
        return;
    };
    let mut degrees = environment.rotation.to_degrees();
    let scale = Scale::linear(-180.0..=180.0, "°");
    let about = "About the axis that points upwards.";
    if slider_row(ui, "rotation", about, &mut degrees, &scale).changed() {
        environment.rotation = degrees.to_radians();
    }
    let scale = Scale::linear(-8.0..=8.0, " EV");
    let about = "A factor of two for each stop (EV).";
    slider_row(ui, "brightness", about, &mut environment.stops, &scale);
    let [forward, up] = [environment.forward, environment.up];
    axis(ui, "centre of the picture", &mut environment.forward, up);
    axis(ui, "up in the picture", &mut environment.up, forward);
    if matches!(environment.source, ProbeSource::File(_)) {
        let text = environment.mapping.map_or("detected", Mapping::name);
        row(ui, "mapping", "How the picture of the probe shows directions.", |ui| {
            let combo = egui::ComboBox::from_id_salt("mapping").selected_text(text);
            let shown = combo.show_ui(ui, |ui| {
                ui.selectable_value(&mut environment.mapping, None, "detected");
                for mapping in Mapping::ALL {
                    ui.selectable_value(&mut environment.mapping, Some(mapping), mapping.name());
                }
            });
            shown.response
        });
    }
    used_by(window, ui);
}

/// Says that a renderer has no light, and offers some.
pub(super) fn offer(window: &mut Window, ui: &mut Ui) {
    let drawn = window.settings.pane(window.views.focused);
    let is_drawn = drawn
        .is_some_and(|pane| pane.renderers[..pane.mode.sides()].iter().any(|name| name == NATURAL));
    if !is_drawn || window.settings.environment.is_some() {
        return;
    }
    let text = format!("{NATURAL} draws by light from around, and there is none.");
    let text = egui::RichText::new(text).color(ui.visuals().warn_fg_color);
    ui.add(egui::Label::new(text).wrap());
    ui.horizontal_wrapped(|ui| {
        for (words, source) in [("studio", ProbeSource::Studio), ("sky", ProbeSource::Sky)] {
            if ui.button(format!("light by {words}")).clicked() {
                set_environment_map(window, source);
            }
        }
    });
}

/// Offers the renderer that uses the light where the view's does not.
fn used_by(window: &mut Window, ui: &mut Ui) {
    let pane = window.settings.pane(window.views.focused);
    let drawn = pane.map(|pane| pane.renderers[0].clone()).unwrap_or_default();
    if USES.contains(&drawn.as_str()) {
        return;
    }
    let text = format!("{drawn} draws this view and does not use it.");
    let text = egui::RichText::new(text).color(ui.visuals().warn_fg_color);
    ui.add(egui::Label::new(text).wrap());
    let has = window.renderers().iter().any(|name| name == NATURAL);
    if has && ui.button(format!("draw the view by {NATURAL}")).clicked() {
        let focused = window.views.focused;
        if let Some(pane) = window.settings.pane_mut(focused) {
            pane.renderers[0] = NATURAL.to_owned();
        }
    }
    command_button(window, ui, "remove-selected", "remove");
}

/// The choice of an axis perpendicular to another one.
fn axis(ui: &mut Ui, label: &str, chosen: &mut Axis, across: Axis) {
    row(ui, label, "", |ui| {
        let combo = egui::ComboBox::from_id_salt(label).selected_text(chosen.name());
        let shown = combo.show_ui(ui, |ui| {
            for axis in Axis::ALL {
                if axis.is_across(across) {
                    ui.selectable_value(chosen, axis, axis.name());
                }
            }
        });
        shown.response
    });
}
