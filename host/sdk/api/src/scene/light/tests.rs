use crate::scene::camera::{Camera, Projection};
use crate::scene::light::*;

fn view() -> View {
    let projection = Projection::Perspective { fov_y: 0.8 };
    let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
    View { camera, size_px: [8; 2], near: 0.1, far: 10.0 }
}

/// A cloud two units wide.
fn facts() -> CloudFacts {
    CloudFacts { bounds_min: -DVec3::ONE, bounds_max: DVec3::ONE, ..CloudFacts::default() }
}

fn at(light: Light, place: DVec3) -> Arriving {
    Lamp::new(&light, &view(), &facts()).arriving(place)
}

fn spot(target: DVec3, degrees: f64, softness: f32) -> Light {
    let angle = degrees.to_radians();
    Light::Spot { position: DVec3::ZERO, target, intensity: Vec3::ONE, angle, softness }
}

#[test]
fn intensity_falls_with_the_square_of_the_distance() {
    let light = Light::Point { position: DVec3::X, intensity: Vec3::new(8.0, 4.0, 2.0) };
    let found = at(light, DVec3::new(1.0, 2.0, 0.0));
    assert_eq!(found.towards, DVec3::NEG_Y);
    assert_eq!(found.radiance, DVec3::new(2.0, 1.0, 0.5));
    // The light is a ball of a ten-thousandth of two units.
    assert!((found.distance - (2.0 - 2e-4)).abs() < 1e-12, "{found:?}");
}

#[test]
fn spots_have_an_edge_and_a_smooth_one_where_it_is_soft() {
    let beside = |degrees: f64| {
        DVec3::from_array([degrees.to_radians().sin(), 0.0, 0.0])
            + DVec3::new(0.0, 0.0, -degrees.to_radians().cos())
    };
    let red = |light, degrees| at(light, beside(degrees)).radiance.x;
    for edge in [0.01, 0.5, 20.0, 90.0, 150.0] {
        let sharp = spot(DVec3::NEG_Z, edge, 0.0);
        // Rounding of unit vectors moves directions by 1e-16, of which an angle of 0.01 degrees is
        // precise to 1e-12.
        assert!((red(sharp, 0.999 * edge) - 1.0).abs() < 1e-12, "{edge}");
        assert_eq!(red(sharp, 1.001 * edge), 0.0, "{edge}");
        let soft = spot(DVec3::NEG_Z, edge, 0.5);
        assert!((red(soft, 0.499 * edge) - 1.0).abs() < 1e-12, "{edge}");
        assert_eq!(red(soft, 1.001 * edge), 0.0, "{edge}");
        // Half of it where the cosine is in the middle.
        let cosine = 0.5 * (edge.to_radians().cos() + (0.5 * edge.to_radians()).cos());
        let half = red(soft, cosine.acos().to_degrees());
        // A cosine near 1 tells an angle of 0.01 degrees to 1e-16 / 1.5e-8.
        assert!((half - 0.5).abs() < 1e-7, "{edge}: {half}");
    }
    assert_eq!(red(spot(DVec3::NEG_Z, 0.0, 0.5), 0.0), 0.0, "no cone, no light");
    for degrees in [179.0, 180.0] {
        assert_eq!(red(spot(DVec3::NEG_Z, 180.0, 0.0), degrees), 1.0, "all around");
    }
}

#[test]
fn whatever_a_light_says_what_arrives_is_finite() {
    let odd = [0.0, 1.0, -1.0, 1e300, f64::NAN, f64::INFINITY];
    let places = odd.map(|x| DVec3::new(x, 0.0, 0.0));
    let intensities = [0.0, 1.0, -1.0, f32::MAX, f32::NAN, f32::INFINITY].map(Vec3::splat);
    let mut lights = Vec::new();
    for position in places {
        for intensity in intensities {
            lights.push(Light::Point { position, intensity });
            for target in places {
                for x in odd {
                    let (angle, softness) = (x, x as f32);
                    lights.push(Light::Spot { position, target, intensity, angle, softness });
                }
            }
        }
    }
    let empty = CloudFacts::default();
    for light in lights {
        for facts in [&facts(), &empty] {
            let lamp = Lamp::new(&light, &view(), facts);
            for place in [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1e-7, 0.0)] {
                let found = lamp.arriving(place);
                let finite = found.towards.is_finite() && found.radiance.is_finite();
                assert!(finite && found.distance >= 0.0, "{light:?}: {found:?}");
                assert!(found.radiance.min_element() >= 0.0, "{light:?}: {found:?}");
            }
        }
    }
}

#[test]
fn a_spot_without_a_direction_shines_down() {
    let light = spot(DVec3::ZERO, 30.0, 0.2);
    assert_eq!(at(light, DVec3::NEG_Y).radiance.x, 1.0);
    assert_eq!(at(light, DVec3::Y).radiance.x, 0.0);
}

#[test]
fn nearer_than_its_radius_a_light_gets_no_brighter() {
    let light = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE };
    let (on, near, at_edge) = (at(light, DVec3::ZERO), at(light, DVec3::X * 1e-5), 1.0 / 4e-8);
    assert!((near.radiance.x / at_edge - 1.0).abs() < 1e-12, "{near:?}");
    assert_eq!((on.radiance, on.towards, on.distance), (near.radiance, DVec3::ZERO, 0.0));
}

/// What a plugin of ABI 3.0 knows.
#[derive(Debug, Deserialize)]
enum OldLight {
    Directional {
        #[expect(dead_code, reason = "only whether it can be read counts")]
        radiance: Vec3,
    },
}

#[test]
fn old_readers_take_old_lights_and_name_the_kind_they_do_not_know() {
    let radiance = Vec3::ONE;
    let old = Light::Directional { towards: DVec3::X, radiance, follows_camera: true };
    let read =
        |light: &Light| rmp_serde::from_slice::<OldLight>(&rmp_serde::to_vec_named(light).unwrap());
    assert!(matches!(read(&old), Ok(OldLight::Directional { .. })));
    let point = Light::Point { position: DVec3::X, intensity: Vec3::ONE };
    let message = read(&point).unwrap_err().to_string();
    assert!(message.contains("unknown variant `Point`"), "{message}");
}
