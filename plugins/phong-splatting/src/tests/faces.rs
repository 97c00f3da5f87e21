//! Creases.

use super::audit::{AuditedSplat, n_uncovered};
use super::shapes::{cone, cube, ell, prism};
use super::*;
use std::f64::consts::TAU;
use surfelshop_api::glam::DVec2;

/// The largest distance from a solid of what splats do not cut off.
fn farthest(splats: &[AuditedSplat], outside: impl Fn(DVec3) -> f64) -> f64 {
    let places: Vec<DVec2> = (0..=20 * 96)
        .map(|i| DVec2::from_angle(f64::from(i % 96) * TAU / 96.0) * f64::from(i / 96) / 20.0)
        .collect();
    let most = |splat: &AuditedSplat| {
        let kept = places.iter().filter(|at| splat.kept(**at) >= 0.0);
        let points = kept.map(|at| {
            let at = *at * splat.half;
            splat.at + splat.axes[0] * at.x + splat.axes[1] * at.y
        });
        points.map(&outside).fold(0.0, f64::max)
    };
    splats.iter().map(most).fold(0.0, f64::max)
}

fn outside_of_cube(point: DVec3) -> f64 {
    point.distance(point.clamp(DVec3::ZERO, DVec3::ONE))
}

#[test]
fn splats_of_a_cube_end_at_its_edges() {
    let given = cube(40);
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = AuditedSplat::all(&ran);
    // A splat has two lines, and each corner of each face asks for two.
    assert_eq!(splats.len(), 24, "{}", ran.message);
    assert!(splats.iter().all(|splat| splat.clip[6] == 1.0));
    assert!(farthest(&splats, outside_of_cube) < 1e-6);
    assert_eq!(n_uncovered(&given, &[], &splats, 1e-3 * 3f64.sqrt(), 1e-6), 0);
}

#[test]
fn splats_that_are_not_cut_stick_out() {
    let given = cube(40);
    let ran = given.run(&Settings { clip: false, ..within(1e-3) }).unwrap();
    assert!(ran.bytes("clip").is_none());
    let splats = AuditedSplat::all(&ran);
    assert!(splats.len() < 24 && farthest(&splats, outside_of_cube) > 0.1, "{}", ran.message);
    assert_eq!(n_uncovered(&given, &[], &splats, 1e-3 * 3f64.sqrt(), 1e-6), 0);
}

#[test]
fn corners_that_go_inwards_stay_whole() {
    let given = ell(40);
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = AuditedSplat::all(&ran);
    let outside = |p: DVec3| {
        let a = p.distance(p.clamp(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0)));
        a.min(p.distance(p.clamp(DVec3::ZERO, DVec3::new(1.0, 2.0, 1.0))))
    };
    assert!(splats.iter().filter(|splat| splat.clip[6] == 2.0).count() >= 2, "{}", ran.message);
    assert!(farthest(&splats, outside) < 1e-6);
    assert_eq!(n_uncovered(&given, &[], &splats, 3e-3, 1e-6), 0);
}

/// How far a point is from a convex polygon, its corners counterclockwise, that is swept to height 1.
fn outside_of_prism(corners: &[(f64, f64)], point: DVec3) -> f64 {
    let at = DVec2::new(point.x, point.y);
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let sides = sides.map(|(a, b)| (DVec2::from(*a), DVec2::from(*b)));
    let is_inside = sides.clone().all(|(a, b)| (b - a).perp_dot(at - a) >= 0.0);
    let distances = sides.map(|(a, b)| {
        let share = (at - a).dot(b - a) / (b - a).length_squared();
        at.distance(a.lerp(b, share.clamp(0.0, 1.0)))
    });
    let beside = if is_inside { 0.0 } else { distances.fold(f64::INFINITY, f64::min) };
    beside.hypot((point.z - point.z.clamp(0.0, 1.0)).abs())
}

#[test]
fn no_splat_stands_out_beyond_a_sharp_corner() {
    // Of 30 degrees, once as it is and with its tip cut off: there three lines end two faces.
    let far = DVec2::from_angle(30f64.to_radians()) * 2.0;
    let sharp = [(0.0, 0.0), (2.0, 0.0), (far.x, far.y)];
    let blunt = [(0.15, 0.0), (2.0, 0.0), (far.x, far.y), (0.15, 0.15 * far.y / far.x)];
    for corners in [&sharp[..], &blunt[..]] {
        let inside = |x: f64, y: f64| outside_of_prism(corners, DVec3::new(x, y, 0.5)) == 0.0;
        let given = prism(corners, inside, 40);
        for share in [1e-2, 1e-3, 1e-4] {
            let ran = given.run(&within(share)).unwrap();
            let splats = AuditedSplat::all(&ran);
            let farthest = farthest(&splats, |point| outside_of_prism(corners, point));
            assert!(farthest < 0.05, "{farthest} {}", ran.message);
            assert_eq!(n_uncovered(&given, &[], &splats, share * 3.0, 1e-6), 0);
        }
    }
}

#[test]
fn vertices_on_edges_are_on_each_face() {
    // A grid over each face of the cube with vertices on its edges, that have the mean normal.
    let n = 16;
    let at = |i: i32| f64::from(i) / f64::from(n);
    let mut points = Vec::new();
    for x in 0..=n {
        for y in 0..=n {
            for z in 0..=n {
                let side = |i: i32| f64::from(i32::from(i == n) - i32::from(i == 0));
                let normal = DVec3::new(side(x), side(y), side(z));
                if normal != DVec3::ZERO {
                    points.push((DVec3::new(at(x), at(y), at(z)), normal));
                }
            }
        }
    }
    let given = shapes::given(points.into_iter());
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = AuditedSplat::all(&ran);
    assert!(farthest(&splats, outside_of_cube) < 1e-6);
    assert!(splats.iter().all(|s| s.up.abs().max_element() > 0.999), "{}", ran.message);
    assert_eq!(n_uncovered(&given, &[], &splats, 1e-3 * 3f64.sqrt(), 1e-6), 0);
}

#[test]
fn the_tip_of_a_cone_keeps_its_samples() {
    let given = cone(10_000);
    for tolerance in [0.03, 0.003] {
        let ran = given.run(&within(given.share(tolerance))).unwrap();
        assert_eq!(
            n_uncovered(&given, &[], &AuditedSplat::all(&ran), tolerance, 1e-6),
            0,
            "{}",
            ran.message
        );
    }
}
