//! The panels at the left and the status line.

use super::dialogs::{self, Whose};
use super::lights::{self, Around};
use super::made_of;
use super::memory::Memory;
use super::parameters;
use super::settings::Mode;
use super::surroundings;
use super::window::Window;
use crate::made;
use eframe::egui::containers::menu::{MenuButton, MenuConfig};
use eframe::egui::{self, PopupCloseBehavior, RichText, ScrollArea, Ui};
use glam::DVec3;
use surfelshop_api::params::{Values, linear_to_srgb, srgb_to_linear};
use surfelshop_api::{Light, ObjectFrame, Projection};
use surfelshop_cloud::Loaded;
use surfelshop_engine::PassState;
use surfelshop_engine::picture::{Background, ToneMap};

/// Everything at the left.
pub(crate) fn side(window: &mut Window, ui: &mut Ui) {
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        section(ui, "Clouds", |ui| clouds(window, ui));
        section(ui, "Renderer", |ui| renderer(window, ui));
        section(ui, "Camera", |ui| camera(window, ui));
        section(ui, "Light and picture", |ui| picture(window, ui));
        section(ui, "Environment", |ui| surroundings::show(window, ui));
        section(ui, "Surface", |ui| surface(window, ui));
        section(ui, "Passes", |ui| passes(window, ui));
        let made_of = egui::CollapsingHeader::new("What it is made of");
        made_of.default_open(false).show(ui, |ui| made_of::show(window, ui));
    });
}

fn section(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(title).default_open(true).show(ui, contents);
}

fn clouds(window: &mut Window, ui: &mut Ui) {
    if let Some(loading) = &window.loading {
        let files: Vec<_> = loading.files.iter().map(|file| file.display().to_string()).collect();
        ui.label(format!("reading {}", files.join(", ")));
        ui.horizontal(|ui| {
            let width = ui.available_width() - 60.0;
            ui.add(
                egui::ProgressBar::new(loading.fraction()).desired_width(width).show_percentage(),
            );
            if ui.button("cancel").clicked() {
                loading.cancel();
            }
        });
    }
    if let Some(fraction) = window.arriving {
        ui.label("putting surfels in order; a few of them are shown");
        ui.add(egui::ProgressBar::new(fraction).show_percentage());
    }
    let Some(shown) = &window.shown else {
        if window.loading.is_none() {
            ui.label("Drop point clouds here, or open them with Ctrl O.");
        }
        return;
    };
    let mut changed = None;
    for (i, item) in shown.stock.items().iter().enumerate() {
        let Loaded { cloud, summary } = &item.loaded;
        // The name that a scene gives.
        let entry = item.entry.and_then(|i| window.scene_file.as_ref()?.clouds.get(i));
        let name = entry.and_then(|entry| entry.name.clone()).unwrap_or_else(|| item.name());
        let mut visible = item.visible;
        let about = std::iter::once(summary.to_string()).chain(made::lines(cloud));
        let name = RichText::new(name).strong();
        // One cloud alone is always on show.
        match shown.stock.items().len() == 1 && visible {
            true => ui.label(name),
            false => ui.checkbox(&mut visible, name),
        }
        .on_hover_text(about.collect::<Vec<_>>().join("\n"));
        if visible != item.visible {
            changed = Some(shown.stock.showing(i, visible));
        }
        ui.label(match cloud.len() as u64 {
            0 => "no points".to_owned(),
            1 => "1 surfel".to_owned(),
            n => format!("{} surfels", grouped(n)),
        });
        if item.is_unsaved() {
            let text = if item.recovered { "recovered, not saved" } else { "edited, not saved" };
            ui.colored_label(ui.visuals().warn_fg_color, text)
                .on_hover_text("File > Save cloud as … writes it with all its columns");
        }
        // What was done to the points, as `info` says it.
        let done = [
            (summary.n_dropped - summary.n_too_large, "dropped: not finite"),
            (summary.n_too_large, "dropped: coordinates above 8.5e37"),
            (summary.normals.estimated + summary.normals.repaired, "normals estimated"),
            (summary.radii.estimated, "radii estimated"),
            (summary.radii.clamped, "radii shortened"),
        ];
        for (number, what) in done.into_iter().filter(|(number, _)| *number > 0) {
            ui.weak(format!("{} {what}", grouped(number)));
        }
        for warning in &summary.warnings {
            ui.colored_label(ui.visuals().warn_fg_color, warning);
        }
    }
    let facts = &shown.clouds.facts;
    let size = facts.bounds_max - facts.bounds_min;
    if size.max_element() < 1e6 && size.max_element() > 1e-3 {
        ui.label(format!("size {:.4} x {:.4} x {:.4}", size.x, size.y, size.z));
    } else {
        ui.label(format!("size {:.3e} x {:.3e} x {:.3e}", size.x, size.y, size.z));
    }
    ui.weak(facts.columns.join(", "));
    if let Some(stock) = changed {
        window.restock(stock);
    }
}

/// A number with spaces between groups of three digits.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(' ');
        }
        grouped.push(digit);
    }
    grouped
}

fn renderer(window: &mut Window, ui: &mut Ui) {
    let focused = window.focused;
    let mut chooses = None;
    let Some(pane) = window.settings.pane_mut(focused) else { return };
    for side in 0..pane.mode.sides() {
        let name = pane.renderers[side].clone();
        ui.strong(&name);
        match window.declared.get(&name) {
            Some(declared) => {
                let values = pane.values.entry(name.clone()).or_default();
                let asked = ui.push_id(side, |ui| parameters::show(ui, declared, values)).inner;
                let whose = Whose::Renderer { pane: focused, renderer: name.clone() };
                chooses = asked.map(|parameter| (whose, parameter)).or(chooses);
                let chosen = presets(ui, &name, values, &mut window.preset, &window.memory);
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
            && let Some(pane) = window.panes.get_mut(&focused)
        {
            let full = egui::Slider::new(&mut pane.heat_full, 1.0 / 255.0..=1.0);
            ui.add(full.logarithmic(true).text("brightest at a difference of"));
        }
        let error = window.panes.get(&focused).and_then(|pane| pane.sides[side].error.clone());
        if let Some(error) = error {
            ui.colored_label(ui.visuals().error_fg_color, error);
        }
    }
    if let Some((whose, parameter)) = chooses {
        dialogs::value_dialog(window, ui.ctx(), whose, &parameter);
    }
}

/// Saves the parameters under a name, or takes those of a name: the values to use from now on, or
/// what went wrong in one line.
fn presets(
    ui: &mut Ui,
    renderer: &str,
    values: &Values,
    typed: &mut String,
    memory: &Option<Memory>,
) -> Option<Result<Values, String>> {
    let memory = memory.as_ref()?;
    let mut chosen = None;
    // A click into the name must not close it.
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let button = MenuButton::new(format!("presets of {renderer}")).config(config);
    button.ui(ui, |ui| {
        for name in memory.preset_names(renderer) {
            if ui.button(&name).clicked() {
                let loaded = memory.load_preset(renderer, &name);
                chosen = Some(loaded.map_err(|error| format!("{error:#}")));
                ui.close();
            }
        }
        let label = ui.label("save these as");
        ui.text_edit_singleline(typed).labelled_by(label.id);
        if ui.button("save").clicked() {
            if let Err(error) = memory.save_preset(renderer, typed, values) {
                chosen = Some(Err(format!("{error:#}")));
            }
            ui.close();
        }
    });
    chosen
}

fn camera(window: &mut Window, ui: &mut Ui) {
    let focused = window.focused;
    let mut camera = window.camera_of(focused);
    let before = camera;
    match &mut camera.projection {
        Projection::Perspective { fov_y } => {
            let mut degrees = fov_y.to_degrees();
            let slider = egui::Slider::new(&mut degrees, 5.0..=120.0).suffix(" deg");
            if ui.add(slider.text("field of view")).changed() {
                *fov_y = degrees.to_radians();
            }
        }
        Projection::Orthographic { height } => {
            let speed = 0.01 * *height;
            ui.horizontal(|ui| {
                let value = egui::DragValue::new(height).speed(speed).range(1e-30..=f64::MAX);
                let value = ui.add(value);
                let label = ui.label("visible height, parallel projection");
                value.labelled_by(label.id);
            });
        }
    }
    ui.horizontal(|ui| {
        if ui.button("see everything").clicked() {
            window.frame_all();
        }
        if ui.button("other projection").clicked() {
            super::navigation::toggle_projection(&mut camera, 35f64.to_radians());
        }
    });
    if camera != before {
        window.set_camera(focused, camera);
    }
}

fn picture(window: &mut Window, ui: &mut Ui) {
    let settings = &mut window.settings;
    let exposure = &mut settings.scene.exposure_stops;
    let exposure = egui::Slider::new(exposure, -8.0..=8.0).suffix(" stops");
    ui.add(exposure.text("exposure"));
    ui.horizontal(|ui| {
        ui.label("highlights");
        ui.selectable_value(&mut settings.tone_map, ToneMap::Clamp, "cut off");
        ui.selectable_value(&mut settings.tone_map, ToneMap::Neutral, "compressed");
    });
    let mut colored = matches!(settings.background, Background::Color(_));
    if ui.checkbox(&mut colored, "background of its own colour").changed() {
        settings.background = if colored {
            super::settings::Settings::default().background
        } else {
            Background::Transparent
        };
    }
    if let Background::Color(encoded) = &mut settings.background {
        ui.horizontal(|ui| {
            let label = ui.label("background");
            let mut linear = encoded.map(srgb_to_linear);
            if ui.color_edit_button_rgb(&mut linear).labelled_by(label.id).changed() {
                *encoded = linear.map(linear_to_srgb);
            }
        });
    }
    let camera = window.camera_of(window.focused);
    let (min, max) = window.shown.as_ref().map_or((-DVec3::ONE, DVec3::ONE), |shown| {
        let facts = &shown.clouds.facts;
        (facts.bounds_min, facts.bounds_max)
    });
    let around = Around { scene: ObjectFrame::around(min, max, 1.0), camera };
    let settings = &mut window.settings;
    lights::show(ui, &mut settings.scene.lights, &around);
    if settings.scene.lights.iter().any(|light| !matches!(light, Light::Directional { .. })) {
        ui.checkbox(&mut settings.shows_lamps, "show lamps").on_hover_text(
            "lights with a place are over the picture where the pointer is, to be dragged, and never \
             in saved pictures",
        );
    }
}

fn surface(window: &mut Window, ui: &mut Ui) {
    let surface = &mut window.settings.scene.surface;
    ui.add(
        egui::Slider::new(&mut surface.radius_scale, 0.1..=10.0).logarithmic(true).text("radii x"),
    );
    ui.add(egui::Slider::new(&mut surface.depth_tolerance, 0.0..=16.0).text("depth tolerance"))
        .on_hover_text("surfels so many of their radii behind the nearest one still blend with it");
    ui.add(egui::Slider::new(&mut surface.low_pass, 0.0..=4.0).suffix(" px").text("low-pass"))
        .on_hover_text("surfels are widened by this, so that fine ones neither vanish nor flicker");
    ui.checkbox(&mut surface.two_sided, "draw both sides");
}

fn passes(window: &mut Window, ui: &mut Ui) {
    let Some(pane) = window.panes.get(&window.focused) else { return };
    let n_sides = window.settings.pane(window.focused).map_or(1, |pane| pane.mode.sides());
    for (i, side) in pane.sides.iter().take(n_sides).enumerate() {
        let Some(shown) = &side.shown else { continue };
        let (ms, n_frames) = side.timings.whole().unwrap_or((shown.shot.milliseconds, 1));
        let refined = match shown.shot.n_frames {
            1 => String::new(),
            n => format!(", {n} frames"),
        };
        ui.strong(format!("{}: {ms:.1} ms{refined}", shown.renderer)).on_hover_text(format!(
            "from order to picture, of one frame: medians of the last {n_frames} shown in this detail"
        ));
        egui::Grid::new(("passes", i)).num_columns(2).striped(true).show(ui, |ui| {
            for pass in &shown.shot.passes {
                ui.label(&pass.name);
                match (pass.state, side.timings.pass(&pass.name)) {
                    (PassState::Ran, Some(ms)) => ui.label(format!("{ms:.2} ms")),
                    (PassState::Ran, None) => ui.label("ran"),
                    (PassState::Culled, _) => ui.weak("left out: nobody reads it"),
                    (PassState::Reused, _) => ui.weak("kept from before"),
                };
                ui.end_row();
            }
        });
    }
    ui.weak(format!(
        "on the device: {:.1} MB of columns, those shown lately included; {} uploads, {} pipelines made",
        window.counters.column_bytes as f64 * 1e-6,
        window.counters.uploads,
        window.counters.compiled.pipelines
    ));
}

/// The line at the bottom.
pub(crate) fn status(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(&window.under_pointer);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.weak(&window.adapter);
            // A picture that still gets finer counts as work, so that a still view says when it
            // is the final one.
            if window.works() {
                ui.spinner();
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped_by_three_digits() {
        for (number, expected) in [(0, "0"), (999, "999"), (1000, "1 000"), (1234567, "1 234 567")]
        {
            assert_eq!(grouped(number), expected);
        }
    }
}
