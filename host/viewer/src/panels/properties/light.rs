//! The properties of a light: kind, place, colour and brightness.

use super::{Scale, check_row, command_button, row, row_of, slider_row};
use crate::document::has_direction;
use crate::panels::Selection;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::{self, Label, RichText, Ui, vec2};
use glam::{DVec3, Vec3};
use surfelshop_api::{Camera, Light, ObjectFrame};
use surfelshop_cloud::scene::{DEFAULT_SPOT_DEG, DEFAULT_SPOT_SOFTNESS};
use surfelshop_session::input::plausibility;

/// What a change of a light's kind depends on.
struct LightContext {
    /// The box around all clouds.
    scene: ObjectFrame,
    /// Its corners.
    bounds: [DVec3; 2],
    camera: Camera,
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

/// The icon and the kind of a light.
pub(in crate::panels) fn light_name(light: &Light) -> (Icon, &'static str) {
    let icon = match light {
        Light::Directional { .. } => Icon::Sun,
        Light::Point { .. } => Icon::Lightbulb,
        Light::Spot { .. } => Icon::LampDesk,
    };
    (icon, Kind::of(light).name())
}

/// Shows a light of the scene, or one that is switched off.
pub(super) fn show(window: &mut Window, ui: &mut Ui, selection: Selection) {
    let camera = window.camera_of(window.views.focused);
    let (min, max) = window.document.clouds.as_ref().map_or((-DVec3::ONE, DVec3::ONE), |shown| {
        let facts = &shown.clouds.facts;
        (facts.bounds_min, facts.bounds_max)
    });
    let scene = ObjectFrame::around(min, max, 1.0);
    let context = LightContext { scene, bounds: [min, max], camera };
    let name = window.name_of(selection);
    let settings = &mut window.settings;
    let light = match selection {
        Selection::Light(i) => settings.scene.lights.get_mut(i),
        Selection::LightOff(i) => settings.lights_off.get_mut(i),
        _ => None,
    };
    let Some(light) = light else { return };
    let before = *light;
    let is_placed = !matches!(light, Light::Directional { .. });
    rows(ui, light, &name, &context);
    if !has_direction(light) {
        *light = before;
    }
    if is_placed {
        let about = "Lights that have a place are over the picture where the pointer is, to be \
                     dragged, and never in saved pictures.";
        check_row(ui, "show lights", about, &mut window.settings.shows_light_handles);
    }
    let is_on = matches!(selection, Selection::Light(_));
    ui.horizontal_wrapped(|ui| {
        command_button(
            window,
            ui,
            "toggle-selected",
            if is_on { "switch off" } else { "switch on" },
        );
        command_button(window, ui, "duplicate-selected", "duplicate");
        command_button(window, ui, "add-light", "add");
        command_button(window, ui, "remove-selected", "remove");
    });
}

fn rows(ui: &mut Ui, light: &mut Light, name: &str, context: &LightContext) {
    kind(ui, light, name, context);
    place_row(ui, light);
    color(ui, light);
    other_rows(ui, light, context);
    if let Some(line) = plausibility::unsuited(light, context.bounds) {
        let text = RichText::new(line).color(ui.visuals().warn_fg_color);
        ui.add(Label::new(text).wrap());
    }
}

/// The direction or position of a light.
fn place_row(ui: &mut Ui, light: &mut Light) {
    match light {
        Light::Directional { towards, follows_camera, .. } => {
            let about = match follows_camera {
                true => "Towards the light, seen from the camera: right, up and backward.",
                false => "Towards the light, along x, y and z.",
            };
            vector(ui, "direction", about, towards, 0.01);
        }
        Light::Point { position, .. } | Light::Spot { position, .. } => {
            let speed = 0.01 * position.abs().max_element().max(1e-3);
            vector(ui, "position", "Where the light is, scene units.", position, speed);
        }
    }
}

/// Three numbers, each after the name of its axis.
fn vector(ui: &mut Ui, label: &str, about: &str, vector: &mut DVec3, speed: f64) {
    for (axis, number) in ["x", "y", "z"].into_iter().zip(vector.as_mut()) {
        row(ui, &format!("{label} {axis}"), about, |ui| {
            let size = vec2(ui.available_width(), ui.spacing().interact_size.y);
            ui.add_sized(size, egui::DragValue::new(number).speed(speed).max_decimals(4))
        });
    }
}

/// The choice of a light's kind.
fn kind(ui: &mut Ui, light: &mut Light, name: &str, context: &LightContext) {
    let mut chosen = Kind::of(light);
    row_of(
        ui,
        "kind",
        "From one direction, from a place, or from a place within a cone.",
        |ui, _| {
            let combo = egui::ComboBox::from_id_salt("kind").selected_text(chosen.name());
            let shown = combo.show_ui(ui, |ui| {
                for kind in Kind::ALL {
                    ui.selectable_value(&mut chosen, kind, kind.name());
                }
            });
            shown.response.widget_info(|| {
                let name = format!("kind of {name}");
                egui::WidgetInfo::labeled(egui::Role::ComboBox, true, name)
            });
            shown.response
        },
    );
    if chosen != Kind::of(light) {
        *light = convert(light, chosen, context);
    }
}

/// The hue of a light: its brightness stays.
fn color(ui: &mut Ui, light: &mut Light) {
    let (Light::Directional { radiance: power, .. }
    | Light::Point { intensity: power, .. }
    | Light::Spot { intensity: power, .. }) = light;
    let most = power.max_element();
    let mut linear = if most > 0.0 { (*power / most).to_array() } else { [1.0; 3] };
    row(ui, "colour", "Its hue: the brightness stays as it is.", |ui| {
        let response = ui.color_edit_button_rgb(&mut linear);
        if response.changed() {
            let hue = Vec3::from(linear);
            if hue.is_finite() && hue.max_element() > 0.0 {
                *power = hue / hue.max_element() * most;
            }
        }
        response
    });
}

fn other_rows(ui: &mut Ui, light: &mut Light, context: &LightContext) {
    // As bright as a radiance of 8 from a distance of the scene's size.
    let most = 8.0 * context.scene.size * context.scene.size;
    match light {
        Light::Directional { radiance, follows_camera, .. } => {
            power(ui, radiance, 8.0, "brightness");
            check_row(ui, "follows camera", "A headlight.", follows_camera);
        }
        Light::Point { intensity, .. } => power(ui, intensity, most, "brightness"),
        Light::Spot { target, intensity, angle, softness, .. } => {
            power(ui, intensity, most, "brightness");
            let speed = 0.01 * context.scene.size;
            vector(ui, "target", "A point on its axis, scene units.", target, speed);
            let mut degrees = angle.to_degrees();
            let scale = Scale::linear(0.0..=180.0, "°");
            let about = "The angle between its axis and the edge of its cone.";
            if slider_row(ui, "half angle", about, &mut degrees, &scale).changed() {
                *angle = degrees.to_radians();
            }
            let about = "The share of the cone in which it fades.";
            slider_row(ui, "softness", about, softness, &Scale::linear(0.0..=1.0, ""));
        }
    }
}

/// The brightest that can be typed: what adds up, and its square, stays finite in f32 by far.
const BRIGHTEST: f64 = 1e9;

/// The largest channel of a light, which keeps its colour; a value above `most` stays until it is
/// changed.
fn power(ui: &mut Ui, color: &mut Vec3, most: f64, what: &str) {
    let mut power = color.max_element();
    let about = "Of a lamp, times the square of a distance; as bright as a direct light of 1 at a distance of 1.";
    let scale = Scale::linear(0.0..=most, "").typed(0.0..=BRIGHTEST);
    if slider_row(ui, what, about, &mut power, &scale).changed() {
        let white =
            if color.max_element() > 0.0 { *color / color.max_element() } else { Vec3::ONE };
        *color = white * power;
    }
}

/// Distance at which a directional light gets a place, in sizes of the scene: within a picture of all of it.
const DISTANCE: f64 = 0.6;

/// A light of another kind at the same position, as bright at the scene's centre. A directional light
/// gets a position at [`DISTANCE`] from the centre. A spot is aimed at the centre, or
/// downwards where it is at the centre.
fn convert(light: &Light, kind: Kind, context: &LightContext) -> Light {
    let LightContext { scene: ObjectFrame { center, size, .. }, camera, .. } = *context;
    let (position, intensity) = match *light {
        Light::Directional { towards, radiance, follows_camera } => {
            let world_from_view = camera.view_from_world().transpose();
            let world = if follows_camera { world_from_view * towards } else { towards };
            let reach = DISTANCE * size;
            let position = center + reach * world.try_normalize().unwrap_or(DVec3::Y);
            (position, (radiance.as_dvec3() * (reach * reach)).as_vec3())
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
