//! Prints what natural light costs beside the baseline: frames of `environment` and `ewa-phong`,
//! taken in turns, with their shading passes alone: `shading_speed CLOUD... [--probe PROBE]`.

#![allow(clippy::print_stdout, reason = "a program that prints a table")]

use std::time::Instant;
use surfelshop_api::Scene;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_cloud::probe::{self, Probe};
use surfelshop_engine::{Engine, RenderRequest, RendererView};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::stage;

/// Frames of each renderer.
const N_FRAMES: usize = 15;

/// Milliseconds of one frame.
struct Times {
    frame: f64,
    shading: f64,
    covered: usize,
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let probe = match arguments.iter().position(|argument| argument == "--probe") {
        Some(at) if at + 1 < arguments.len() => {
            let probe = probe::read(arguments.remove(at + 1), None)?;
            arguments.remove(at);
            probe
        }
        _ => Probe::studio(),
    };
    let environment = around(&probe);
    let mut engine = stage::engine();
    println!("{}, light of {}\n", engine.gpu().describe(), probe.name);
    println!(
        "| cloud | size | shading ewa-phong | environment | frame ewa-phong | environment | ratio |"
    );
    println!("|---|---|---|---|---|---|---|");
    for file in &arguments {
        let cloud = surfelshop_cloud::read(file, &Default::default())?.cloud;
        for size in [512, 1024] {
            let (_, view) = stage::hard_views(&cloud, size)[0];
            let mut renderers: Vec<(&str, RendererView)> = vec![
                ("phong", stage::built_renderer(&engine, "surfelshop-ewa-phong", "ewa-phong")),
                (
                    "environment",
                    stage::built_renderer(&engine, "surfelshop-environment", "environment"),
                ),
            ];
            let mut times: [Vec<Times>; 2] = [Vec::new(), Vec::new()];
            for frame in 0..=N_FRAMES {
                for (which, (pass, renderer)) in renderers.iter_mut().enumerate() {
                    // A camera that moves a little: nothing is kept from the other renderer.
                    let mut view = view;
                    view.camera.eye.x *= 1.0 + 1e-9 * (2 * frame + which) as f64;
                    let request = RenderRequest {
                        clouds: &[cloud.view()],
                        facts: cloud.facts(),
                        scene: &Scene::default(),
                        view,
                        values: &Values::new(),
                        outputs: &[Output::Color],
                        frame_index: 0,
                        environment: Some(view_of(&environment, &probe)),
                        stride: 1,
                    };
                    let one = timed(&mut engine, renderer, &request, pass)?;
                    // The first frames compile and filter.
                    if frame > 0 {
                        times[which].push(one);
                    }
                }
            }
            let covered = times[0].first().map_or(0, |one| one.covered).max(1) as f64 * 1e-6;
            let shading = |i: usize| median(times[i].iter().map(|one| one.shading)) / covered;
            let frame = |i: usize| median(times[i].iter().map(|one| one.frame));
            println!(
                "| {} | {size} | {:.1} ms/Mpx | {:.1} ms/Mpx | {:.1} ms | {:.1} ms | {:.3} |",
                file.rsplit('/').next().unwrap_or(file),
                shading(0),
                shading(1),
                frame(0),
                frame(1),
                frame(1) / frame(0)
            );
        }
    }
    Ok(())
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
