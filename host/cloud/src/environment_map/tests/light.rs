use super::*;
use std::f64::consts::PI;
use surfelshop_geometry::harmonics::{self, MAX_COEFFICIENTS};

#[test]
fn even_light_has_order_zero_alone() {
    for mapping in Mapping::ALL {
        let light = [0.5f32, 1.0, 2.0];
        let probe = probe(painted(mapping, 128, |_| light), mapping);
        let facts = &probe.facts;
        assert_eq!(facts.harmonics.len(), MAX_COEFFICIENTS);
        for (channel, radiance) in light.map(f64::from).into_iter().enumerate() {
            let first = facts.harmonics[0][channel] / ((4.0 * PI).sqrt() * radiance);
            // Quadrature of the discs; the others are exact.
            assert!((first - 1.0).abs() < 1e-5, "{mapping:?}: {first}");
            assert!((facts.mean_radiance[channel] / radiance - 1.0).abs() < 1e-5);
            for (i, c) in facts.harmonics.iter().enumerate().skip(1) {
                // Each texel counts at its centre, an error of the order of its angle squared,
                // (2 pi / 128)^2 at the coarsest.
                assert!(c[channel].abs() < 3e-3 * radiance, "{mapping:?} {i}: {c:?}");
            }
        }
        assert_eq!(facts.max_radiance, 2.0);
        assert_eq!(facts.sun, None);
        assert_eq!(facts.harmonics, facts.harmonics_without_sun);
        // Also beyond a disc and beside a cross, where the picture is black.
        for texel in &probe.texels {
            for (c, expected) in texel.iter().zip(light) {
                assert!((c / expected - 1.0).abs() < 1e-6, "{mapping:?}: {texel:?}");
            }
        }
    }
    let constant = Probe::constant([0.25, 0.5, 4.0]);
    assert!((constant.facts.mean_radiance[2] - 4.0).abs() < 1e-12);
    assert!((constant.facts.harmonics[0][0] - 0.25 * (4.0 * PI).sqrt()).abs() < 1e-12);
    assert!(constant.texels.iter().all(|t| (t[1] - 0.5).abs() < 1e-6));
}

/// Light of order 1 and 3, not negative.
fn smooth(d: DVec3) -> [f32; 3] {
    [1.0 + 0.8 * d.x, 1.0 - 0.6 * d.y + 0.3 * d.x * d.y * d.z, 2.0 + d.z * d.z].map(|c| c as f32)
}

#[test]
fn every_mapping_gives_the_same_harmonics() {
    let reference = probe(painted(Mapping::LatLong, 1024, smooth), Mapping::LatLong);
    for mapping in Mapping::ALL {
        let facts = probe(painted(mapping, 512, smooth), mapping).facts;
        for (i, (a, b)) in facts.harmonics.iter().zip(&reference.facts.harmonics).enumerate() {
            for (a, b) in a.iter().zip(b) {
                // Texels count at their centres or a few places; coefficients are about 1.
                assert!((a - b).abs() < 1e-3, "{mapping:?} {i}: {a} {b}");
            }
        }
    }
    // Order 1 of 1 + 0.8 x, from the integral of x squared.
    let expected = 0.8 * 0.488_602_511_9 * 4.0 * PI / 3.0;
    assert!((reference.facts.harmonics[3][0] - expected).abs() < 1e-4);
}

#[test]
fn the_map_has_the_light_of_the_picture() {
    let streaks = |d: DVec3| {
        let soft = smooth(d);
        soft.map(|c| c * (1.5 + (9.0 * d.y).sin() + (40.0 * d.x).sin() * 0.4) as f32)
    };
    for mapping in Mapping::ALL {
        let probe = probe(painted(mapping, 512, streaks), mapping);
        let side = probe.facts.side;
        let mut projected = [[0.0; 3]; MAX_COEFFICIENTS];
        // Texels of the border lie half beyond it: a corner-aligned grid's trapezoidal rule.
        let edge = |i: u32| if i == 0 || i == side - 1 { 0.5 } else { 1.0 };
        for j in 0..side {
            for i in 0..side {
                let d = of_map(&probe, i, j);
                let square = d.abs().element_sum().powi(3);
                let step = 2.0 / f64::from(side - 1);
                let angle = square * step * step * edge(i) * edge(j);
                let texel = probe.texels[(j * side + i) as usize];
                harmonics::add(&mut projected, d, texel.map(|c| f64::from(c) * angle));
            }
        }
        let size = probe.facts.harmonics[0];
        for (a, b) in projected.iter().zip(&probe.facts.harmonics) {
            for channel in 0..3 {
                let off = (a[channel] - b[channel]).abs() / size[channel];
                assert!(off < 0.01, "{mapping:?}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn what_is_no_radiance_is_replaced_and_counted() {
    let mut picture = painted(Mapping::LatLong, 64, |_| [1.0; 3]);
    let at = |x: usize, y: usize| y * 64 + x;
    picture.rgb[at(5, 5)] = [f32::NAN, 3.0, -1.0];
    picture.rgb[at(20, 9)] = [f32::INFINITY; 3];
    picture.rgb[at(21, 9)] = [f32::NEG_INFINITY; 3];
    picture.rgb[at(40, 20)] = [-0.5, 2.0, 2.0];
    let probe = probe(picture, Mapping::LatLong);
    assert_eq!(probe.repairs, Repairs { n_not_finite: 3, n_negative: 1 });
    assert_eq!(probe.picture.rgb[at(5, 5)], [1.0, 3.0, 0.0]);
    assert_eq!(probe.picture.rgb[at(20, 9)], [1.0; 3]);
    assert_eq!(probe.picture.rgb[at(21, 9)], [1.0; 3]);
    assert_eq!(probe.picture.rgb[at(40, 20)], [0.0, 2.0, 2.0]);
    assert!(probe.facts.harmonics.as_flattened().iter().all(|c| c.is_finite()));
    assert!(probe.texels.as_flattened().iter().all(|c| c.is_finite() && *c >= 0.0));
    let nothing = Picture { width: 4, height: 2, rgb: vec![[f32::NAN; 3]; 8] };
    let probe = Probe::from_picture("nan", nothing, None).unwrap();
    assert_eq!(probe.repairs.n_not_finite, 8);
    assert_eq!(probe.facts.mean_radiance, [0.0; 3]);
    let largest = Picture { width: 4, height: 2, rgb: vec![[f32::MAX; 3]; 8] };
    let probe = Probe::from_picture("max", largest, None).unwrap();
    assert!(probe.texels.as_flattened().iter().all(|c| c.is_finite()));
}

#[test]
fn corners_that_show_nothing_are_not_counted() {
    let mut picture = painted(Mapping::Angular, 64, |_| [1.0; 3]);
    picture.rgb[0] = [f32::NAN; 3];
    picture.rgb[63] = [-1.0; 3];
    let probe = Probe::from_picture("corners", picture, None).unwrap();
    assert_eq!(probe.mapping, Mapping::Angular);
    assert_eq!(probe.repairs, Repairs::default());
    assert_eq!(probe.picture.rgb[0], [0.0; 3]);
}

#[test]
fn shape_and_corners_tell_the_mapping() {
    for (mapping, expected) in [
        (Mapping::LatLong, Mapping::LatLong),
        (Mapping::VerticalCross, Mapping::VerticalCross),
        (Mapping::HorizontalCross, Mapping::HorizontalCross),
        (Mapping::Angular, Mapping::Angular),
        (Mapping::Octahedral, Mapping::Octahedral),
        // Alike to the eye; the user has to say it.
        (Mapping::MirroredBall, Mapping::Angular),
    ] {
        let probe = Probe::from_picture("test", painted(mapping, 64, smooth), None).unwrap();
        assert_eq!(probe.mapping, expected);
        assert!(probe.mapping_was_detected);
    }
    assert!(
        !probe(painted(Mapping::Angular, 64, smooth), Mapping::MirroredBall).mapping_was_detected
    );
}

#[test]
fn shapes_that_fit_no_mapping_are_refused() {
    let even = |width: u32, height: u32| Picture {
        width,
        height,
        rgb: vec![[1.0; 3]; (width * height) as usize],
    };
    let refused = |picture: Picture, mapping| {
        let line = Probe::from_picture("test", picture, mapping).unwrap_err().to_string();
        assert!(!line.contains('\n') && line.contains("expected") && line.contains("found"));
        line
    };
    let line = refused(even(50, 20), None);
    assert!(
        line.contains("50 x 20") && line.contains("vertical-cross, horizontal-cross"),
        "{line}"
    );
    assert!(refused(even(50, 20), Some(Mapping::Angular)).contains("a square"));
    assert!(refused(even(40, 20), Some(Mapping::VerticalCross)).contains("3 by 4"));
    assert!(refused(even(0, 0), None).contains("0 x 0"));
    let short = Picture { width: 4, height: 2, rgb: vec![[0.0; 3]; 7] };
    assert!(refused(short, None).contains("expected 8 pixels, found 7"));
    assert!(Probe::from_picture("test", even(50, 20), Some(Mapping::LatLong)).is_ok());
}

#[test]
fn equal_light_has_equal_keys() {
    let of = |mapping, picture: &Picture| {
        Probe::from_picture("any", picture.clone(), Some(mapping)).unwrap().facts.key
    };
    let picture = painted(Mapping::Octahedral, 32, smooth);
    let key = of(Mapping::Octahedral, &picture);
    assert_eq!(key, of(Mapping::Octahedral, &picture));
    assert_ne!(key, of(Mapping::LatLong, &picture));
    let mut other = picture.clone();
    other.rgb[100][1] += 1e-6;
    assert_ne!(key, of(Mapping::Octahedral, &other));
}

#[test]
fn facts_do_not_depend_on_the_number_of_threads() {
    let picture = painted(Mapping::LatLong, 128, smooth);
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| probe(picture.clone(), Mapping::LatLong))
    };
    assert_eq!(on(1), on(3));
}
