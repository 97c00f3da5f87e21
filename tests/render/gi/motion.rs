//! A lamp and a camera that move: how much pictures of neighbouring moments differ.

use crate::gi::bench::{Bench, ints, view};
use glam::{DVec3, Vec3};
use surfelshop_api::Light;
use surfelshop_api::params::{Value, Values};
use surfelshop_assets::cornell::cornell_box;

fn lamp(x: f64) -> Light {
    let (position, target) = (DVec3::new(x, 0.9, 0.85), DVec3::new(x + 0.9, -0.9, -0.1));
    Light::Spot { position, target, intensity: Vec3::splat(5.0), angle: 0.66, softness: 0.35 }
}

fn ahead(x: f64) -> surfelshop_api::View {
    view(DVec3::new(x, 0.3, 4.4), DVec3::new(0.0, -0.05, 0.0), 0.61, 96)
}

/// What a window shows while something is dragged: one frame, of what was reflected before or `direct`.
fn moving(show: &str) -> Values {
    let mut values = ints(&[("frames", 1), ("vpls", 64), ("bounces", 2), ("interleaving", 4)]);
    values.insert("show".to_owned(), Value::Text(show.to_owned()));
    values
}

/// Mean difference of the pixels that both show, and the difference that one of a hundred of them
/// exceeds, over their mean.
fn changes(a: &[[f32; 4]], b: &[[f32; 4]]) -> [f64; 2] {
    let both = a.iter().zip(b).filter(|(a, b)| a[3] > 0.0 && b[3] > 0.0);
    let (mut differences, mut sum) = (Vec::new(), 0.0);
    for (a, b) in both {
        differences.push(f64::from((a[1] - b[1]).abs()));
        sum += f64::from(0.5 * (a[1] + b[1]));
    }
    differences.sort_by(f64::total_cmp);
    let n = differences.len();
    let mean = sum / n as f64;
    let of_all = differences.iter().sum::<f64>() / n as f64;
    [of_all / mean, differences[n - n / 100 - 1] / mean]
}

/// Steps of a hundredth of the room's width, as from a slow drag. Lights move with the lamp, since the
/// points that they come from stay; what jumps is a light that falls behind an edge, or another surfel
/// that a ray meets. The bounds are twice what was seen.
///
/// Invariant: pictures of a lamp that moves differ from frame to frame within bounds, and what
/// is drawn coarsely meanwhile is about as bright
#[test]
fn a_moving_lamp_does_not_flicker() {
    let mut bench = Bench::new(cornell_box(40_000).unwrap(), vec![lamp(-0.7)], ahead(0.0));
    let mut worst = [0.0f64; 2];
    let mut before = bench.color(&moving("indirect"));
    for step in 1..=12 {
        bench.scene.lights = vec![lamp(-0.7 + 0.02 * f64::from(step))];
        let now = bench.color(&moving("indirect"));
        let found = changes(&before, &now);
        println!("step {step}: {:.4} {:.4}", found[0], found[1]);
        worst = [worst[0].max(found[0]), worst[1].max(found[1])];
        before = now;
    }
    println!("lamp: worst mean {:.4}, worst of the hundredth {:.4}", worst[0], worst[1]);
    assert!(worst[0] < 0.15 && worst[1] < 1.0, "{worst:?}");
}

/// Lights belong to the lamp, so that a moving camera leaves them where they are.
#[test]
fn a_moving_camera_does_not_flicker() {
    let mut bench = Bench::new(cornell_box(40_000).unwrap(), vec![lamp(-0.7)], ahead(0.0));
    let mean_of = |pixels: &[[f32; 4]]| crate::gi::bench::mean(pixels)[1];
    let mut before = bench.color(&moving("indirect"));
    let mut worst = [0.0f64; 3];
    for step in 1..=12 {
        bench.view = ahead(0.005 * f64::from(step));
        let now = bench.color(&moving("indirect"));
        let found = changes(&before, &now);
        let brighter = (mean_of(&now) / mean_of(&before) - 1.0).abs();
        println!("step {step}: {:.4} {:.4}, as a whole {brighter:.4}", found[0], found[1]);
        worst = [worst[0].max(found[0]), worst[1].max(found[1]), worst[2].max(brighter)];
        before = now;
    }
    println!("camera: {worst:?}");
    // Twice what was seen; single pixels change where a disc's edge passes them.
    assert!(worst[0] < 0.03 && worst[1] < 0.5 && worst[2] < 0.01, "{worst:?}");
}

/// How bright what no lamp lights is where less is drawn, over what one lights.
fn light_in_shadows(whole: &[[f32; 4]], now: &[[f32; 4]]) -> f64 {
    let mean = crate::gi::bench::mean(whole)[1] as f32;
    let both = whole.iter().zip(now).filter(|(whole, now)| whole[3] > 0.0 && now[3] > 0.0);
    let (dark, lit): (Vec<_>, Vec<_>) = both.partition(|(whole, _)| whole[1] < 0.05 * mean);
    let bright = |of: &[(&[f32; 4], &[f32; 4])]| {
        of.iter().map(|(_, now)| f64::from(now[1])).sum::<f64>() / of.len().max(1) as f64
    };
    assert!(dark.len() > 500 && lit.len() > 500);
    bright(&dark) / bright(&lit)
}

/// Where a window draws less, lamps and lights see less, too: what is lit stays about as bright, and shadows
/// of lamps stay where they are. The bounds are about twice what was seen.
#[test]
fn what_is_drawn_coarsely_in_motion_is_as_bright() {
    let mut bench = Bench::new(cornell_box(40_000).unwrap(), vec![lamp(-0.7)], ahead(0.0));
    let mut drawn = |show, stride| {
        bench.stride = stride;
        bench.color(&moving(show))
    };
    let whole = ["indirect", "direct"].map(|show| drawn(show, 1));
    for stride in [2, 4, 8, 16, 32, 64] {
        let now = ["indirect", "direct"].map(|show| drawn(show, stride));
        let brightness = |i: usize| {
            crate::gi::bench::mean(&now[i])[1] / crate::gi::bench::mean(&whole[i])[1] - 1.0
        };
        let (off, shadows) = ([0, 1].map(brightness), light_in_shadows(&whole[1], &now[1]));
        println!("1 surfel of {stride}: {off:.4?}, light in shadows {shadows:.4}");
        assert!(off.iter().all(|off| off.abs() < 0.15), "1 surfel of {stride}: {off:?}");
        assert!(shadows < 0.025, "1 surfel of {stride}: {shadows}");
    }
}
