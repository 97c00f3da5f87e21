//! Energy, where all of it is known: inside a sphere and a box of one grey.

use crate::gi::bench::{Bench, ints, mean, point, view};
use glam::DVec3;
use surfelshop_api::params::Value;
use surfelshop_assets::cornell::{furnace_box, furnace_sphere};

const ALBEDO: f32 = 0.5;

fn sphere(n_points: usize) -> Bench {
    let cloud = furnace_sphere(n_points, ALBEDO).unwrap();
    let eye = DVec3::new(0.1, -0.2, 0.3);
    Bench::new(cloud, vec![point(DVec3::ZERO, 1.0)], view(eye, eye + DVec3::X, 1.5, 96))
}

/// Light of a lamp in the middle of a sphere is the same everywhere, and so is all that is reflected:
/// after k bounces it is rho + rho^2 + ... + rho^(k + 1) of the lamp's.
///
/// Invariant: light that bounces inside a sphere is the geometric series within 2 %, for every
/// interleaving, and a box as bright within 0.5 %
#[test]
fn a_sphere_keeps_its_energy() {
    let mut bench = sphere(40_000);
    let rho = f64::from(ALBEDO);
    for (interleaving, vpls) in [(1, 64), (2, 64), (3, 64), (4, 64), (4, 256)] {
        for bounces in 0..=4 {
            let values = ints(&[
                ("bounces", bounces),
                ("interleaving", interleaving),
                ("frames", 1),
                ("vpls", vpls),
            ]);
            let found = mean(&bench.color(&values));
            let expected: f64 = (1..=bounces as i32 + 1).map(|k| rho.powi(k)).sum();
            let off = found[1] / expected - 1.0;
            println!(
                "{vpls} lights, {interleaving} x {interleaving}, {bounces} bounces: {:.4}, off {off:.4}",
                found[1]
            );
            // What is asked of this renderer. Discs of 64 lights leave out 3.7 %, (r / 2)^2 ln(1 + (2 / r)^2)
            // at their radius r of 0.175, most of which is made up for.
            assert!(off.abs() < 0.02, "{interleaving} {bounces}: {found:?} for {expected}");
        }
    }
}

/// A box has corners, near which lights leave something out; how much does not depend on interleaving.
#[test]
fn a_box_is_as_bright_for_every_interleaving() {
    let cloud = furnace_box(40_000, ALBEDO).unwrap();
    let eye = DVec3::new(0.0, 0.1, 0.6);
    let lights = vec![point(DVec3::new(0.2, 0.3, 0.1), 1.0)];
    let mut bench = Bench::new(cloud, lights, view(eye, DVec3::new(0.1, 0.0, -1.0), 1.4, 96));
    let rendered = |bench: &mut Bench, interleaving: i64, smoothing: i64| {
        let values = ints(&[
            ("bounces", 2),
            ("interleaving", interleaving),
            ("smoothing", smoothing),
            ("compensation", 0),
            ("frames", 1),
        ]);
        mean(&bench.color(&values))[1]
    };
    let whole = rendered(&mut bench, 1, 0);
    for interleaving in [2, 4] {
        for smoothing in [0, 1, 2] {
            let found = rendered(&mut bench, interleaving, smoothing);
            println!("{interleaving}, smoothing {smoothing}: {:.5}", found / whole - 1.0);
            // What is asked of this renderer.
            assert!((found / whole - 1.0).abs() < 0.005, "{interleaving} {smoothing}");
        }
    }
}

/// Distance from the walls that meet at the nearest edge, of what a pixel of the box's picture shows.
fn from_edge(view: &surfelshop_api::View, x: usize, y: usize) -> f64 {
    let (_, direction) = view.ray(x as f64 + 0.5, y as f64 + 0.5);
    let world = view.camera.view_from_world().transpose() * direction;
    let eye = view.camera.eye;
    // The nearest of the walls at -1 and 1 that the ray comes to.
    let steps = (0..3).map(|axis| (world[axis].signum() - eye[axis]) / world[axis]);
    let hit = eye + world * steps.fold(f64::INFINITY, f64::min);
    let mut open: Vec<f64> = hit.to_array().iter().map(|at| 1.0 - at.abs()).collect();
    open.sort_by(f64::total_cmp);
    open[1]
}

/// Corners lose light by the discs that lights are; at least half of it comes back. The truth is many
/// lights that are next to points, which lose next to nothing.
#[test]
fn compensation_brings_back_half_of_what_corners_lose() {
    let cloud = furnace_box(40_000, ALBEDO).unwrap();
    let eye = DVec3::new(0.0, 0.1, 0.6);
    let lights = vec![point(DVec3::new(0.2, 0.3, 0.1), 1.0)];
    let mut bench = Bench::new(cloud, lights, view(eye, DVec3::new(0.1, 0.0, -1.0), 1.4, 64));
    let mut shown = |compensation: i64, vpls: i64, frames: i64, softening: f64| {
        let mut values = ints(&[
            ("bounces", 1),
            ("compensation", compensation),
            ("vpls", vpls),
            ("frames", frames),
            ("interleaving", 1),
            ("ism-size", 2048),
        ]);
        values.insert("softening".to_owned(), Value::Float(softening));
        values.insert("show".to_owned(), Value::Text("indirect".to_owned()));
        bench.color(&values)
    };
    let truth = shown(0, 1024, 16, 0.5);
    let [without, with] = [0, 8].map(|compensation| shown(compensation, 64, 16, 1.0));
    let view = bench.view;
    let lost = |pixels: &[[f32; 4]]| {
        let (mut found, mut whole) = (0.0, 0.0);
        for (i, (pixel, truth)) in pixels.iter().zip(&truth).enumerate() {
            if from_edge(&view, i % 64, i / 64) < 0.1 {
                found += f64::from(pixel[1]);
                whole += f64::from(truth[1]);
            }
        }
        1.0 - found / whole
    };
    let (without, with) = (lost(&without), lost(&with));
    println!("near edges {without:.4} is lost without and {with:.4} with compensation");
    assert!(without > 0.03, "{without}");
    assert!(with.abs() < 0.5 * without, "{with} of {without}");
}
