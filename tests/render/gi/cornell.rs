//! Light between the walls of a room.

use crate::gi::bench::{Bench, ints, mean, point, view};
use glam::{DVec3, Vec3};
use surfelshop_api::Light;
use surfelshop_assets::cornell::{cornell_box, empty_box};

fn spot() -> Light {
    let (position, target) = (DVec3::new(-0.7, 0.9, 0.85), DVec3::new(0.25, -0.9, -0.1));
    Light::Spot { position, target, intensity: Vec3::splat(5.0), angle: 0.66, softness: 0.35 }
}

fn ahead() -> surfelshop_api::View {
    view(DVec3::new(0.0, 0.3, 4.4), DVec3::new(0.0, -0.05, 0.0), 0.61, 96)
}

/// Each bounce adds less than the one before: what is reflected of it is at most the brightest wall's
/// albedo, of what does not leave through the open side.
#[test]
fn bounces_add_less_and_less() {
    let mut bench = Bench::new(cornell_box(40_000).unwrap(), vec![spot()], ahead());
    let lit: Vec<f64> = (0..=4)
        .map(|bounces| mean(&bench.color(&ints(&[("bounces", bounces), ("frames", 4)])))[1])
        .collect();
    let added: Vec<f64> = lit.windows(2).map(|pair| pair[1] - pair[0]).collect();
    println!("{lit:?} adds {added:?}");
    assert!(added[0] > 0.1 * lit[0], "{added:?}");
    for pair in added.windows(2) {
        assert!(pair[1] > 0.0 && pair[1] < 0.75 * pair[0], "{added:?}");
    }
}

/// Red and green walls colour what they light.
#[test]
fn walls_color_each_other() {
    let mut bench = Bench::new(empty_box(40_000).unwrap(), vec![point(DVec3::ZERO, 1.0)], ahead());
    let values = ints(&[("bounces", 1), ("frames", 4)]);
    let pixels = bench.color(&values);
    // On the back wall, beside the left and the right wall.
    let at = |x: usize, y: usize| pixels[96 * y + x];
    let redness = |pixel: [f32; 4]| pixel[0] / pixel[1];
    let (left, right) = (redness(at(26, 48)), redness(at(69, 48)));
    println!("{left} {right}");
    assert!(left > 1.03 * right, "{left} {right}");
}

/// What is shown in parts adds up to the whole.
#[test]
fn direct_and_indirect_light_make_the_whole() {
    let mut bench = Bench::new(cornell_box(20_000).unwrap(), vec![spot()], ahead());
    let shown = |bench: &mut Bench, show: &str| {
        let mut values = ints(&[("frames", 2), ("compensation", 0)]);
        let choice = surfelshop_api::params::Value::Text(show.to_owned());
        values.insert("show".to_owned(), choice);
        bench.color(&values)
    };
    let [all, direct, indirect] = ["all", "direct", "indirect"].map(|s| shown(&mut bench, s));
    for ((all, direct), indirect) in all.iter().zip(&direct).zip(&indirect) {
        for channel in 0..3 {
            // Sums of two floats.
            let sum = direct[channel] + indirect[channel];
            assert!((all[channel] - sum).abs() <= 1e-6 * sum.max(1e-6), "{all:?} {sum}");
        }
    }
}
