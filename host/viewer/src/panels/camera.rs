//! The panel of the focused view's camera.

use super::row::{row, row_of};
use crate::views::navigation;
use crate::window::Window;
use eframe::egui::{self, Response, Ui};
use surfelshop_api::{Camera, Projection};
use surfelshop_session::options::UpAxis;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let mut camera = window.camera_of(focused);
    let before = camera;
    row_of(ui, "projection", "", |ui, _label| projection(ui, &mut camera));
    match &mut camera.projection {
        Projection::Perspective { fov_y } => {
            let mut degrees = fov_y.to_degrees();
            let slider = egui::Slider::new(&mut degrees, 5.0..=120.0).suffix("°");
            if row(ui, "field of view", "The angle between the upper and the lower edge.", |ui| {
                ui.add(slider)
            })
            .changed()
            {
                *fov_y = degrees.to_radians();
            }
        }
        Projection::Orthographic { height } => {
            let speed = 0.01 * *height;
            let value = egui::DragValue::new(height).speed(speed).range(1e-30..=f64::MAX);
            row(ui, "visible height", "From the lower to the upper edge, scene units.", |ui| {
                ui.add(value)
            });
        }
    }
    row_of(
        ui,
        "up axis",
        "The axis that points upwards; remembered for files of this kind.",
        |ui, _| {
            let is_z = window.document.up == UpAxis::Z;
            let y = ui.selectable_label(!is_z, "y");
            let z = ui.selectable_label(is_z, "z");
            if y.clicked() {
                window.set_up(UpAxis::Y);
            } else if z.clicked() {
                window.set_up(UpAxis::Z);
            }
            y | z
        },
    );
    let turned = window.camera_of(focused) != before;
    ui.horizontal(|ui| {
        if ui.button("see everything").clicked() {
            window.fly_to_all();
        }
        let can_stand = window.can_stand_inside();
        let inside = egui::Button::new("inside");
        let inside = ui.add_enabled(can_stand, inside);
        let inside = inside
            .on_hover_text(
                "Stand where the scan was taken, or in its largest room; W, A, S and D walk.",
            )
            .on_disabled_hover_text(
                "The file does not say where its scanner stood, and no room was found in it.",
            );
        if inside.clicked() {
            window.stand_inside();
        }
    });
    if camera != before && !turned {
        window.set_camera(focused, camera);
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
