//! A brush of 5,000 surfels over a cloud: `surface strokes [cpu] [SURFELS...]`, drawn as on graphics cards or on the CPU.
//!
//! For each step of a stroke, which grows as in the window: milliseconds of finding the surfels and running the tool,
//! milliseconds of the picture of what it made, and bytes that were sent for it, beside frames in which the camera alone
//! moves. And what 100 strokes take in the memory of undo.

use anyhow::{Context as _, Result, bail};
use glam::{DVec3, Vec3};
use std::time::{Duration, Instant};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Dabs, Reach, Scene, Stroke, StrokeSample, UnitKind};
use surfelshop_cloud::{Cloud, CloudDelta, CloudPart};
use surfelshop_render::{EngineOptions, GpuOptions, SurfelDrawing};
use surfelshop_runtime::plugins::LoadedUnit;
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};
use surfelshop_tests::clouds::wavy_sphere;
use surfelshop_tests::stage;

/// Surfels that a dab concerns.
const DAB: f64 = 5000.0;

/// Samples of a stroke, and strokes of the history.
const STEPS: usize = 12;
const STROKES: usize = 100;

/// Side of the pictures, pixels.
const SIZE: u32 = 720;

/// Longer than a run takes.
const LONGEST: Duration = Duration::from_secs(120);

pub(super) fn run(arguments: &[String]) -> Result<()> {
    let (surfels, arguments) = match arguments {
        [first, others @ ..] if first == "cpu" => (SurfelDrawing::Processor, others),
        // What is drawn on the CPU is sent nowhere.
        all => (SurfelDrawing::Quads, all),
    };
    let numbers: Vec<usize> = match arguments {
        [] => vec![400_000, 20_000_000],
        some => some.iter().map(|n| n.parse()).collect::<Result<_, _>>()?,
    };
    numbers.into_iter().try_for_each(|n| measure(n, surfels))
}

/// A stroke of so many samples along a circle of latitude, from a longitude on.
fn stroke(radius: f64, start: f64, samples: usize) -> Stroke {
    let sample = |i: usize| {
        let angle = start + 0.5 * radius * i as f64;
        let place = DVec3::new(angle.sin(), 0.0, angle.cos());
        StrokeSample { place, normal: Vec3::ZERO, time: 0.02 * i as f64, pressure: 1.0 }
    };
    let dabs = Dabs { reach: Reach::Volume, ..Dabs::USUAL };
    Stroke { radius, dabs, samples: (0..samples).map(sample).collect() }
}

/// The cloud after a stroke, and how many surfels it concerned.
fn led(unit: &LoadedUnit, cloud: &Cloud, stroke: &Stroke) -> Result<(Cloud, usize)> {
    let part = CloudPart::along(cloud, stroke, None)?;
    let n = part.rows.len();
    let options = ToolOptions::default();
    let mut running =
        Running::start_on(unit, &Values::new(), part, Some(stroke.clone()), &options)?;
    match running.wait(LONGEST) {
        Some(Ended::Done(done)) => Ok((done.edited.context("an edit")?.cloud, n)),
        Some(ended) => bail!("the brush failed: {:?}", ended.fault()),
        None => bail!("the brush is not done"),
    }
}

fn milliseconds(started: Instant) -> f64 {
    started.elapsed().as_secs_f64() * 1e3
}

fn measure(n: usize, surfels: SurfelDrawing) -> Result<()> {
    let cloud = wavy_sphere(n);
    // The share of the sphere that a dab covers is a quarter of the radius squared.
    let radius = 2.0 * (DAB / n as f64).sqrt();
    let brush = stage::built_unit("surfelshop_brush", UnitKind::Tool, "brush");
    let options = EngineOptions { surfels, ..EngineOptions::default() };
    let mut engine = stage::engine_with(&GpuOptions::default(), &options);
    // As in the window.
    engine.expect_edits(true);
    let mut renderer = stage::built_renderer(&engine, "surfelshop_ewa_phong", "ewa-phong");
    let scene = Scene::default();
    let mut frame = |cloud: &Cloud, step: usize| -> Result<(f64, u32, u64)> {
        let eye = DVec3::new(0.01 * step as f64, 0.2, 2.6);
        let view = stage::view(eye, DVec3::ZERO, SIZE);
        let before = engine.counters();
        let started = Instant::now();
        stage::render(&mut engine, &mut renderer, cloud, &scene, view, &[Output::Color])?;
        let (ms, after) = (milliseconds(started), engine.counters());
        let patched = after.patched_columns - before.patched_columns;
        Ok((ms, patched, after.sent_column_bytes - before.sent_column_bytes))
    };
    println!("\n{n} surfels, a brush of {DAB:.0}, pictures of {SIZE} x {SIZE}\n");
    let (first, _, bytes) = frame(&cloud, 0)?;
    println!("first picture {first:.0} ms, {bytes} bytes");
    println!(
        "| step | surfels | find and paint, ms | picture, ms | camera alone, ms | patches | bytes sent |"
    );
    println!("|---|---|---|---|---|---|---|");
    for step in 1..=STEPS {
        // What was drawn last is what the camera moves around.
        let before = led(&brush, &cloud, &stroke(radius, 0.0, step))?.0;
        frame(&before, 2 * step)?;
        let (orbit, ..) = frame(&before, 2 * step + 1)?;
        let started = Instant::now();
        let (after, concerned) = led(&brush, &cloud, &stroke(radius, 0.0, step + 1))?;
        let paint = milliseconds(started);
        let (picture, patches, bytes) = frame(&after, 2 * step + 1)?;
        println!(
            "| {step} | {concerned} | {paint:.1} | {picture:.1} | {orbit:.1} | {patches} | {bytes} |"
        );
    }
    let (mut now, mut bytes, mut concerned) = (cloud, 0, 0);
    for i in 0..STROKES {
        let (next, n) = led(&brush, &now, &stroke(radius, 2.0 * radius * i as f64, 1))?;
        let delta = CloudDelta::between(&now, &next).context("what differs")?;
        (bytes, concerned) = (bytes + delta.patch_bytes(), concerned + n);
        now = next;
    }
    println!("\n{STROKES} strokes over {concerned} surfels: {bytes} bytes of undo");
    Ok(())
}
