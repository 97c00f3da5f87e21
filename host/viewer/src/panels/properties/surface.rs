//! How surfels become a surface.

use super::{Scale, check_row, row_of, slider_row};
use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_api::SurfaceSettings;
use surfelshop_api::columns::PLANARITY;
use surfelshop_cloud::display::Look;
use surfelshop_cloud::scene::{DEPTH_TOLERANCE, LOW_PASS, PLANARITIES};

/// Shows the section.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    look(window, ui);
    let is_surface = window.settings.splats.look == Look::Surface;
    let surface = &mut window.settings.scene.surface;
    if is_surface {
        let scale = Scale::logarithmic(0.1..=10.0, " x");
        let about = "A factor on the radii of all surfels.";
        slider_row(ui, "point size", about, &mut surface.radius_scale, &scale);
    }
    let range = DEPTH_TOLERANCE.slider();
    let scale = Scale::linear(f64::from(*range.start())..=f64::from(*range.end()), " radii");
    let about = "Surfels so many of their radii behind the nearest one still blend with it.";
    slider_row(ui, "depth tolerance", about, &mut surface.depth_tolerance, &scale);
    if is_surface {
        let range = LOW_PASS.slider();
        let scale = Scale::linear(f64::from(*range.start())..=f64::from(*range.end()), " px");
        let about = "Surfels are widened by this low-pass filter, so that fine ones neither vanish nor flicker.";
        slider_row(ui, "least size", about, &mut surface.low_pass, &scale);
    }
    let about =
        "Surfels are seen from behind, too; without it only where their normals point at the eye.";
    check_row(ui, "draw both sides", about, &mut surface.two_sided);
    let about = "Surfels that are seen from behind are magenta: shows where normals face.";
    check_row(ui, "tint backs", about, &mut window.settings.splats.tint_backs);
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
            let scale = Scale::linear(0.5..=8.0, " px");
            let about = "The width of each point.";
            if slider_row(ui, "point size", about, &mut width, &scale).changed() {
                surface.low_pass = 0.5 * width;
            }
        }
        Look::Surface => {
            if was != Look::Surface {
                surface.low_pass = usual;
            }
            if has_planarity {
                let range = PLANARITIES.slider();
                let scale = Scale::linear(f64::from(*range.start())..=f64::from(*range.end()), "");
                let about = "Surfels whose surroundings are less flat than this planarity are round \
                             splats that face the eye.";
                slider_row(ui, "least planarity", about, &mut splats.round_below, &scale);
            }
            let mut limits = splats.largest_radius.is_some();
            let about = "Larger surfels are drawn with this radius, scene units.";
            row_of(ui, "largest radius", about, |ui, label| {
                let limited = ui.checkbox(&mut limits, "").labelled_by(label);
                if limited.changed() {
                    splats.largest_radius = limits.then_some((0.01 * reach) as f32);
                }
                match &mut splats.largest_radius {
                    Some(largest) => {
                        let drag = egui::DragValue::new(largest).speed(1e-4 * reach);
                        limited | ui.add(drag.range(1e-6 * reach..=reach)).labelled_by(label)
                    }
                    None => limited,
                }
            });
        }
    }
}
