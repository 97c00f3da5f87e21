//! Smooth surfaces.

use super::audit::{AuditedSplat, Errors, errors, n_uncovered};
use super::shapes::{smooth, sphere};
use super::*;

/// The ratio by which each step of a quarter of the tolerance has to make normals better.
struct Convergence {
    constant: f64,
    field: f64,
}

/// Prints a row for each tolerance: splats, how often they cover a point, and root mean squares and largest
/// errors of normals, radians.
#[allow(clippy::print_stdout, reason = "what was measured is part of the result")]
fn converges(name: &str, least: &Convergence) {
    let surface = smooth(20_000).into_iter().find(|surface| surface.name == name).unwrap();
    let mut before: Option<(Errors, usize)> = None;
    for tolerance in [0.064, 0.016, 0.004, 0.001] {
        let ran = surface.given.run(&within(surface.given.share(tolerance))).unwrap();
        let splats = AuditedSplat::all(&ran);
        assert!(ran.bytes("clip").is_none(), "{}", ran.message);
        let (now, overlap) = errors(&surface.given, &splats, tolerance);
        println!(
            "{name} {tolerance}: {} splats, {overlap:.2} over each other, {now:?}",
            splats.len()
        );
        assert!(now.field <= now.constant && now.field_max < 0.75, "{tolerance} {now:?}");
        assert_eq!(n_uncovered(&surface.given, &[], &splats, tolerance, 1e-6), 0);
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
    converges("sphere", &Convergence { constant: 1.8, field: 6.0 });
}

#[test]
fn normals_of_a_cylinder() {
    converges("cylinder", &Convergence { constant: 1.7, field: 5.0 });
}

#[test]
fn normals_of_a_saddle() {
    converges("saddle", &Convergence { constant: 1.7, field: 3.0 });
}

#[test]
fn normals_of_a_torus() {
    converges("torus", &Convergence { constant: 1.7, field: 2.3 });
}

#[test]
fn discs_are_held_whole() {
    let mut given = sphere(20_000);
    given.radii = vec![0.03; 20_000];
    let tolerance = 0.005;
    let ran = given.run(&within(given.share(tolerance))).unwrap();
    assert_eq!(n_uncovered(&given, &given.radii, &AuditedSplat::all(&ran), tolerance, 1e-6), 0);
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
            AuditedSplat::all(&surface.given.run(&settings).unwrap()).len()
        };
        assert!(count(6) <= count(0), "{}", surface.name);
    }
}

#[test]
fn colours_are_means_in_linear_light() {
    let mut given = sphere(2_000);
    given.colors = [0, 0, 0, 255, 255, 255].repeat(1_000);
    given.access = [0.0, 1.0].repeat(1_000);
    let ran = given.run(&Settings { color_tolerance: 1.0, ..within(0.02) }).unwrap();
    let colors = ran.bytes("color").unwrap();
    // Half of the light is 188 of 255 in sRGB.
    assert!(colors.iter().all(|&code| code.abs_diff(188) < 25), "{colors:?}");
    assert!(ran.floats("ao").iter().all(|&access| (access - 0.5).abs() < 0.2));
}

#[test]
fn stripes_on_a_plane_are_not_blended_away() {
    let mut random = shapes::random(2);
    let mut given =
        shapes::given(shapes::jittered(100, 100).map(|(x, y)| (DVec3::new(x, y, 0.0), DVec3::Z)));
    // Five dark stripes and five bright ones, with a little noise.
    let bright = |x: f32| (x * 10.0) as u32 % 2 == 1;
    given.colors = (given.positions.iter())
        .flat_map(|p| {
            let noise = (random() * 20.0) as u8;
            if bright(p.x) { [200 + noise, 180, 40] } else { [60 + noise, 20, 10] }
        })
        .collect();
    let blended = given.run(&Settings { color_tolerance: 1.0, ..within(1e-3) }).unwrap();
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = AuditedSplat::all(&ran);
    assert_eq!(n_uncovered(&given, &[], &splats, 1e-3 * 2f64.sqrt(), 1e-6), 0);
    let colors: Vec<&[u8]> = ran.bytes("color").unwrap().chunks_exact(3).collect();
    let is_one = |code: u8, of: [u8; 2]| of.iter().any(|&o| code.abs_diff(o) <= 26);
    assert!(colors.iter().all(|c| is_one(c[0], [70, 210]) && is_one(c[1], [20, 180])));
    assert!((20..400).contains(&splats.len()), "{}", ran.message);
    assert!(AuditedSplat::all(&blended).len() < 20, "{}", blended.message);
    // Each lies in the stripe that has its colour.
    let is_in_stripe =
        |(splat, c): (&AuditedSplat, &&[u8])| bright(splat.at.x as f32) == (c[0] > 140);
    assert!(splats.iter().zip(&colors).all(is_in_stripe), "{}", ran.message);
}

#[test]
fn clouds_without_colours_have_no_tolerance_of_colours() {
    let given = sphere(3_000);
    let [off, tight] = [1.0, 0.0]
        .map(|color_tolerance| given.run(&Settings { color_tolerance, ..within(1e-3) }).unwrap());
    assert!(off == tight);
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
