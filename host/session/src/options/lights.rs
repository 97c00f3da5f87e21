//! Lights as they are typed: directions, points and spots.

use crate::options::values::{numbers, vector};
use glam::{DVec3, Vec3};
use surfelshop_api::{Light, Scene};
use surfelshop_cloud::scene::{DEFAULT_SPOT_DEG, DEFAULT_SPOT_SOFTNESS};

/// A light as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSpec(pub Light);

const DIRECTIONAL: &str = "expected `camera`, a direction x,y,z towards the light, `point:x,y,z` or \
                           `spot:x,y,z:x,y,z`, with `:r,g,b` behind it for another radiance or \
                           intensity than 1,1,1";
const POINT: &str = "expected `point:x,y,z` with the place of the light, and `:r,g,b` behind it for \
                     another intensity than 1,1,1";
const SPOT: &str = "expected `spot:x,y,z:x,y,z` with the place of the light and a point that it is \
                    turned to, behind them `:angle` or `:angle,softness`, and last `:r,g,b` for \
                    another intensity than 1,1,1";

impl LightSpec {
    /// Reads `camera`, `x,y,z`, `point:x,y,z` or `spot:x,y,z:x,y,z[:angle[,softness]]`, each with
    /// `:r,g,b` behind it or not.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut parts = text.split(':').map(str::trim);
        let first = parts.next().unwrap_or_default();
        let rest: Vec<&str> = parts.collect();
        match first {
            "point" => point(&rest),
            "spot" => spot(&rest),
            _ => directional(first, &rest),
        }
        .map(Self)
    }
}

/// Even light from the camera: every surface that it sees is lit, walls along the line of sight, too.
///
/// Four directional lights, 59 degrees off the line of sight. A white wall across it has a radiance of 1.03, one along
/// it 0.43.
#[must_use]
pub fn even() -> Vec<Light> {
    let sides = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    let light = |[x, y]: [f64; 2]| Light::Directional {
        towards: DVec3::new(x, y, 0.6),
        radiance: Vec3::splat(0.5),
        follows_camera: true,
    };
    sides.map(light).to_vec()
}

/// Replaces the usual light by even light where one stands inside a scan, and the other way round; lights that
/// somebody chose stay.
pub fn suit(lights: &mut Vec<Light>, is_inside: bool) {
    let usual = Scene::default().lights;
    match is_inside {
        true if *lights == usual => *lights = even(),
        false if *lights == even() => *lights = usual,
        _ => {}
    }
}

fn directional(place: &str, rest: &[&str]) -> Result<Light, String> {
    let radiance = match rest {
        [] => Vec3::ONE,
        [radiance] => amount(radiance, "radiance").ok_or(DIRECTIONAL)??,
        _ => return Err(DIRECTIONAL.to_owned()),
    };
    if place == "camera" {
        let headlight = Scene::default().lights.into_iter().next();
        let Some(Light::Directional { towards, .. }) = headlight else {
            return Err(DIRECTIONAL.to_owned());
        };
        return Ok(Light::Directional { towards, radiance, follows_camera: true });
    }
    let towards = vector(place).ok_or(DIRECTIONAL)??;
    if towards.try_normalize().is_none() {
        return Err("expected a direction, found 0,0,0".to_owned());
    }
    Ok(Light::Directional { towards, radiance, follows_camera: false })
}

fn point(rest: &[&str]) -> Result<Light, String> {
    let (place, intensity) = match rest {
        [place] => (place, Vec3::ONE),
        [place, intensity] => (place, amount(intensity, "intensity").ok_or(POINT)??),
        _ => return Err(POINT.to_owned()),
    };
    let position = vector(place).ok_or(POINT)??;
    Ok(Light::Point { position, intensity })
}

fn spot(rest: &[&str]) -> Result<Light, String> {
    let [place, target, rest @ ..] = rest else { return Err(SPOT.to_owned()) };
    // Three numbers are an intensity, fewer a cone.
    let (cone, intensity) = match rest {
        [] => (None, None),
        [one] if one.split(',').count() < 3 => (Some(*one), None),
        [one] => (None, Some(*one)),
        [cone, intensity] => (Some(*cone), Some(*intensity)),
        _ => return Err(SPOT.to_owned()),
    };
    let position = vector(place).ok_or(SPOT)??;
    let target = vector(target).ok_or(SPOT)??;
    if (target - position).try_normalize().is_none() {
        return Err("expected a spot turned to another point than its place".to_owned());
    }
    let usual = [DEFAULT_SPOT_DEG, f64::from(DEFAULT_SPOT_SOFTNESS)];
    let [degrees, softness] = match cone {
        None => usual,
        Some(cone) => match (numbers::<1>(cone), numbers::<2>(cone)) {
            (Some([degrees]), _) => [degrees, usual[1]],
            (None, Some(both)) => both,
            (None, None) => return Err(SPOT.to_owned()),
        },
    };
    if !(0.0..=180.0).contains(&degrees) {
        return Err(
            "expected an angle from 0 to 180 degrees between a spot's axis and its edge".to_owned()
        );
    }
    if !(0.0..=1.0).contains(&softness) {
        return Err("expected a spot's softness from 0 to 1".to_owned());
    }
    let intensity =
        intensity.map_or(Ok(Vec3::ONE), |text| amount(text, "intensity").ok_or(SPOT)?)?;
    let (angle, softness) = (degrees.to_radians(), softness as f32);
    Ok(Light::Spot { position, target, intensity, angle, softness })
}

/// Reads `r,g,b`; `None` where it is no such thing.
fn amount(text: &str, what: &str) -> Option<Result<Vec3, String>> {
    let channels = numbers::<3>(text)?;
    let most = f64::from(f32::MAX);
    if channels.iter().all(|channel| (0.0..=most).contains(channel)) {
        return Some(Ok(DVec3::from(channels).as_vec3()));
    }
    let beyond = channels.iter().any(|channel| *channel > most);
    let limit = if beyond { ", at most 3.4e38" } else { "" };
    let article = if what == "intensity" { "an" } else { "a" };
    Some(Err(format!("expected {article} {what} of 0 or more{limit}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn light(text: &str) -> Light {
        LightSpec::parse(text).unwrap().0
    }

    #[test]
    fn even_light_is_for_inside_and_chosen_lights_stay() {
        let mut lights = Scene::default().lights;
        suit(&mut lights, true);
        assert_eq!(lights, even());
        // What any surface that faces the eye gets: 0.43 along the line of sight, 1.03 across it.
        for (x, z) in [(1.0, 0.0), (0.8, 0.6), (0.0, 1.0)] {
            let normal = DVec3::new(x, 0.0, z);
            let lit = lights.iter().map(|light| match light {
                Light::Directional { towards, radiance, .. } => {
                    towards.normalize_or_zero().dot(normal).max(0.0) * f64::from(radiance.x)
                }
                _ => f64::NAN,
            });
            let lit: f64 = lit.sum();
            assert!((0.42..1.1).contains(&lit), "{normal}: {lit}");
        }
        suit(&mut lights, false);
        assert_eq!(lights, Scene::default().lights);
        let mut none = Vec::new();
        suit(&mut none, true);
        assert!(none.is_empty());
    }

    #[test]
    fn lights_have_a_direction_and_maybe_a_radiance() {
        let (towards, radiance) = (DVec3::new(-1.0, 2.0, 3.0), Vec3::new(0.5, 0.0, 2.0));
        let expected = Light::Directional { towards, radiance, follows_camera: false };
        assert_eq!(light("-1,2, 3:0.5,0,2"), expected);
        assert_eq!(light("camera"), Scene::default().lights[0]);
        for wrong in ["", "1,2", "1,2,3,4", "1,2,nan", "1,2,3:", "sun", "1,2,3:1,1,1:1,1,1"] {
            assert_eq!(LightSpec::parse(wrong), Err(DIRECTIONAL.to_owned()), "{wrong}");
        }
        let refusal = |text: &str| LightSpec::parse(text).unwrap_err();
        assert_eq!(refusal("0,0,0"), "expected a direction, found 0,0,0");
        assert_eq!(refusal("1,2,3:1,1,-1"), "expected a radiance of 0 or more");
        for far in ["1e308,0,0", "point:0,-1e38,0", "spot:0,0,0:1e200,0,0"] {
            assert!(refusal(far).contains("three numbers from -1e37 to 1e37, found `"), "{far}");
        }
        assert_eq!(refusal("1,2,3:1,1,1e39"), "expected a radiance of 0 or more, at most 3.4e38");
    }

    #[test]
    fn points_have_a_place_and_maybe_an_intensity() {
        let position = DVec3::new(1.0, -2.0, 3e6);
        assert_eq!(light("point:1,-2,3e6"), Light::Point { position, intensity: Vec3::ONE });
        let intensity = Vec3::new(4.0, 0.0, 0.5);
        assert_eq!(light("point: 1,-2,3e6 :4,0,0.5"), Light::Point { position, intensity });
        for wrong in [
            "point",
            "point:",
            "point:1,2",
            "point:1,2,inf",
            "point:1,2,3:4",
            "point:1,2,3:1,1,1:1",
        ] {
            assert_eq!(LightSpec::parse(wrong), Err(POINT.to_owned()), "{wrong}");
        }
        let refusal = LightSpec::parse("point:1,2,3:1,-1,1").unwrap_err();
        assert_eq!(refusal, "expected an intensity of 0 or more");
    }

    #[test]
    fn spots_are_turned_to_a_point_and_may_have_a_cone_and_an_intensity() {
        let (position, target) = (DVec3::Y, DVec3::X);
        let bright = Vec3::new(4.0, 5.0, 6.0);
        let spot = |intensity, degrees: f64, softness| {
            let angle = degrees.to_radians();
            Light::Spot { position, target, intensity, angle, softness }
        };
        for (text, expected) in [
            ("spot:0,1,0:1,0,0", spot(Vec3::ONE, 30.0, 0.2)),
            ("spot:0,1,0:1,0,0:45", spot(Vec3::ONE, 45.0, 0.2)),
            ("spot:0,1,0:1,0,0:0,1", spot(Vec3::ONE, 0.0, 1.0)),
            ("spot:0,1,0:1,0,0:4,5,6", spot(bright, 30.0, 0.2)),
            ("spot:0,1,0:1,0,0:180,0.5:4,5,6", spot(bright, 180.0, 0.5)),
        ] {
            assert_eq!(light(text), expected, "{text}");
        }
        for wrong in [
            "spot",
            "spot:0,1,0",
            "spot:0,1,0:1,0",
            "spot:0,1,0:1,0,0:",
            "spot:0,1,0:1,0,0:wide",
            "spot:0,1,0:1,0,0:1,2,3,4",
            "spot:0,1,0:1,0,0:30:4",
            "spot:0,1,0:1,0,0:30:4,5,6:7",
        ] {
            assert_eq!(LightSpec::parse(wrong), Err(SPOT.to_owned()), "{wrong}");
        }
        for (wrong, expected) in [
            ("spot:0,1,0:0,1,0", "expected a spot turned to another point than its place"),
            (
                "spot:0,1,0:1,0,0:181",
                "expected an angle from 0 to 180 degrees between a spot's axis and its edge",
            ),
            ("spot:0,1,0:1,0,0:30,1.5", "expected a spot's softness from 0 to 1"),
            ("spot:0,1,0:1,0,0:30:1,1,-1", "expected an intensity of 0 or more"),
        ] {
            assert_eq!(LightSpec::parse(wrong).unwrap_err(), expected, "{wrong}");
        }
    }
}
