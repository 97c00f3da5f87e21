//! The camera of the focused view.

use super::{Scale, axes, command_button, row, row_of, slider_row};
use crate::document::PaneSettings;
use crate::views::{CameraMode, navigation};
use crate::window::Window;
use eframe::egui::{self, Response, Ui, vec2};
use surfelshop_api::{Camera, Projection};

/// Shows the camera.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let mut camera = window.camera_of(focused);
    let before = camera;
    mode(window, ui);
    row_of(ui, "projection", "", |ui, _label| projection(ui, &mut camera));
    match &mut camera.projection {
        Projection::Perspective { fov_y } => {
            let mut degrees = fov_y.to_degrees();
            let scale = Scale::linear(5.0..=120.0, "°");
            let about = "The angle between the upper and the lower edge.";
            if slider_row(ui, "field of view", about, &mut degrees, &scale).changed() {
                *fov_y = degrees.to_radians();
            }
        }
        Projection::Orthographic { height } => {
            let speed = 0.01 * *height;
            let value = egui::DragValue::new(height).speed(speed).range(1e-30..=f64::MAX);
            let about = "From the lower to the upper edge, scene units.";
            row(ui, "visible height", about, |ui| {
                ui.add_sized(vec2(ui.available_width(), 22.0), value)
            });
        }
    }
    up_axis(window, ui);
    place(ui, &mut camera);
    let turned = window.camera_of(focused) != before;
    if camera != before && !turned {
        window.set_camera(focused, camera);
    }
    linked(window, ui);
    ui.horizontal_wrapped(|ui| {
        command_button(window, ui, "frame-all", "see everything");
        command_button(window, ui, "inside", "inside");
        command_button(window, ui, "remember-camera", "remember");
    });
}

/// How the mouse moves it.
fn mode(window: &mut Window, ui: &mut Ui) {
    let now = window.camera_mode();
    row_of(ui, "mouse", "How a drag moves the camera.", |ui, _label| {
        let mut all: Option<Response> = None;
        let shown = ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0;
            for mode in CameraMode::ALL {
                let one = ui.selectable_label(mode == now, mode.name()).on_hover_text(mode.hint());
                if one.clicked() {
                    window.set_camera_mode(mode);
                }
                all = Some(all.take().map_or_else(|| one.clone(), |all| all | one.clone()));
            }
        });
        all.unwrap_or(shown.response)
    });
}

fn up_axis(window: &mut Window, ui: &mut Ui) {
    let about = "The axis that points upwards; remembered for files of this kind.";
    row_of(ui, "up axis", about, |ui, _| {
        let mut axis = window.document.up.axis();
        let shown = axes(ui, &mut axis);
        window.set_up(axis.into());
        shown
    });
}

/// Where it stands and what it turns about, in numbers.
fn place(ui: &mut Ui, camera: &mut Camera) {
    let speed = 0.005 * camera.eye.distance(camera.target).max(1e-6);
    let (mut eye, mut target) = (camera.eye, camera.target);
    for (label, about, place) in [
        ("stands at", "Its place, scene units: x, y, z.", &mut eye),
        ("looks at", "What it turns about, scene units: x, y, z.", &mut target),
    ] {
        for (axis, number) in ["x", "y", "z"].into_iter().zip(place.as_mut()) {
            row(ui, &format!("{label} {axis}"), about, |ui| {
                let size = vec2(ui.available_width(), ui.spacing().interact_size.y);
                ui.add_sized(size, egui::DragValue::new(number).speed(speed).max_decimals(4))
            });
        }
    }
    // One that stands where it looks sees nothing.
    if eye.distance(target) > 0.0 && eye.is_finite() && target.is_finite() {
        (camera.eye, camera.target) = (eye, target);
    }
}

/// Whether the view's camera is that of the other views.
fn linked(window: &mut Window, ui: &mut Ui) {
    if window.settings.panes.len() < 2 {
        return;
    }
    let focused = window.views.focused;
    if let Some(PaneSettings { linked, .. }) = window.settings.pane_mut(focused) {
        let about = "It moves together with the cameras of the other linked views.";
        super::check_row(ui, "linked", about, linked);
    }
}

/// The choice of the projection.
fn projection(ui: &mut Ui, camera: &mut Camera) -> Response {
    let is_perspective = matches!(camera.projection, Projection::Perspective { .. });
    let perspective = ui.selectable_label(is_perspective, "perspective");
    let orthographic = ui.selectable_label(!is_perspective, "orthographic");
    let changes = match is_perspective {
        true => orthographic.clicked(),
        false => perspective.clicked(),
    };
    if changes {
        navigation::toggle_projection(camera, navigation::USUAL_FIELD_OF_VIEW);
    }
    perspective | orthographic
}
