//! Smooth surfaces.

use super::audit::{Drawn, Errors, errors, n_bare};
use super::shapes::{smooth, sphere};
use super::*;

/// The ratio by which each step of a quarter of the tolerance has to make normals better.
struct Order {
    constant: f64,
    field: f64,
}

fn sweep(name: &str, least: &Order) {
    let surface = smooth(20_000).into_iter().find(|surface| surface.name == name).unwrap();
    let mut before: Option<(Errors, usize)> = None;
    for tolerance in [0.064, 0.016, 0.004, 0.001] {
        let ran = surface.given.run(&within(surface.given.share(tolerance))).unwrap();
        let splats = Drawn::all(&ran);
        assert!(ran.bytes("clip").is_none(), "{}", ran.message);
        let (now, _) = errors(&surface.given, &splats, tolerance);
        assert!(now.field <= now.constant && now.field_max < 0.75, "{tolerance} {now:?}");
        assert_eq!(n_bare(&surface.given, &[], &splats, tolerance, 1e-6), 0);
        if let Some((before, n)) = before {
            assert!(before.constant / now.constant > least.constant, "{before:?} {now:?}");
            assert!(before.field / now.field > least.field, "{before:?} {now:?}");
            assert!(splats.len() > 2 * n && splats.len() < 6 * n, "{n} {}", splats.len());
        }
        if let Some(ideal) = surface.ideal {
            assert!(splats.len() as f64 <= 1.8 * ideal / tolerance, "{}", ran.message);
        }
        before = Some((now, splats.len()));
    }
}

// Half axes are as the root of the tolerance; a constant normal is off by as much over the radius of
// curvature, and a linear field by its square, where curvature changes, else by its cube.

#[test]
fn normals_of_a_sphere() {
    sweep("sphere", &Order { constant: 1.8, field: 6.0 });
}

#[test]
fn normals_of_a_cylinder() {
    sweep("cylinder", &Order { constant: 1.7, field: 5.0 });
}

#[test]
fn normals_of_a_saddle() {
    sweep("saddle", &Order { constant: 1.7, field: 3.0 });
}

#[test]
fn normals_of_a_torus() {
    sweep("torus", &Order { constant: 1.7, field: 2.3 });
}

#[test]
fn discs_are_held_whole() {
    let mut given = sphere(20_000);
    given.radii = vec![0.03; 20_000];
    let tolerance = 0.005;
    let ran = given.run(&within(given.share(tolerance))).unwrap();
    assert_eq!(n_bare(&given, &given.radii, &Drawn::all(&ran), tolerance, 1e-6), 0);
}

#[test]
fn threads_and_runs_make_no_difference() {
    let given = smooth(8_000).pop().unwrap().given;
    let settings = within(1e-3);
    let one = given.run_on(&settings, 1).unwrap();
    for n_threads in [2, 3, 8] {
        assert!(one == given.run_on(&settings, n_threads).unwrap(), "{n_threads}");
    }
}

#[test]
fn moving_splats_never_takes_more_of_them() {
    for surface in smooth(8_000) {
        let count = |rounds| {
            let settings = Settings { rounds, ..within(1e-3) };
            Drawn::all(&surface.given.run(&settings).unwrap()).len()
        };
        assert!(count(6) <= count(0), "{}", surface.name);
    }
}

#[test]
fn colours_are_means_in_linear_light() {
    let mut given = sphere(2_000);
    given.colors = [0, 0, 0, 255, 255, 255].repeat(1_000);
    given.access = [0.0, 1.0].repeat(1_000);
    let ran = given.run(&within(0.02)).unwrap();
    let colors = ran.bytes("color").unwrap();
    // Half of the light is 188 of 255 in sRGB.
    assert!(colors.iter().all(|&code| code.abs_diff(188) < 25), "{colors:?}");
    assert!(ran.floats("ao").iter().all(|&access| (access - 0.5).abs() < 0.2));
}

#[test]
fn the_order_of_samples_makes_no_difference() {
    let given = smooth(8_000).remove(2).given;
    let mut other = given.clone();
    other.positions.reverse();
    other.normals.reverse();
    let settings = within(1e-3);
    let (one, other) = (given.run(&settings).unwrap(), other.run(&settings).unwrap());
    assert!(one == other, "{} {}", one.message, other.message);
}
