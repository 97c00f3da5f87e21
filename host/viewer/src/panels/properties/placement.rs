//! Where a cloud stands: moved, turned and scaled in the window, over how its scene places it.

use super::row;
use crate::window::Window;
use eframe::egui::{self, DragValue, Ui, vec2};
use glam::{DQuat, DVec3, EulerRot};
use surfelshop_cloud::{Rotation, Transform};

/// Angles about the axes of the scene, degrees.
fn degrees(rotation: &Rotation) -> DVec3 {
    let radians = match rotation {
        Rotation::Euler(radians) => *radians,
        Rotation::Quaternion(_) => {
            let turn = rotation.quaternion().unwrap_or(DQuat::IDENTITY);
            let (z, y, x) = turn.to_euler(EulerRot::ZYX);
            DVec3::new(x, y, z)
        }
    };
    radians.map(f64::to_degrees)
}

/// Shows the section. A change is made once the pointer lets go: every surfel is moved.
pub(super) fn show(window: &mut Window, ui: &mut Ui, index: usize) {
    let Some(shown) = &window.document.clouds else { return };
    let Some(open_cloud) = shown.open_clouds.all().get(index) else { return };
    if shown.open_clouds.clouds.pyramid_of(&open_cloud.loaded.cloud).is_some() {
        ui.weak("a pyramid stands where its file says");
        return;
    }
    let before = open_cloud.placement();
    let facts = open_cloud.loaded.cloud.facts();
    let reach = (facts.bounds_max - facts.bounds_min).length().max(1e-6);
    let id = ui.scope_id().with(("placement", index));
    let mut typed = ui.data(|data| data.get_temp::<Transform>(id)).unwrap_or(before);
    // What shows as zero has no sign.
    let unsigned = |degrees: f64| if degrees.abs() < 5e-4 { 0.0 } else { degrees };
    let mut angles = degrees(&typed.rotation).map(unsigned);
    let mut changes = false;
    let mut number = |ui: &mut Ui, label: &str, about: &str, drag: DragValue<'_>| {
        row(ui, label, about, |ui| {
            let size = vec2(ui.available_width(), ui.spacing().interact_size.y);
            let response = ui.add_sized(size, drag);
            changes |= response.dragged() || response.has_focus();
            response
        });
    };
    for (axis, moved) in ["x", "y", "z"].into_iter().zip(typed.translation.as_mut()) {
        let drag = DragValue::new(moved).speed(0.002 * reach).max_decimals(6);
        number(ui, &format!("moved along {axis}"), "Scene units.", drag);
    }
    let before_angles = angles;
    for (axis, angle) in ["x", "y", "z"].into_iter().zip(angles.as_mut()) {
        let drag = DragValue::new(angle).speed(0.5).suffix("°").max_decimals(3);
        let about = "Anticlockwise about an axis of the scene: first x, then y, then z.";
        number(ui, &format!("turned about {axis}"), about, drag);
    }
    if angles != before_angles {
        typed.rotation = Rotation::Euler(angles.map(f64::to_radians));
    }
    let drag = DragValue::new(&mut typed.scale).speed(0.005).range(1e-9..=1e9);
    number(ui, "scaled by", "A factor on all lengths, radii included.", drag);
    if ui.add_enabled(typed != Transform::default(), egui::Button::new("put back")).clicked() {
        (typed, changes) = (Transform::default(), false);
    }
    if changes {
        ui.data_mut(|data| data.insert_temp(id, typed));
        return;
    }
    ui.data_mut(|data| data.remove::<Transform>(id));
    if typed == before {
        return;
    }
    match shown.open_clouds.placed(index, &typed) {
        Ok(placed) => window.show_clouds(placed),
        Err(error) => {
            let line = format!("{}: it was not moved: {error}", open_cloud.name());
            window.messages.warn(line);
        }
    }
}
