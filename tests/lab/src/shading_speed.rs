//! Prints what natural light and patterns cost beside the baseline: frames of `environment`,
//! `procedural` and `ewa-phong`, taken in turns, with their shading passes alone:
//! `shading_speed CLOUD... [--probe PROBE] [--patterns]`; without `--patterns` the default alone.

use std::time::Instant;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::{self, Probe};
use surfelshop_render::{Engine, RenderRequest, RendererView};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::procedural::patterns::ALL;
use surfelshop_tests::stage;

/// Frames of each renderer.
const N_FRAMES: usize = 15;

/// Milliseconds of one frame.
struct Times {
    frame: f64,
    shading: f64,
    covered: usize,
}

/// A renderer with its parameters and the name of its shading pass.
struct Runner {
    name: String,
    pass: &'static str,
    renderer: RendererView,
    values: Values,
    times: Vec<Times>,
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let all = sorted(values);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

fn runners(engine: &Engine, patterns: &[&str]) -> Vec<Runner> {
    let runner = |name: &str, library: &str, unit: &str, pass, values| Runner {
        name: name.to_owned(),
        pass,
        renderer: stage::built_renderer(engine, library, unit),
        values,
        times: Vec::new(),
    };
    let mut all = vec![
        runner("ewa-phong", "surfelshop-ewa-phong", "ewa-phong", "phong", Values::new()),
        runner(
            "environment",
            "surfelshop-environment",
            "environment",
            "environment",
            Values::new(),
        ),
    ];
    for pattern in patterns {
        let values = [("pattern".to_owned(), Value::Text((*pattern).to_owned()))].into();
        let (library, unit) = ("surfelshop-procedural", "procedural");
        all.push(runner(pattern, library, unit, "procedural", values));
    }
    all
}

pub(crate) fn run() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(2).collect();
    let probe = match arguments.iter().position(|argument| argument == "--probe") {
        Some(at) if at + 1 < arguments.len() => {
            let probe = environment_map::read(arguments.remove(at + 1), None)?;
            arguments.remove(at);
            probe
        }
        _ => Probe::studio(),
    };
    let all = arguments.iter().position(|argument| argument == "--patterns");
    let patterns = if all.is_some() { &ALL[..] } else { &ALL[..1] };
    arguments.retain(|argument| argument != "--patterns");
    let mut engine = stage::engine();
    println!("{}, light of {}\n", engine.gpu().describe(), probe.name);
    println!("| cloud | size | renderer | shading, ms/Mpx | frame, ms | over ewa-phong | spread |");
    println!("|---|---|---|---|---|---|---|");
    for file in &arguments {
        let cloud = surfelshop_cloud::read(file, &Default::default())?.cloud;
        for size in [512, 1024] {
            let mut runners = runners(&engine, patterns);
            measure(&mut engine, &mut runners, &cloud, &probe, size)?;
            print(file.rsplit('/').next().unwrap_or(file), size, &runners);
        }
    }
    Ok(())
}

/// Draws the frames, the renderers in turns.
fn measure(
    engine: &mut Engine,
    runners: &mut [Runner],
    cloud: &Cloud,
    probe: &Probe,
    size: u32,
) -> anyhow::Result<()> {
    let environment = around(probe);
    let (_, view) = stage::hard_views(cloud, size)[0];
    let n = runners.len();
    for frame in 0..=N_FRAMES {
        for (which, runner) in runners.iter_mut().enumerate() {
            // A camera that moves a little: nothing is kept from the other renderer.
            let mut view = view;
            view.camera.eye.x *= 1.0 + 1e-9 * (n * frame + which) as f64;
            let request = RenderRequest {
                clouds: &[cloud.view()],
                facts: cloud.facts(),
                scene: &Scene::default(),
                view,
                values: &runner.values,
                outputs: &[Output::Color],
                frame_index: 0,
                environment: Some(view_of(&environment, probe)),
                stride: 1,
                detail_px: 0.0,
                parts: None,
                eye_dome: None,
            };
            let one = timed(engine, &mut runner.renderer, &request, runner.pass)?;
            // The first frames compile and filter.
            if frame > 0 {
                runner.times.push(one);
            }
        }
    }
    Ok(())
}

fn print(cloud: &str, size: u32, runners: &[Runner]) {
    let Some(baseline) = runners.first() else { return };
    let covered = baseline.times.first().map_or(0, |one| one.covered).max(1) as f64 * 1e-6;
    for runner in runners {
        let shading = median(runner.times.iter().map(|one| one.shading)) / covered;
        let frame = median(runner.times.iter().map(|one| one.frame));
        // Frames that were taken one after the other saw the same machine.
        let pairs = runner.times.iter().zip(&baseline.times);
        let ratios = sorted(pairs.map(|(one, baseline)| one.frame / baseline.frame));
        let at = |share: usize| ratios.get(ratios.len() * share / 4).copied().unwrap_or(f64::NAN);
        println!(
            "| {cloud} | {size} | {} | {shading:.1} | {frame:.1} | {:.3} | {:.3} to {:.3} |",
            runner.name,
            at(2),
            at(1),
            at(3)
        );
    }
}

fn timed(
    engine: &mut Engine,
    renderer: &mut RendererView,
    request: &RenderRequest<'_>,
    pass: &str,
) -> anyhow::Result<Times> {
    let started = Instant::now();
    let rendered = engine.render(renderer, request)?;
    let frame = started.elapsed().as_secs_f64() * 1e3;
    let found = rendered.passes.iter().find(|other| other.name == pass);
    let shading = found.and_then(|pass| pass.gpu_ms).unwrap_or(f64::NAN);
    let color = rendered.image(&Output::Color);
    let covered = color.map_or(0, |c| c.data.chunks_exact(4).filter(|p| p[3] > 0.0).count());
    Ok(Times { frame, shading, covered })
}
