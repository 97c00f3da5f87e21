//! The panels of light, exposure, background and surface.

use super::background;
use super::lights::{self, LightContext};
use super::row::{row, row_of};
use crate::window::Window;
use eframe::egui::{self, Ui};
use glam::DVec3;
use surfelshop_api::SurfaceSettings;
use surfelshop_api::columns::PLANARITY;
use surfelshop_api::{Light, ObjectFrame};
use surfelshop_cloud::display::Look;
use surfelshop_cloud::scene::{
    DEPTH_TOLERANCE, EyeDomeLighting, EyeDomeUse, LOW_PASS, PLANARITIES,
};
use surfelshop_image::display::ToneMap;

/// Shows the panel of light and picture.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let settings = &mut window.settings;
    let exposure = &mut settings.scene.exposure_stops;
    let exposure = egui::Slider::new(exposure, -8.0..=8.0).suffix(" EV");
    row(ui, "exposure", "A factor of two for each stop (EV).", |ui| ui.add(exposure));
    row_of(ui, "tone mapping", "", |ui, _label| {
        let none = ui.selectable_value(&mut settings.tone_map, ToneMap::Clamp, "none");
        let none = none.on_hover_text("What is brighter than white is white.");
        let neutral = ui.selectable_value(&mut settings.tone_map, ToneMap::Neutral, "neutral");
        none | neutral.on_hover_text("Khronos PBR Neutral: highlights are compressed.")
    });
    antialiasing(&mut settings.antialias, ui);
    eye_dome(&mut settings.eye_dome, ui);
    background::show(window, ui);
    let camera = window.camera_of(window.views.focused);
    let (min, max) = window.document.clouds.as_ref().map_or((-DVec3::ONE, DVec3::ONE), |shown| {
        let facts = &shown.clouds.facts;
        (facts.bounds_min, facts.bounds_max)
    });
    let scene = ObjectFrame::around(min, max, 1.0);
    let around = LightContext { scene, bounds: [min, max], camera };
    let settings = &mut window.settings;
    lights::show(ui, &mut settings.scene.lights, &around);
    if settings.scene.lights.iter().any(|light| !matches!(light, Light::Directional { .. })) {
        ui.checkbox(&mut settings.shows_light_handles, "show lights").on_hover_text(
            "Lights with a place are over the picture where the pointer is, to be dragged, and never \
             in saved pictures.",
        );
    }
}

/// Of how many pictures a view at rest is the mean.
fn antialiasing(antialias: &mut u32, ui: &mut Ui) {
    let about = "At rest, edges become smooth: so many pictures are drawn, each seen at another place of every \
                 pixel, and their mean is shown.";
    row_of(ui, "antialiasing", about, |ui, label| {
        let mut choices = vec![1, 16, 32];
        if !choices.contains(antialias) {
            choices.push(*antialias);
        }
        let mut all: Option<egui::Response> = None;
        for n in choices {
            let text = if n == 1 { "off".to_owned() } else { n.to_string() };
            let one = ui.selectable_value(antialias, n, text);
            all = Some(all.map_or_else(|| one.clone(), |all| all | one.clone()));
        }
        all.unwrap_or_else(|| ui.label("")).labelled_by(label)
    });
}

/// Shows the panel of the surface.
pub(super) fn show_surface(window: &mut Window, ui: &mut Ui) {
    look(window, ui);
    let is_surface = window.settings.splats.look == Look::Surface;
    let surface = &mut window.settings.scene.surface;
    if is_surface {
        let size = egui::Slider::new(&mut surface.radius_scale, 0.1..=10.0);
        let size = size.logarithmic(true).suffix(" x");
        row(ui, "point size", "A factor on the radii of all surfels.", |ui| ui.add(size));
    }
    let slider = egui::Slider::new(&mut surface.depth_tolerance, DEPTH_TOLERANCE.slider());
    let about = "Surfels so many of their radii behind the nearest one still blend with it.";
    row(ui, "depth tolerance", about, |ui| ui.add(slider.suffix(" radii")));
    if is_surface {
        let slider = egui::Slider::new(&mut surface.low_pass, LOW_PASS.slider()).suffix(" px");
        let about = "Surfels are widened by this low-pass filter, so that fine ones neither vanish nor flicker.";
        row(ui, "least size", about, |ui| ui.add(slider));
    }
    ui.checkbox(&mut surface.two_sided, "draw both sides");
}

/// The width of points where they are first chosen, pixels.
const POINT_WIDTH: f32 = 3.0;

/// How surfels look: as a surface or as points.
fn look(window: &mut Window, ui: &mut Ui) {
    let shown = window.document.clouds.as_ref();
    let (columns, reach) = shown.map_or((&[][..], 1.0), |shown| {
        let facts = &shown.open_clouds.clouds.facts;
        (&facts.columns[..], (facts.bounds_max - facts.bounds_min).length().max(1e-30))
    });
    let has_planarity = columns.iter().any(|name| name == PLANARITY);
    let surface = &mut window.settings.scene.surface;
    let splats = &mut window.settings.splats;
    let was = splats.look;
    row_of(ui, "draw as", "", |ui, _label| {
        let is_surface = splats.look == Look::Surface;
        let discs = ui.selectable_label(is_surface, "surface");
        if discs.clicked() {
            splats.look = Look::Surface;
        }
        let points = ui.selectable_label(!is_surface, "points");
        let points = points.on_hover_text("Round splats of one size.");
        if points.clicked() && is_surface {
            splats.look = Look::Points { radius: 0.0 };
        }
        discs | points
    });
    let usual = SurfaceSettings::default().low_pass;
    match splats.look {
        Look::Points { .. } => {
            if was == Look::Surface {
                surface.low_pass = 0.5 * POINT_WIDTH;
            }
            let mut width = 2.0 * surface.low_pass;
            let slider = egui::Slider::new(&mut width, 0.5..=8.0).suffix(" px");
            if row(ui, "point size", "The width of each point.", |ui| ui.add(slider)).changed() {
                surface.low_pass = 0.5 * width;
            }
        }
        Look::Surface => {
            if was != Look::Surface {
                surface.low_pass = usual;
            }
            if has_planarity {
                let slider = egui::Slider::new(&mut splats.round_below, PLANARITIES.slider());
                let about = "Surfels whose surroundings are less flat than this planarity are round \
                             splats that face the eye.";
                row(ui, "round below", about, |ui| ui.add(slider));
            }
            let mut limits = splats.largest_radius.is_some();
            ui.horizontal(|ui| {
                if ui.checkbox(&mut limits, "largest radius").changed() {
                    splats.largest_radius = limits.then_some((0.01 * reach) as f32);
                }
                if let Some(largest) = &mut splats.largest_radius {
                    let drag = egui::DragValue::new(largest).speed(1e-4 * reach);
                    ui.add(drag.range(1e-6 * reach..=reach));
                }
            });
        }
    }
}

/// What is darkened for lying behind something.
fn eye_dome(lighting: &mut EyeDomeLighting, ui: &mut Ui) {
    let about = "Eye-dome lighting: what lies behind something near it on the screen is darker, which shows shapes \
                 without normals. Automatic: where many surfels are points.";
    row_of(ui, "depth cue", about, |ui, _label| {
        let choices = [
            (EyeDomeUse::Automatic, "automatic"),
            (EyeDomeUse::Off, "off"),
            (EyeDomeUse::On, "on"),
        ];
        let choice = |(when, text)| ui.selectable_value(&mut lighting.when, when, text);
        let all = choices.map(choice).into_iter().reduce(|all, one| all | one);
        all.unwrap_or_else(|| ui.label(""))
    });
    if lighting.when == EyeDomeUse::Off {
        return;
    }
    let strength = egui::Slider::new(&mut lighting.strength, 0.0..=4.0);
    row(ui, "strength", "How dark it becomes; 1 is usual.", |ui| ui.add(strength));
    let radius = egui::Slider::new(&mut lighting.radius, 1.0..=8.0).suffix(" px");
    let about = "How far on the screen what is nearer darkens what is behind it.";
    row(ui, "radius", about, |ui| ui.add(radius));
}
