//! The rows of the scene's lights: kind, position, brightness, and their number.

use super::row::{row, row_of};
use crate::document::has_direction;
use eframe::egui::{self, SliderClamping, Ui};
use glam::{DVec3, Vec3};
use surfelshop_api::{Camera, Light, ObjectFrame, Scene};
use surfelshop_cloud::scene::{DEFAULT_SPOT_DEG, DEFAULT_SPOT_SOFTNESS};
use surfelshop_session::input::plausibility;

/// What a change of a light's kind depends on.
pub(super) struct LightContext {
    /// The box around all clouds.
    pub(super) scene: ObjectFrame,
    /// Its corners.
    pub(super) bounds: [DVec3; 2],
    pub(super) camera: Camera,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Directional,
    Point,
    Spot,
}

impl Kind {
    const ALL: [Self; 3] = [Self::Directional, Self::Point, Self::Spot];

    fn of(light: &Light) -> Self {
        match light {
            Light::Directional { .. } => Self::Directional,
            Light::Point { .. } => Self::Point,
            Light::Spot { .. } => Self::Spot,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Directional => "directional",
            Self::Point => "point",
            Self::Spot => "spot",
        }
    }
}

/// A change of the list.
enum Change {
    Insert(usize, Light),
    Remove(usize),
}

/// Shows the rows of each light.
pub(super) fn show(ui: &mut Ui, lights: &mut Vec<Light>, context: &LightContext) {
    let mut change = None;
    let full = lights.len() >= Scene::MAX_LIGHTS;
    for (i, light) in lights.iter_mut().enumerate() {
        let before = *light;
        ui.push_id(("light", i), |ui| {
            row_of(ui, &format!("light {}", i + 1), "", |ui, _label| {
                let (response, changed) = kind(ui, i, light, context, full);
                change = changed.or(change.take());
                response
            });
            place_row(ui, light);
            other_rows(ui, light, context);
            if let Some(line) = plausibility::unsuited(light, context.bounds) {
                ui.colored_label(ui.visuals().warn_fg_color, line);
            }
        });
        if !has_direction(light) {
            *light = before;
        }
    }
    if lights.is_empty() && ui.button("add a light").clicked() {
        change = Scene::default().lights.first().map(|usual| Change::Insert(0, *usual));
    }
    match change {
        Some(Change::Insert(i, light)) => lights.insert(i, light),
        Some(Change::Remove(i)) => drop(lights.remove(i)),
        None => {}
    }
}

/// The direction or position of a light.
fn place_row(ui: &mut Ui, light: &mut Light) {
    match light {
        Light::Directional { towards, .. } => {
            vector(ui, "direction", "Towards the light.", towards, 0.01);
        }
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let speed = 0.01 * position.abs().max_element().max(1e-3);
            vector(ui, "position", "Where the light is.", position, speed);
        }
    }
}

fn vector(ui: &mut Ui, label: &str, about: &str, vector: &mut DVec3, speed: f64) {
    row_of(ui, label, about, |ui, label| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let mut number = |axis: &mut f64| {
            ui.add(egui::DragValue::new(axis).speed(speed).max_decimals(3)).labelled_by(label)
        };
        let x = number(&mut vector.x);
        x | number(&mut vector.y) | number(&mut vector.z)
    });
}

/// The choice of a light's kind, with entries that copy or remove the light.
fn kind(
    ui: &mut Ui,
    i: usize,
    light: &mut Light,
    context: &LightContext,
    full: bool,
) -> (egui::Response, Option<Change>) {
    let mut chosen = Kind::of(light);
    let mut change = None;
    let combo = egui::ComboBox::from_id_salt("kind").selected_text(chosen.name());
    let shown = combo.show_ui(ui, |ui| {
        for kind in Kind::ALL {
            ui.selectable_value(&mut chosen, kind, kind.name());
        }
        ui.separator();
        if ui.add_enabled(!full, egui::Button::selectable(false, "another like it")).clicked() {
            change = Some(Change::Insert(i + 1, *light));
        }
        if ui.selectable_label(false, "remove it").clicked() {
            change = Some(Change::Remove(i));
        }
    });
    shown.response.widget_info(|| {
        let name = format!("kind of light {}", i + 1);
        egui::WidgetInfo::labeled(egui::Role::ComboBox, true, name)
    });
    if chosen != Kind::of(light) {
        *light = convert(light, chosen, context);
    }
    (shown.response, change)
}

fn other_rows(ui: &mut Ui, light: &mut Light, context: &LightContext) {
    // As bright as a radiance of 8 from a distance of the scene's size.
    let most = 8.0 * (context.scene.size * context.scene.size) as f32;
    match light {
        Light::Directional { radiance, follows_camera, .. } => {
            power(ui, radiance, 8.0, "radiance");
            row_of(ui, "", "", |ui, _label| ui.checkbox(follows_camera, "follows camera"));
        }
        Light::Point { intensity, .. } => power(ui, intensity, most, "intensity"),
        Light::Spot { target, intensity, angle, softness, .. } => {
            vector(ui, "turned to", "A point on its axis.", target, 0.01 * context.scene.size);
            power(ui, intensity, most, "intensity");
            let mut degrees = angle.to_degrees();
            let slider = egui::Slider::new(&mut degrees, 0.0..=180.0).suffix("°");
            if row(ui, "axis to edge", "Half the angle of the cone.", |ui| ui.add(slider)).changed()
            {
                *angle = degrees.to_radians();
            }
            let slider = egui::Slider::new(softness, 0.0..=1.0);
            row(ui, "softness", "The share of the cone in which it fades.", |ui| ui.add(slider));
        }
    }
}

/// The largest channel of a light, which keeps its colour; a value above `most` stays until it is
/// changed.
fn power(ui: &mut Ui, color: &mut Vec3, most: f32, what: &str) {
    let mut power = color.max_element();
    let slider = egui::Slider::new(&mut power, 0.0..=most).clamping(SliderClamping::Edits);
    if row(ui, what, "", |ui| ui.add(slider)).changed() {
        let white =
            if color.max_element() > 0.0 { *color / color.max_element() } else { Vec3::ONE };
        *color = white * power;
    }
}

/// A light of another kind at the same position, as bright at the scene's centre. A directional light
/// gets a position as far from the centre as the scene is large. A spot is aimed at the centre, or
/// downwards where it is at the centre.
fn convert(light: &Light, kind: Kind, context: &LightContext) -> Light {
    let LightContext { scene: ObjectFrame { center, size, .. }, camera, .. } = *context;
    let (position, intensity) = match *light {
        Light::Directional { towards, radiance, follows_camera } => {
            let world_from_view = camera.view_from_world().transpose();
            let world = if follows_camera { world_from_view * towards } else { towards };
            let position = center + size * world.try_normalize().unwrap_or(DVec3::Y);
            (position, (radiance.as_dvec3() * (size * size)).as_vec3())
        }
        Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
            (position, intensity)
        }
    };
    let offset = position - center;
    match kind {
        Kind::Point => Light::Point { position, intensity },
        Kind::Spot => {
            let aims = offset.try_normalize().is_some();
            let target = if aims { center } else { position - DVec3::Y * size };
            let (angle, softness) = (DEFAULT_SPOT_DEG.to_radians(), DEFAULT_SPOT_SOFTNESS);
            Light::Spot { position, target, intensity, angle, softness }
        }
        Kind::Directional => {
            let (towards, distance) = (offset.try_normalize(), offset.length());
            let radiance = match towards {
                Some(_) => (intensity.as_dvec3() / (distance * distance)).as_vec3(),
                None => Vec3::ONE,
            };
            let towards = towards.unwrap_or(DVec3::Y);
            Light::Directional { towards, radiance, follows_camera: false }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::{CloudFacts, Lamp, Projection, View};

    #[test]
    fn a_light_of_another_kind_is_as_bright_in_the_middle() {
        let projection = Projection::Perspective { fov_y: 0.8 };
        let up = DVec3::Y;
        let camera = Camera { eye: DVec3::X, target: DVec3::ZERO, up, projection };
        let center = DVec3::new(1.0, 2.0, 3.0);
        let context = LightContext {
            scene: ObjectFrame { center, size: 4.0, ..Default::default() },
            bounds: [-DVec3::ONE, DVec3::ONE],
            camera,
        };
        let view = View { camera, size_px: [1; 2], near: 0.1, far: 10.0 };
        let facts =
            CloudFacts { bounds_min: center - 2.0, bounds_max: center + 2.0, ..Default::default() };
        let in_the_middle = |light: &Light| Lamp::new(light, &view, &facts).arriving(center);
        for follows_camera in [false, true] {
            let (towards, radiance) = (DVec3::new(0.3, 0.4, 0.5), Vec3::new(0.5, 0.25, 2.0));
            let first = Light::Directional { towards, radiance, follows_camera };
            let expected = in_the_middle(&first);
            let mut light = first;
            for kind in [Kind::Point, Kind::Spot, Kind::Directional, Kind::Spot, Kind::Point] {
                light = convert(&light, kind, &context);
                assert!(Kind::of(&light) == kind);
                let found = in_the_middle(&light);
                // Radiance and intensity are f32.
                let off = (found.radiance / expected.radiance - 1.0).abs().max_element();
                assert!(off < 1e-6, "{light:?}: {found:?} for {expected:?}");
                assert!(found.towards.distance(expected.towards) < 1e-12, "{light:?}");
            }
        }
        // A light at the centre itself.
        let intensity = Vec3::ONE;
        let light = convert(&Light::Point { position: center, intensity }, Kind::Spot, &context);
        assert!(matches!(light, Light::Spot { target, .. } if target.y < center.y));
        let light = convert(&light, Kind::Directional, &context);
        assert!(matches!(light, Light::Directional { radiance: Vec3::ONE, .. }));
    }
}
