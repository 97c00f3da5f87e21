//! Creases.

use super::audit::{Drawn, n_bare};
use super::shapes::{cube, ell};
use super::*;
use std::f64::consts::TAU;

/// The largest distance from a solid of what splats do not cut off.
fn farthest(splats: &[Drawn], outside: impl Fn(DVec3) -> f64) -> f64 {
    let places = |splat: &Drawn| {
        let mut most = 0.0f64;
        for ring in 0..=20 {
            for i in 0..96 {
                let (sine, cosine) = (f64::from(i) * TAU / 96.0).sin_cos();
                let at = surfelshop_api::glam::DVec2::new(cosine, sine) * f64::from(ring) / 20.0;
                if splat.kept(at) >= 0.0 {
                    let offset = at * splat.half;
                    most = most.max(outside(
                        splat.at + splat.axes[0] * offset.x + splat.axes[1] * offset.y,
                    ));
                }
            }
        }
        most
    };
    splats.iter().map(places).fold(0.0, f64::max)
}

#[test]
fn splats_of_a_cube_end_at_its_edges() {
    let given = cube(40);
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = Drawn::all(&ran);
    println!("{}", ran.message);
    let outside = |p: DVec3| (p - p.clamp(DVec3::ZERO, DVec3::ONE)).length();
    println!("{}", farthest(&splats, outside));
    if false {for s in &splats { println!("{:?} {:?} {:?} {:.4}", s.at, s.half, s.clip, farthest(std::slice::from_ref(s), outside)); }}
    assert_eq!(n_bare(&given, &[], &splats, 1e-3 * 3f64.sqrt(), 1e-6), 0);
}

#[test]
fn splats_of_an_ell_end_at_its_edges() {
    let given = ell(40);
    let ran = given.run(&within(1e-3)).unwrap();
    let splats = Drawn::all(&ran);
    println!("{}", ran.message);
    let outside = |p: DVec3| {
        let a = p - p.clamp(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0));
        let b = p - p.clamp(DVec3::ZERO, DVec3::new(1.0, 2.0, 1.0));
        a.length().min(b.length())
    };
    println!("{}", farthest(&splats, outside));
    if false {for s in &splats { println!("{:.3?} {:.3?} {:.3?} {:.4}", s.at, s.half, s.clip, farthest(std::slice::from_ref(s), outside)); }}
    assert_eq!(n_bare(&given, &[], &splats, 1e-3 * 3f64, 1e-6), 0);
}
