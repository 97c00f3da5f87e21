//! The panel of the light around the scene.

use super::dialogs::{self, Asked};
use super::window::Window;
use crate::surroundings::{name, standing};
use eframe::egui::{self, Ui};
use std::path::Path;
use surfelshop_cloud::probe::Mapping;
use surfelshop_cloud::scene::{Axis, ProbeSource, SceneEnvironment};

/// Puts a probe around the scene, turned as the one before it.
pub(crate) fn put(window: &mut Window, path: &Path) {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    surround(window, ProbeSource::File(path));
}

fn surround(window: &mut Window, source: ProbeSource) {
    let before = window.settings.environment.take();
    let new = standing(source.clone(), window.up);
    // How a picture is mapped is a fact of that picture; how the light stands is the user's choice.
    let kept = before.map(|old| SceneEnvironment { source, mapping: None, ..old });
    window.settings.environment = Some(kept.unwrap_or(new));
}

/// What the light is called, without its folder.
fn short_name(source: &ProbeSource) -> String {
    match source {
        ProbeSource::File(path) => {
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        }
        built_in => name(built_in),
    }
}

/// The panel.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let chosen = window.settings.environment.as_ref().map(|known| short_name(&known.source));
    let text = chosen.unwrap_or_else(|| "none".to_owned());
    let mut asked = None;
    let combo = egui::ComboBox::from_id_salt("environment").selected_text(text);
    let shown = combo.show_ui(ui, |ui| {
        for what in ["none", "studio", "sky", "a probe …"] {
            if ui.selectable_label(false, what).clicked() {
                asked = Some(what);
            }
        }
    });
    shown.response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::ComboBox, true, "light around the scene")
    });
    match asked {
        Some("none") => window.settings.environment = None,
        Some("studio") => surround(window, ProbeSource::Studio),
        Some("sky") => surround(window, ProbeSource::Sky),
        Some(_) => dialogs::dialog(window, ui.ctx(), Asked::Probe),
        None => {}
    }
    let Some(environment) = &mut window.settings.environment else {
        ui.weak("Probes (.hdr, .exr) can be dropped here. The renderer `environment` uses them.");
        return;
    };
    let mut degrees = environment.rotation.to_degrees();
    let slider = egui::Slider::new(&mut degrees, -180.0..=180.0).suffix(" deg").text("turned by");
    if ui.add(slider).changed() {
        environment.rotation = degrees.to_radians();
    }
    let stops = egui::Slider::new(&mut environment.stops, -8.0..=8.0).suffix(" stops");
    ui.add(stops.text("brightness"));
    let [forward, up] = [environment.forward, environment.up];
    axis(ui, "centre of the picture", &mut environment.forward, up);
    axis(ui, "up in the picture", &mut environment.up, forward);
    if matches!(environment.source, ProbeSource::File(_)) {
        let text = environment.mapping.map_or("detected", Mapping::name);
        let combo = egui::ComboBox::from_label("mapping").selected_text(text);
        combo.show_ui(ui, |ui| {
            ui.selectable_value(&mut environment.mapping, None, "detected");
            for mapping in Mapping::ALL {
                ui.selectable_value(&mut environment.mapping, Some(mapping), mapping.name());
            }
        });
    }
}

/// Chooses an axis across another one.
fn axis(ui: &mut Ui, label: &str, chosen: &mut Axis, across: Axis) {
    let combo = egui::ComboBox::from_label(label).selected_text(chosen.name());
    combo.show_ui(ui, |ui| {
        for axis in Axis::ALL {
            if axis.is_across(across) {
                ui.selectable_value(chosen, axis, axis.name());
            }
        }
    });
}
