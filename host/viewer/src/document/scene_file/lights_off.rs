//! Lights that are switched off: renderers do not know them, so a scene keeps them in its `layout`.

use crate::document::settings::has_direction;
use surfelshop_api::{Light, Scene};
use surfelshop_cloud::scene::Table;
use toml::Value as Toml;

const KEY: &str = "lights_off";

/// The lights of a layout; what is none is left out.
pub(super) fn read(layout: &Table) -> Vec<Light> {
    let rows = layout.get(KEY).and_then(Toml::as_array).map(Vec::as_slice).unwrap_or_default();
    let lights = rows.iter().filter_map(|row| row.clone().try_into::<Light>().ok());
    lights.filter(is_light).take(Scene::MAX_LIGHTS).collect()
}

/// Whether the numbers of a light can be written into a scene.
fn is_light(light: &Light) -> bool {
    let has_numbers = match *light {
        Light::Directional { towards, radiance, .. } => {
            towards.try_normalize().is_some() && radiance.is_finite()
        }
        Light::Point { position, intensity } => position.is_finite() && intensity.is_finite(),
        Light::Spot { position, target, intensity, angle, softness } => {
            position.is_finite()
                && target.is_finite()
                && intensity.is_finite()
                && angle.is_finite()
                && softness.is_finite()
        }
    };
    has_numbers && has_direction(light)
}

/// Puts the lights into a layout.
pub(super) fn write(layout: &mut Table, lights: &[Light]) {
    let rows: Vec<Toml> = lights.iter().filter_map(|light| Toml::try_from(*light).ok()).collect();
    match rows.is_empty() {
        true => layout.remove(KEY),
        false => layout.insert(KEY.to_owned(), Toml::Array(rows)),
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    #[test]
    fn lights_come_back_and_what_is_none_does_not() {
        let (position, intensity) = (DVec3::new(1.0, 2.5, 4e6), Vec3::new(0.25, 3.0, 1.0));
        let spot = |target| Light::Spot { position, target, intensity, angle: 0.5, softness: 0.25 };
        let lights = [
            Scene::default().lights[0],
            Light::Point { position, intensity },
            spot(DVec3::ZERO),
            spot(position),
            Light::Point { position: DVec3::NAN, intensity },
        ];
        let mut layout = Table::new();
        write(&mut layout, &lights);
        let again = read(&layout.to_string().parse().unwrap());
        assert_eq!(again, lights[..3], "a spot without direction and one at no place are left out");
        write(&mut layout, &[]);
        assert!(layout.is_empty());
    }
}
