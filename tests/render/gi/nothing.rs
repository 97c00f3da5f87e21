//! Scenes that have nothing, or next to nothing, of what bounces.

use crate::gi::bench::{Bench, ints, mean, point, view};
use glam::{DVec3, Vec3};
use surfelshop_api::Light;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_assets::cornell::cornell_box;
use surfelshop_cloud::Cloud;
use surfelshop_render::PassState;
use surfelshop_tests::clouds::{self, Surfels};

fn room() -> Cloud {
    cornell_box(8_000).unwrap()
}

fn spot(position: DVec3, target: DVec3) -> Light {
    Light::Spot { position, target, intensity: Vec3::splat(5.0), angle: 0.6, softness: 0.2 }
}

fn usual() -> Light {
    spot(DVec3::new(-0.7, 0.9, 0.85), DVec3::new(0.25, -0.9, -0.1))
}

fn bench(cloud: Cloud, lights: Vec<Light>) -> Bench {
    let eye = DVec3::new(0.0, 0.3, 4.4);
    Bench::new(cloud, lights, view(eye, DVec3::ZERO, 0.6, 64))
}

fn few(more: &[(&str, i64)]) -> Values {
    let mut values = ints(&[("vpls", 64), ("frames", 2), ("ism-size", 256)]);
    values.extend(ints(more));
    values
}

/// Invariant: what bounces stays finite and right where there is no light, no surface, or a
/// light on what it lights
#[test]
fn without_light_it_is_dark_and_covered() {
    for lights in [
        vec![],
        vec![point(DVec3::ZERO, 0.0)],
        vec![point(DVec3::NAN, 1.0)],
        // From behind everything, outwards.
        vec![spot(DVec3::new(0.0, 0.0, -3.0), DVec3::new(0.0, 0.0, -9.0))],
        vec![Light::Spot {
            position: DVec3::ZERO,
            target: DVec3::Y,
            intensity: Vec3::ONE,
            angle: 0.0,
            softness: 0.0,
        }],
    ] {
        let mut bench = bench(room(), lights.clone());
        let pixels = bench.color(&few(&[]));
        assert_eq!(mean(&pixels), [0.0; 3], "{lights:?}");
        assert!(pixels.iter().any(|pixel| pixel[3] > 0.0));
    }
}

#[test]
fn a_lamp_inside_an_object_lights_nothing_else() {
    // The lamp in the middle of a ball before a wall, and the wall alone.
    let wall = || {
        let mut surfels = Surfels::default();
        for (i, j) in (0..60).flat_map(|i: i16| (0..60).map(move |j: i16| (i, j))) {
            let at = |k: i16| f32::from(k) / 20.0 - 1.5;
            surfels.push(Vec3::new(at(i), at(j), -1.0), Vec3::Z, 0.05);
        }
        surfels
    };
    let mut both = wall();
    let ball = clouds::sphere(16_000, 0.5);
    for ((position, normal), radius) in ball.positions.iter().zip(&ball.normals).zip(&ball.radii) {
        both.push(*position, *normal, *radius);
    }
    let lit = |surfels: Surfels| {
        let mut bench = bench(surfels.cloud(), vec![point(DVec3::ZERO, 1.0)]);
        bench.view = view(DVec3::new(2.5, 0.0, 1.5), DVec3::new(0.0, 0.0, -1.0), 1.0, 64);
        mean(&bench.color(&few(&[("bounces", 2), ("frames", 8)])))[1]
    };
    let (alone, behind) = (lit(wall()), lit(both));
    println!("a wall is lit {alone:.4}, with the lamp in a ball before it {behind:.4}");
    // What comes through is what holes between the ball's discs let through in coarse maps.
    assert!(behind < 0.05 * alone, "{behind} of {alone}");
}

#[test]
fn an_empty_scene_and_a_single_surfel_are_drawn() {
    let mut empty = bench(Surfels::default().cloud(), vec![usual()]);
    assert!(empty.color(&few(&[])).iter().all(|pixel| *pixel == [0.0; 4]));
    let mut one = Surfels::default();
    one.push(Vec3::ZERO, Vec3::Z, 0.5);
    let mut bench = bench(one.cloud(), vec![point(DVec3::new(0.0, 0.0, 1.0), 1.0)]);
    let direct = bench.color(&few(&[("bounces", 0)]));
    let all = bench.color(&few(&[("bounces", 4)]));
    // There is nothing that its light could fall on.
    assert!(mean(&direct)[0] > 0.0);
    assert_eq!(direct, all);
}

#[test]
fn lights_on_what_they_light_stay_finite() {
    // Two sheets that touch along a line: lights of one lie on the other.
    let mut sheets = Surfels::default();
    for i in 0..40 {
        for j in 0..40 {
            let at = |k: i16| f32::from(k) / 20.0 - 1.0;
            sheets.push(Vec3::new(at(i), -0.5, at(j)), Vec3::Y, 0.05);
            sheets.push(Vec3::new(at(i), at(j) + 0.5, -1.0), Vec3::Z, 0.05);
        }
    }
    let mut bench = bench(sheets.cloud(), vec![usual()]);
    for softening in [0.0, 1.0] {
        let mut values = few(&[("bounces", 4)]);
        values.insert("softening".to_owned(), surfelshop_api::params::Value::Float(softening));
        values.insert("specular".to_owned(), surfelshop_api::params::Value::Float(1.0));
        values.insert("shininess".to_owned(), surfelshop_api::params::Value::Float(1024.0));
        let lit = mean(&bench.color(&values));
        assert!(lit[0] > 0.0 && lit[0] < 100.0, "{lit:?}");
    }
}

/// Invariant: without bounces it is direct light to the bit, and takes no other pass
#[test]
fn without_bounces_it_is_direct_light_and_costs_no_more() {
    let mut bench = bench(room(), vec![usual()]);
    let direct = {
        let mut values = few(&[]);
        let show = surfelshop_api::params::Value::Text("direct".to_owned());
        values.insert("show".to_owned(), show);
        bench.color(&values)
    };
    assert!(mean(&direct)[1] > 0.0);
    for values in [few(&[("bounces", 0)]), few(&[("vpls", 0)])] {
        assert_eq!(bench.color(&values), direct);
        let rendered = bench.frame(&values, 0, &[Output::Color]);
        let own = rendered.passes.iter().filter(|pass| !pass.name.starts_with("surfels:"));
        let ran: Vec<_> =
            own.filter(|pass| pass.state == PassState::Ran).map(|p| &*p.name).collect();
        assert_eq!(ran, ["light depths 1", "direct light"]);
        assert!(!rendered.wants_another_frame);
    }
    assert_ne!(bench.color(&few(&[])), direct);
}
