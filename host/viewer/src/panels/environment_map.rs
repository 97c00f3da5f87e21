//! The panel of the environment map.

use super::row::{row, row_of};
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

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let chosen = window.settings.environment.as_ref().map(|known| short_name(&known.source));
    let text = chosen.unwrap_or_else(|| "none".to_owned());
    let mut chosen_entry = None;
    row_of(ui, "light probe", "The light around the scene.", |ui, _label| {
        let combo = egui::ComboBox::from_id_salt("environment").selected_text(text);
        let shown = combo.width(150.0).truncate().show_ui(ui, |ui| {
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
        ui.weak("Probes (.hdr, .exr) can be dropped here; the renderer `environment` uses them.");
        return;
    };
    let mut degrees = environment.rotation.to_degrees();
    let slider = egui::Slider::new(&mut degrees, -180.0..=180.0).suffix("°");
    if row(ui, "turned by", "About the axis that points upwards.", |ui| ui.add(slider)).changed() {
        environment.rotation = degrees.to_radians();
    }
    let stops = egui::Slider::new(&mut environment.stops, -8.0..=8.0).suffix(" EV");
    row(ui, "brightness", "A factor of two for each stop (EV).", |ui| ui.add(stops));
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
