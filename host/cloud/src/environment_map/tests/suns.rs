use super::*;
use std::f64::consts::PI;
use surfelshop_geometry::harmonics::{self, Coefficients};

fn coefficients(values: &[[f64; 3]]) -> Coefficients {
    values.try_into().unwrap()
}

#[test]
fn a_lone_texel_is_found_with_its_irradiance() {
    for mapping in Mapping::ALL {
        let mut picture = painted(mapping, 128, |_| [0.01; 3]);
        let direction = DVec3::new(0.3, 0.8, -0.4).normalize_or_zero();
        let [u, v] = mapping.place(direction);
        let x = (u * f64::from(picture.width)) as u32;
        let y = (v * f64::from(picture.height)) as u32;
        let index = (y * picture.width + x) as usize;
        picture.rgb[index] = [1e5, 0.5e5, 0.25e5];
        let angle = solid_angles(mapping, picture.width, picture.height)[index];
        let facts = probe(picture, mapping).facts;
        let sun = facts.sun.unwrap_or_else(|| panic!("{mapping:?}: none"));
        // Within the texel, whose diagonal is below 5 degrees in all of them.
        assert!(sun.towards.angle_between(direction).to_degrees() < 2.5, "{mapping:?}");
        for (radiance, texel) in sun.radiance.into_iter().zip([1e5, 0.5e5, 0.25e5]) {
            let expected = (texel - 0.01) * angle / PI;
            // The surroundings are f32.
            assert!((radiance / expected - 1.0).abs() < 1e-9, "{mapping:?}: {radiance} {expected}");
        }
        let disc = (angle / PI).sqrt();
        assert!((sun.angular_radius / disc - 1.0).abs() < 1e-6, "{mapping:?}");
        let even = 0.01 * (4.0 * PI).sqrt();
        // Rounding of f32, and of 1e5 taken away from itself.
        assert!((facts.harmonics_without_sun[0][0] / even - 1.0).abs() < 1e-4, "{mapping:?}");
        assert!(facts.harmonics[0][0] > facts.harmonics_without_sun[0][0]);
    }
}

/// A disc of this radius in degrees and radiance over grey.
fn disc(radius: f64, radiance: f32) -> impl Fn(DVec3) -> [f32; 3] {
    let centre = DVec3::new(0.5, 0.6, 0.3).normalize_or_zero();
    move |d| {
        let within = d.dot(centre) >= radius.to_radians().cos();
        [if within { radiance } else { 0.5 }; 3]
    }
}

#[test]
fn a_disc_is_found_with_its_radius() {
    let facts = probe(painted(Mapping::LatLong, 1024, disc(2.0, 1000.0)), Mapping::LatLong).facts;
    let sun = facts.sun.unwrap();
    // A texel is a third of a degree.
    assert!((sun.angular_radius.to_degrees() - 2.0).abs() < 0.1, "{}", sun.angular_radius);
    let expected = 999.5 * 2f64.to_radians().sin().powi(2);
    assert!((sun.radiance[0] / expected - 1.0).abs() < 0.02, "{:?}", sun.radiance);
    // What is left is grey: its harmonics are those of even light.
    for (i, c) in facts.harmonics_without_sun.iter().enumerate().skip(1) {
        assert!(c[0].abs() < 1e-3, "{i}: {c:?}");
    }
}

#[test]
fn the_sun_and_the_rest_make_the_whole() {
    let facts = Probe::sky().facts;
    let sun = facts.sun.unwrap();
    let mut whole = coefficients(&facts.harmonics_without_sun);
    harmonics::add(&mut whole, sun.towards, sun.radiance.map(|c| c * PI));
    for (a, b) in whole.iter().zip(&facts.harmonics) {
        // A disc of 0.8 degrees is no point: its order 5 is 15 * 0.014^2 / 4 lower.
        assert!((a[1] - b[1]).abs() < 2e-3 * sun.radiance[1] * PI, "{a:?} {b:?}");
    }
}

#[test]
fn what_is_large_weak_or_even_is_no_sun() {
    let of = |radius, radiance| {
        let picture = painted(Mapping::LatLong, 512, disc(radius, radiance));
        probe(picture, Mapping::LatLong).facts.sun
    };
    assert_eq!(of(12.0, 100.0), None);
    assert_eq!(of(30.0, 100.0), None);
    // Of 1.5 degrees and an irradiance of 0.02 beside one of 0.5 pi.
    assert_eq!(of(1.5, 10.0), None);
    assert_eq!(of(1.5, 1.0), None);
    let overcast = |d: DVec3| [(1.0 + 2.0 * d.y.max(0.0)) as f32; 3];
    assert_eq!(probe(painted(Mapping::LatLong, 256, overcast), Mapping::LatLong).facts.sun, None);
    assert_eq!(
        probe(painted(Mapping::LatLong, 256, |_| [0.0; 3]), Mapping::LatLong).facts.sun,
        None
    );
}

#[test]
fn built_ins_are_lit_as_they_say() {
    let studio = Probe::studio();
    assert_eq!(studio.facts.sun, None);
    for mean in studio.facts.mean_radiance {
        // The factor that makes it so is f32.
        assert!((mean - 0.5).abs() < 1e-5, "{mean}");
    }
    let sky = Probe::sky();
    let sun = sky.facts.sun.unwrap();
    assert!((sun.towards.y.asin().to_degrees() - 40.0).abs() < 0.2, "{}", sun.towards);
    assert!((sun.angular_radius.to_degrees() - 0.8).abs() < 0.2, "{}", sun.angular_radius);
    assert!((2.3..2.7).contains(&sun.radiance[1]), "{:?}", sun.radiance);
    let surface = harmonics::of_diffuse_surface(
        &coefficients(&sky.facts.harmonics_without_sun),
        5,
        Default::default(),
    );
    let (up, down) = (
        harmonics::evaluate(&surface, DVec3::Y)[1],
        harmonics::evaluate(&surface, DVec3::NEG_Y)[1],
    );
    // The sky's 0.5, less what the cut at order 5 costs at the horizon.
    assert!((up - 0.5).abs() < 0.05, "{up}");
    // A fifth of sky and sun: 0.2 (0.5 + 2.5 sin 40 degrees).
    assert!((down - 0.42).abs() < 0.05, "{down}");
    for probe in [studio, sky, Probe::constant([1.0; 3])] {
        assert_eq!(probe.repairs, Repairs::default());
        assert!(probe.texels.as_flattened().iter().all(|c| c.is_finite() && *c >= 0.0));
        assert_eq!(probe.texels.len(), (probe.facts.side as usize).pow(2));
    }
}
