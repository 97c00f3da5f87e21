//! The panel of the focused view's camera.

use crate::views::navigation;
use crate::window::Window;
use eframe::egui::{self, Ui};
use surfelshop_api::Projection;

/// Shows the panel.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
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
        if ui.button("other projection").clicked() {
            navigation::toggle_projection(&mut camera, 35f64.to_radians());
        }
    });
    if camera != before {
        window.set_camera(focused, camera);
    }
}
