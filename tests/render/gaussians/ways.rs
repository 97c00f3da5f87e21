//! What the CPU, and the device in two ways, make of the same splats, where chance or a mean composes them, and how far apart splats are.
//!
//! Chance takes the same numbers in all ways, so that a pixel differs only where the rounding of an exponent decides
//! whether a try counts: of 6,300 pixels with 16 tries and about 20 splats each that may happen to a few.

use super::agreement::{at, views};
use super::reference::{self, How, Kind, Pixel};
use super::scripted::{SIZE, drawn, one};
use super::stage::{self, Gaussians};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::prelude::*;
use surfelshop_render::{EngineOptions, GpuOptions, Rendered, SurfelDrawing};
use surfelshop_tests::stage::{each_way, engine, engine_with};

/// A frame as the CPU composes it, as the device does tile by tile, and as quads.
fn each(
    all: &Gaussians,
    unit: &str,
    view: View,
    values: &Values,
    outputs: &[Output],
) -> [Rendered; 3] {
    let cloud = all.cloud();
    [SurfelDrawing::Processor, SurfelDrawing::Compute, SurfelDrawing::Quads].map(|surfels| {
        let options = EngineOptions { surfels, ..EngineOptions::default() };
        let mut engine = engine_with(&GpuOptions::default(), &options);
        let mut renderer = stage::renderer(&engine, unit);
        stage::frame(&mut engine, &mut renderer, &[&cloud], view, values, outputs).unwrap()
    })
}

/// Costs 2 s.
#[test]
fn chance_falls_alike_in_all_ways() {
    let all = Gaussians::generated(2500);
    for unit in stage::UNITS {
        let values = stage::values(&[
            ("blend", stage::text("stochastic")),
            ("samples", Value::Int(16)),
            ("space", stage::text("linear")),
        ]);
        for (name, view) in [views()[1], views()[3]] {
            let [a, b, c] = each(&all, unit, view, &values, &[Output::Color])
                .map(|frame| stage::pixels(&frame, &Output::Color));
            let off = |(a, b): (&[f32; 4], &[f32; 4])| {
                (0..4).map(|k| (a[k] - b[k]).abs()).fold(0f32, f32::max)
            };
            for (way, b) in [("tiles", &b), ("quads", &c)] {
                let off: Vec<f32> = a.iter().zip(b).map(off).collect();
                let over = |bound: f32| off.iter().filter(|d| **d > bound).count();
                let line = format!(
                    "{unit} {name} {way}: of {} pixels {} differ, {} by more than 1e-5",
                    off.len(),
                    over(0.0),
                    over(1e-5)
                );
                stage::say(&line);
                assert!(over(1e-5) * 400 < off.len(), "{line}");
            }
        }
    }
}

/// Software drivers end loops after so many iterations; a third of these are as many. Costs 2 s.
///
/// Invariant: lists of splats that are longer than a driver's loops are gone through to their end
#[test]
fn long_lists_are_gone_through_to_their_end() {
    let cases = [(Composition::Additive, 200_000), (Composition::Stochastic { samples: 64 }, 3000)];
    for ((composition, n), is_per_pixel) in cases.into_iter().flat_map(|c| [(c, false), (c, true)])
    {
        each_way(|| {
            let frame = drawn(&mut engine(), &[], move |_, graph| {
                let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
                let pass = one("splats", n).composed(composition).target(sums);
                graph.pass(if is_per_pixel { pass.per_pixel("same") } else { pass });
                graph.output(Output::Color, sums);
            });
            let sums = stage::pixels(&frame.unwrap(), &Output::Color);
            let middle = sums[(SIZE * SIZE / 2 + SIZE / 2) as usize];
            // At half a pixel from the middle in both directions; no opacity is above 0.99.
            let opacity = 0.99f64.min((-0.5 * 0.1 * 0.5f64).exp());
            let expected = match composition {
                Composition::Additive => n as f64 * opacity,
                _ => 1.0,
            };
            // Sums of so many equal numbers in f32 are off by less.
            assert!(
                (f64::from(middle[0]) / expected - 1.0).abs() < 0.01,
                "{composition:?}, function of pixels {is_per_pixel}: {middle:?}, expected {expected}"
            );
        });
    }
}

/// Costs 3 s.
#[test]
fn means_look_as_the_formulas_say_in_all_ways() {
    let all = Gaussians::generated(2500);
    let cloud = all.cloud();
    let tolerance = 0.05f32;
    let values = stage::values(&[
        ("blend", stage::text("normalized")),
        ("tolerance", Value::Float(f64::from(tolerance))),
    ]);
    let classic = Kind::Space { low_pass: 0.3, keeps_sum: false };
    for (unit, kind) in [("gaussians", classic), ("gaussians-2d", Kind::Plane)] {
        let how = How::Mean(f64::from(tolerance));
        let drawn = [views()[1], views()[3], views()[5]];
        let expected = drawn
            .map(|(_, view)| reference::colors(&reference::draw_as(&all, &view, kind, 3, how)));
        each_way(|| {
            let mut engine = engine();
            let mut renderer = stage::renderer(&engine, unit);
            for ((name, view), expected) in drawn.iter().zip(&expected) {
                let (clouds, outputs) = ([&cloud], [Output::Color]);
                let frame =
                    stage::frame(&mut engine, &mut renderer, &clouds, *view, &values, &outputs);
                let found = stage::pixels(&frame.unwrap(), &Output::Color);
                means_agree(&format!("{unit} {name}"), &found, expected);
            }
        });
    }
}

/// Where rounding decides whether a splat is half opaque, or near enough, a pixel shows other splats: such are few.
fn means_agree(what: &str, found: &[[f32; 4]], expected: &[[f64; 4]]) {
    let covered = expected.iter().filter(|pixel| pixel[3] > 0.1).count();
    assert!(10 * covered > expected.len(), "{what}: something is seen");
    assert!(found.iter().all(|pixel| pixel[3] <= 1.000_001), "{what}: no more than all is covered");
    let off = |(found, expected): (&[f32; 4], &[f64; 4])| {
        let [a, b] = [found.map(f64::from), *expected];
        (0..4).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
    };
    let mut off: Vec<f64> = found.iter().zip(expected).map(off).collect();
    off.sort_by(f64::total_cmp);
    let line = format!(
        "{what}: means off by {:?}",
        [0.5, 0.99, 0.997, 1.0].map(|share| format!("{:.1e}", at(&off, share)))
    );
    stage::say(&line);
    assert!(at(&off, 0.5) < 1e-4 && at(&off, 0.99) < 2e-3, "{line}");
}

/// Costs 3 s.
#[test]
fn distortion_is_what_the_paper_says_in_all_ways() {
    let all = Gaussians::generated(2500);
    let cloud = all.cloud();
    let drawn = [views()[1], views()[3], views()[5]];
    let expected = drawn.map(|(_, view)| reference::draw(&all, &view, Kind::Plane, 0));
    each_way(|| {
        let mut engine = engine();
        let mut renderer = stage::renderer(&engine, "gaussians-2d");
        for ((name, view), expected) in drawn.iter().zip(&expected) {
            let (none, outputs) = (Values::new(), [stage::distortion()]);
            let frame = stage::frame(&mut engine, &mut renderer, &[&cloud], *view, &none, &outputs);
            let frame = frame.unwrap();
            let found = stage::firsts(frame.image(&stage::distortion()).unwrap());
            distortions_agree(name, &found, expected);
        }
    });
}

/// What is left out behind 0.9999 of the light lies at most 3 behind the rest.
fn distortions_agree(name: &str, found: &[f32], expected: &[Pixel]) {
    let counts = expected.iter().filter(|pixel| pixel.distortion > 1e-3).count();
    assert!(5 * counts > expected.len(), "{name}: of {} pixels {counts} count", expected.len());
    let off = |(found, pixel): (&f32, &Pixel)| {
        (f64::from(*found) - pixel.distortion).abs() / (pixel.distortion + 0.1)
    };
    let mut off: Vec<f64> = found.iter().zip(expected).map(off).collect();
    off.sort_by(f64::total_cmp);
    let most = expected.iter().map(|pixel| pixel.distortion).fold(0.0, f64::max);
    let line = format!(
        "{name}: distortion up to {most:.3} off by {:?} of it and 0.1",
        [0.5, 0.99, 1.0].map(|share| format!("{:.1e}", at(&off, share)))
    );
    stage::say(&line);
    assert!(at(&off, 0.5) < 1e-5 && at(&off, 0.99) < 2e-3, "{line}");
    let nothing = expected.iter().zip(found).filter(|(pixel, _)| pixel.color[3] == 0.0);
    assert!(nothing.into_iter().all(|(_, found)| *found == 0.0), "{name}: nothing is not apart");
}
