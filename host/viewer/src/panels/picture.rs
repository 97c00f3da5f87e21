//! The panels of light, exposure, background and surface.

use super::lights::{self, LightContext};
use crate::document::Settings;
use crate::window::Window;
use eframe::egui::{self, Ui};
use glam::DVec3;
use surfelshop_api::SurfaceSettings;
use surfelshop_api::columns::PLANARITY;
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};
use surfelshop_api::{Light, ObjectFrame};
use surfelshop_cloud::display::Look;
use surfelshop_cloud::scene::{DEPTH_TOLERANCE, LOW_PASS, PLANARITIES};
use surfelshop_image::display::{Background, ToneMap};

/// Shows the panel of light and picture.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let settings = &mut window.settings;
    let exposure = &mut settings.scene.exposure_stops;
    let exposure = egui::Slider::new(exposure, -8.0..=8.0).suffix(" stops");
    ui.add(exposure.text("exposure"));
    ui.horizontal(|ui| {
        ui.label("highlights");
        ui.selectable_value(&mut settings.tone_map, ToneMap::Clamp, "cut off");
        ui.selectable_value(&mut settings.tone_map, ToneMap::Neutral, "compressed");
    });
    antialiasing(&mut settings.antialias, ui);
    let mut colored = matches!(settings.background, Background::Color(_));
    if ui.checkbox(&mut colored, "background of its own colour").changed() {
        settings.background =
            if colored { Settings::default().background } else { Background::Transparent };
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
            "lights with a place are over the picture where the pointer is, to be dragged, and never \
             in saved pictures",
        );
    }
}

/// Of how many pictures a view at rest is the mean.
fn antialiasing(antialias: &mut u32, ui: &mut Ui) {
    let about = "at rest, edges become smooth: so many pictures are drawn, each seen at another place of every \
                 pixel, and their mean is shown";
    ui.horizontal(|ui| {
        ui.label("antialiasing").on_hover_text(about);
        let mut choices = vec![1, 16, 32];
        if !choices.contains(antialias) {
            choices.push(*antialias);
        }
        for n in choices {
            let text = if n == 1 { "off".to_owned() } else { n.to_string() };
            ui.selectable_value(antialias, n, text).on_hover_text(about);
        }
    });
}

/// Shows the panel of the surface.
pub(super) fn show_surface(window: &mut Window, ui: &mut Ui) {
    look(window, ui);
    let surface = &mut window.settings.scene.surface;
    ui.add(
        egui::Slider::new(&mut surface.radius_scale, 0.1..=10.0).logarithmic(true).text("radii x"),
    );
    ui.add(
        egui::Slider::new(&mut surface.depth_tolerance, DEPTH_TOLERANCE.slider())
            .text("depth tolerance"),
    )
    .on_hover_text("surfels so many of their radii behind the nearest one still blend with it");
    ui.add(
        egui::Slider::new(&mut surface.low_pass, LOW_PASS.slider()).suffix(" px").text("low-pass"),
    )
    .on_hover_text("surfels are widened by this, so that fine ones neither vanish nor flicker");
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
    ui.horizontal(|ui| {
        ui.label("surfels as");
        let is_surface = splats.look == Look::Surface;
        if ui.selectable_label(is_surface, "surface").clicked() {
            splats.look = Look::Surface;
        }
        let points = ui.selectable_label(!is_surface, "points");
        if points.on_hover_text("round splats of one size").clicked() && is_surface {
            splats.look = Look::Points { radius: 0.0 };
        }
    });
    let usual = SurfaceSettings::default().low_pass;
    match splats.look {
        Look::Points { .. } => {
            if was == Look::Surface {
                surface.low_pass = 0.5 * POINT_WIDTH;
            }
            let mut width = 2.0 * surface.low_pass;
            let slider = egui::Slider::new(&mut width, 0.5..=8.0).suffix(" px").text("point width");
            if ui.add(slider).changed() {
                surface.low_pass = 0.5 * width;
            }
        }
        Look::Surface => {
            if was != Look::Surface {
                surface.low_pass = usual;
            }
            if has_planarity {
                ui.add(
                    egui::Slider::new(&mut splats.round_below, PLANARITIES.slider())
                        .text("round below planarity"),
                )
                .on_hover_text(
                    "surfels whose surroundings are less flat than this are round splats that face the eye",
                );
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
