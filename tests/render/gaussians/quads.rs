//! Splats as quads that the device blends: where it has no blending of 32-bit floats, and on OpenGL.
//!
//! The other tests hold quads against the formulas like every other way. Blending into 16-bit floats rounds once for
//! each splat, by 2^-10 of what is there at most (2^-11 where the device rounds to the nearest); those before it let so
//! much of that through as they let through of the splat itself. So a pixel is off by 2^-10 of the brightest colour
//! times the sum over splats of what is let through to each.

use super::agreement::{at, views};
use super::reference::{self, Kind, Pixel};
use super::scripted::{self, one, refused};
use super::stage::{self, Gaussians};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::prelude::*;
use surfelshop_render::{Backend, Engine, EngineOptions, Gpu, GpuOptions, Rendered, SurfelDrawing};
use surfelshop_tests::stage::engine_with;

const CLASSIC: Kind = Kind::Space { low_pass: 0.3, keeps_sum: false };

/// What a splat of the CPU's ways rounds by, and eleven bits of spherical harmonics: those of the other tests.
const ROUNDING: f64 = 1e-3;

/// An engine that draws quads on a device without blending of 32-bit floats.
fn without_float_blending() -> Engine {
    let mut gpu = Gpu::headless(&GpuOptions::default()).unwrap();
    gpu.blends_f32 = false;
    Engine::new(gpu, &quads()).unwrap()
}

fn quads() -> EngineOptions {
    EngineOptions { surfels: SurfelDrawing::Quads, ..EngineOptions::default() }
}

fn compute() -> Engine {
    let options = EngineOptions { surfels: SurfelDrawing::Compute, ..EngineOptions::default() };
    engine_with(&GpuOptions::default(), &options)
}

fn opengl(surfels: SurfelDrawing) -> Engine {
    let gpu = GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() };
    engine_with(&gpu, &EngineOptions { surfels, ..EngineOptions::default() })
}

fn drawn(engine: &mut Engine, all: &Gaussians, view: View, values: &Values) -> Rendered {
    let mut renderer = stage::renderer(engine, "gaussians");
    let (cloud, outputs) = (all.cloud(), [Output::Color]);
    stage::frame(engine, &mut renderer, &[&cloud], view, values, &outputs).unwrap()
}

/// Whether quads were blended, as the names of passes say.
fn blended(frame: &Rendered) -> bool {
    frame.passes.iter().any(|pass| pass.name == "host: splats, blend quads")
}

/// Sums over splats against those of the formulas, by the bound above.
fn sums_agree(what: &str, frame: &Rendered, expected: &[Pixel]) {
    assert!(blended(frame), "{what}: {:?}", frame.passes);
    let found = stage::pixels(frame, &Output::Color);
    let share = |(found, pixel): (&[f32; 4], &Pixel)| {
        let bound = 2f64.powi(-10) * pixel.layers + ROUNDING;
        let of_color = |k: usize| {
            let off = f64::from(found[k]) - stage::encoded(pixel.color[k]);
            off.abs() / (bound * pixel.brightest.max(1.0))
        };
        let coverage = (f64::from(found[3]) - pixel.color[3]).abs() / bound;
        (0..3).map(of_color).fold(coverage, f64::max)
    };
    let mut shares: Vec<f64> = found.iter().zip(expected).map(share).collect();
    shares.sort_by(f64::total_cmp);
    let line = format!(
        "{what}: off by {:.2}, {:.2} and {:.2} of the bound (half, 99 %, all of the pixels)",
        at(&shares, 0.5),
        at(&shares, 0.99),
        at(&shares, 1.0)
    );
    stage::say(&line);
    // Where rounding decides whether 1/255 counts, a pixel may be off by as much.
    assert!(at(&shares, 0.99) < 1.0 && at(&shares, 1.0) < 5.0, "{line}");
}

/// Costs 1 s.
#[test]
fn blending_of_16_bits_stays_within_what_it_rounds() {
    let all = Gaussians::generated(2500);
    let linear = stage::values(&[("space", stage::text("linear"))]);
    let mut engine = without_float_blending();
    for (name, view) in [views()[1], views()[3]] {
        let expected = reference::draw(&all, &view, CLASSIC, 3);
        sums_agree(name, &drawn(&mut engine, &all, view, &linear), &expected);
    }
}

/// What is told of depths needs 32 bits: the CPU composes it, as well as everywhere. Costs 0.5 s.
#[test]
fn depths_are_not_blended_with_16_bits() {
    let all = Gaussians::generated(500);
    let (cloud, view) = (all.cloud(), views()[1].1);
    let outputs = [Output::Depth, stage::expected_depth()];
    let processor = EngineOptions { surfels: SurfelDrawing::Processor, ..quads() };
    let of = |mut engine: Engine| {
        let mut renderer = stage::renderer(&engine, "gaussians");
        let none = Values::new();
        stage::frame(&mut engine, &mut renderer, &[&cloud], view, &none, &outputs).unwrap()
    };
    let found = of(without_float_blending());
    assert!(!blended(&found), "{:?}", found.passes);
    let by_cpu = of(engine_with(&GpuOptions::default(), &processor));
    stage::equal_bits(&by_cpu, &found, "depths");
}

/// Neither sorts nor draws into 32-bit floats there: the CPU sorts. Costs 2 s.
///
/// Invariant: software OpenGL draws Gaussians, composed by the CPU or as quads
#[test]
fn opengl_draws_gaussians() {
    let all = Gaussians::generated(1500);
    let linear = stage::values(&[("space", stage::text("linear"))]);
    let (name, view) = views()[1];
    let expected = reference::draw(&all, &view, CLASSIC, 3);
    let mut engine = opengl(SurfelDrawing::Quads);
    let frame = drawn(&mut engine, &all, view, &linear);
    sums_agree(&format!("OpenGL {name}"), &frame, &expected);
    for blend in ["additive", "nearest", "stochastic", "normalized"] {
        let pairs = [("space", stage::text("linear")), ("blend", stage::text(blend))];
        let values = stage::values(&pairs);
        let [a, b] = [&mut engine, &mut opengl(SurfelDrawing::Processor)]
            .map(|engine| stage::pixels(&drawn(engine, &all, view, &values), &Output::Color));
        let off = |(a, b): (&[f32; 4], &[f32; 4])| {
            (0..4).map(|k| f64::from(a[k] - b[k]).abs()).fold(0f64, f64::max)
        };
        let mut off: Vec<f64> = a.iter().zip(&b).map(off).collect();
        off.sort_by(f64::total_cmp);
        let line = format!("OpenGL {blend}: {:.1e}, {:.1e}", at(&off, 0.5), at(&off, 0.99));
        stage::say(&line);
        // Nothing rounds where the nearest is taken; sums are of 16 bits, of up to 30 splats.
        let most = if matches!(blend, "nearest" | "stochastic") { 1e-5 } else { 0.1 };
        assert!(at(&off, 0.5) < 0.01 && at(&off, 0.99) < most, "{line}");
    }
}

/// Adds a pass of `n` splats whose function of pixels fades them out from left to right.
fn faded(graph: &mut Graph, n: u64, composition: Composition) -> Pass {
    let pass = one("splats", n).per_pixel("faded").composed(composition);
    let faded = "fn faded(p: splat::Pixel) -> splat::Fragment {
        var f = splat::Fragment(p.opacity * (1.0 - p.pixel.x / 16.0), p.payload);
        f.payload[0] *= vec4(p.pixel.y / 16.0, 1.0, 1.0, 1.0);
        return f;
    }";
    let sums = graph.texture("sums", Texture::view_sized(Format::Rgba32Float));
    graph.output(Output::Color, sums);
    let wgsl = format!("{}\n{faded}", pass.wgsl);
    Pass { wgsl, ..pass }.target(sums)
}

/// As Vulkan does, tile by tile. Costs 1 s.
#[test]
fn opengl_calls_functions_of_pixels() {
    let cloud = Gaussians::generated(3).cloud();
    for composition in [
        Composition::Over,
        Composition::Additive,
        Composition::Nearest,
        Composition::Stochastic { samples: 8 },
        Composition::Normalized { tolerance: 0.6 },
    ] {
        let engines = [opengl(SurfelDrawing::Quads), opengl(SurfelDrawing::Processor)];
        let mut pictures = engines.into_iter().chain([compute()]).map(|mut engine| {
            let described = move |_: &_, graph: &mut Graph| {
                let pass = faded(graph, 3, composition);
                graph.pass(pass);
            };
            let frame = scripted::drawn(&mut engine, &[&cloud], described).unwrap();
            let lists = frame.passes.iter().any(|pass| pass.name == "host: splats, compose");
            (stage::pixels(&frame, &Output::Color), lists)
        });
        let [quads, processor, lists] = [(); 3].map(|()| pictures.next().unwrap());
        assert!(lists.1 && lists.0.iter().any(|pixel| pixel[3] > 0.2), "{composition:?}");
        for (found, by_lists) in [quads, processor] {
            assert!(!by_lists, "{composition:?}");
            let off = found.as_flattened().iter().zip(lists.0.as_flattened());
            // Blending may be of 16 bits.
            let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(off < 2e-3, "{composition:?}: off by {off}");
        }
    }
}

/// Costs 0.3 s.
#[test]
fn what_neither_blends_nor_lists_is_refused_by_a_line() {
    let cloud = Gaussians::generated(3).cloud();
    let mut gpu =
        Gpu::headless(&GpuOptions { backend: Some(Backend::Gl), ..GpuOptions::default() }).unwrap();
    gpu.blends_f32 = false;
    let mut engine = Engine::new(gpu, &quads()).unwrap();
    let words = ["pass `splats`", "OpenGL", "`faded`", "per_pixel", "depths"];
    refused(&mut engine, &[&cloud], &words, |_, graph| {
        let depth = graph.texture("depth", Texture::view_sized(Format::R32Float));
        let pass = faded(graph, 1, Composition::Over);
        graph.pass(pass.depth(SplatDepth::Expected, depth));
    });
}

/// Every composition, with all depths, of splats of hard sizes. Costs 2 s.
#[test]
fn quads_of_hard_sizes_are_finite() {
    let mut all = Gaussians::default();
    let sizes = [0.0, 1e-38, 1e-4, 0.1, 10.0, 1e18, 1e30];
    for (k, size) in (0..).zip(sizes.iter().cycle().take(140)) {
        let place = glam::Vec3::new((k as f32).sin(), (2.0 * k as f32).sin(), 0.01 * k as f32);
        let turn = glam::Quat::from_rotation_x(k as f32);
        all.push(place, [*size, 0.1, 0.02], turn, 0.9, [0.3, -0.2, 1e30]);
    }
    let cloud = all.cloud();
    let mut engine = engine_with(&GpuOptions::default(), &quads());
    for unit in stage::UNITS {
        let mut renderer = stage::renderer(&engine, unit);
        for blend in ["sorted", "stochastic", "additive", "nearest", "normalized"] {
            let values = stage::values(&[("blend", stage::text(blend))]);
            let mut outputs = stage::outputs().to_vec();
            if unit == "gaussians-2d" {
                outputs.push(stage::distortion());
            }
            for (name, view) in [views()[1], views()[3]] {
                let frame =
                    stage::frame(&mut engine, &mut renderer, &[&cloud], view, &values, &outputs);
                stage::all_finite(&frame.unwrap(), &format!("{unit} {blend} {name}"));
            }
        }
    }
}
