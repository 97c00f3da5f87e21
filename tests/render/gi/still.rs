//! Views at rest: frames add up, and those that begin anew forget.

use crate::gi::bench::{Bench, ints, pixels, view};
use glam::{DVec3, Vec3};
use surfelshop_api::Light;
use surfelshop_api::graph::Output;
use surfelshop_assets::cornell::cornell_box;

fn bench() -> Bench {
    let (position, target) = (DVec3::new(-0.7, 0.9, 0.85), DVec3::new(0.25, -0.9, -0.1));
    let spot =
        Light::Spot { position, target, intensity: Vec3::splat(5.0), angle: 0.66, softness: 0.35 };
    let view = view(DVec3::new(0.0, 0.3, 4.4), DVec3::new(0.0, -0.05, 0.0), 0.61, 64);
    Bench::new(cornell_box(20_000).unwrap(), vec![spot], view)
}

fn distance(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn frames_come_nearer_to_what_many_show() {
    let mut bench = bench();
    let mut of = |frames: i64| bench.color(&ints(&[("frames", frames), ("vpls", 64)]));
    let truth = of(64);
    let far: Vec<f64> = [1, 4, 16].map(|frames| distance(&of(frames), &truth)).into();
    println!("{far:?}");
    assert!(far[1] < 0.8 * far[0] && far[2] < 0.8 * far[1], "{far:?}");
}

#[test]
fn a_new_beginning_forgets_what_was_added_up() {
    let mut bench = bench();
    let values = ints(&[("frames", 8), ("vpls", 64)]);
    let first = pixels(&bench.frame(&values, 0, &[Output::Color]), &Output::Color);
    for index in 1..4 {
        let rendered = bench.frame(&values, index, &[Output::Color]);
        assert!(rendered.wants_another_frame);
        assert_ne!(pixels(&rendered, &Output::Color), first);
    }
    assert_eq!(pixels(&bench.frame(&values, 0, &[Output::Color]), &Output::Color), first);
    assert!(!bench.frame(&values, 7, &[Output::Color]).wants_another_frame);
}
