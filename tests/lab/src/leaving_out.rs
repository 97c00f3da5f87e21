//! Prints what leaving out saves, feature by feature: frames without it and with it as it changes
//! nothing, in turns: `leaving_out [CLOUD] [--frames N] [--size N]`; without a cloud, the sample.

use anyhow::{Context as _, bail};
use glam::{DVec3, Vec3};
use std::time::Instant;
use surfelshop_api::columns::{AO, COLOR, MATERIAL, RADIUS};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Light, Scene, View};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::{
    Engine, EngineOptions, GpuOptions, PassState, RenderRequest, Rendered, RendererView, Restored,
    SurfelDrawing,
};
use surfelshop_tests::natural_light::{around, view_of};
use surfelshop_tests::stage;

/// A scene with a renderer.
#[derive(Clone)]
struct AblationImage {
    renderer: (&'static str, &'static str),
    cloud: Cloud,
    scene: Scene,
    view: View,
    values: Values,
    probe: Option<Probe>,
    outputs: Vec<Output>,
    kept: Vec<Restored>,
}

/// A shot being drawn.
struct Side {
    shot: AblationImage,
    engine: Engine,
    renderer: RendererView,
}

impl Side {
    fn new(shot: AblationImage, surfels: SurfelDrawing) -> Self {
        // As on a graphics card.
        let constant_radii = Some(true);
        let options = EngineOptions { surfels, constant_radii, ..EngineOptions::default() };
        let mut engine = stage::engine_with(&GpuOptions::default(), &options);
        engine.keep(shot.kept.clone());
        let renderer = stage::built_renderer(&engine, shot.renderer.0, shot.renderer.1);
        Self { shot, engine, renderer }
    }

    fn draw(&mut self) -> anyhow::Result<(Rendered, f64)> {
        let environment = self.shot.probe.as_ref().map(around);
        let given = self.shot.probe.as_ref().zip(environment.as_ref());
        let clouds = [self.shot.cloud.view()];
        let request = RenderRequest {
            clouds: &clouds,
            facts: self.shot.cloud.facts(),
            scene: &self.shot.scene,
            view: self.shot.view,
            environment: given.map(|(probe, environment)| view_of(environment, probe)),
            values: &self.shot.values,
            outputs: &self.shot.outputs,
            frame_index: 0,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        };
        self.engine.forget_surfaces();
        let started = Instant::now();
        let rendered = self.engine.render(&mut self.renderer, &request)?;
        Ok((rendered, started.elapsed().as_secs_f64() * 1e3))
    }

    /// Bytes of columns, environment and graph; pipelines; passes that ran.
    fn takes(&self, rendered: &Rendered) -> [i64; 3] {
        let counters = self.engine.counters();
        let columns = counters.column_bytes + counters.host_column_bytes;
        let bytes = columns + counters.environment_bytes + rendered.graph_bytes;
        let ran = rendered.passes.iter().filter(|pass| pass.state != PassState::Culled).count();
        [bytes as i64, i64::from(counters.compiled.pipelines), ran as i64]
    }
}

fn quartiles(values: &[f64]) -> [f64; 3] {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    [1, 2, 3].map(|share| all.get(all.len() * share / 4).copied().unwrap_or(f64::NAN))
}

/// The largest relative difference of colours, as relMSE with 1e-4 of the mean square.
fn difference(a: &Rendered, b: &Rendered) -> anyhow::Result<String> {
    let color = |rendered: &Rendered| {
        rendered.image(&Output::Color).map(|image| image.data.clone()).context("no colour")
    };
    let (a, b) = (color(a)?, color(b)?);
    if a == b {
        return Ok("bit by bit".to_owned());
    }
    let colors = |data: &[f32]| -> Vec<f64> {
        data.chunks_exact(4).flat_map(|texel| texel[..3].iter().map(|v| f64::from(*v))).collect()
    };
    let (a, b) = (colors(&a), colors(&b));
    if a == b {
        return Ok("colours bit by bit, coverage is the background's".to_owned());
    }
    let mean = a.iter().map(|v| v * v).sum::<f64>() / a.len() as f64;
    let relative = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2) / (a * a + 1e-4 * mean));
    Ok(format!("relMSE {:.1e}", relative.sum::<f64>() / a.len() as f64))
}

fn compare(
    what: &str,
    pair: [AblationImage; 2],
    surfels: SurfelDrawing,
    n: usize,
) -> anyhow::Result<()> {
    let [mut without, mut with] = pair.map(|shot| Side::new(shot, surfels));
    let (first, _) = without.draw()?;
    let (other, _) = with.draw()?;
    let [bytes, pipelines, passes] = {
        let (a, b) = (without.takes(&first), with.takes(&other));
        [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
    };
    let (mut times, mut savings) = ([Vec::new(), Vec::new()], Vec::new());
    for turn in 0..n {
        // Whoever comes second finds caches warm.
        let (a, b) = if turn % 2 == 0 {
            let a = without.draw()?.1;
            (a, with.draw()?.1)
        } else {
            let b = with.draw()?.1;
            (without.draw()?.1, b)
        };
        times[0].push(a);
        times[1].push(b);
        savings.push(b - a);
    }
    let [low, middle, high] = quartiles(&savings);
    println!(
        "| {what} | {:.2} | {:.2} | {middle:.2} | {low:.2} to {high:.2} | {:.2} | {pipelines} | {passes} | {} |",
        quartiles(&times[0])[1],
        quartiles(&times[1])[1],
        bytes as f64 / 1e6,
        difference(&first, &other)?
    );
    Ok(())
}

fn number(id: &str, value: f64) -> Values {
    [(id.to_owned(), Value::Float(value))].into()
}

/// Each feature that a scene may lack: without it, and with it as it changes nothing.
fn pairs(read: &Cloud, size: u32) -> anyhow::Result<Vec<(&'static str, [AblationImage; 2])>> {
    // What the file has is taken away, and radii are made equal: a scene that lacks everything.
    let bare = read.without_column(COLOR).without_column(AO).without_column(MATERIAL);
    let mean = read.radii().iter().sum::<f32>() / read.len().max(1) as f32;
    let alike =
        bare.with_columns(vec![Column::new(RADIUS, 1, Buffer::F32(vec![mean; read.len()]))])?;
    let (_, view) = stage::hard_views(read, size)[0];
    let key = Light::Directional {
        towards: DVec3::new(0.3, 1.0, 0.6),
        radiance: Vec3::ONE,
        follows_camera: false,
    };
    let scene = Scene { lights: vec![key], ..Scene::default() };
    let plain = AblationImage {
        renderer: ("surfelshop_ewa_phong", "ewa-phong"),
        cloud: bare.clone(),
        scene,
        view,
        values: Values::new(),
        probe: None,
        outputs: vec![Output::Color],
        kept: Vec::new(),
    };
    let natural = AblationImage {
        renderer: ("surfelshop_environment", "environment"),
        values: number("ks", 0.0),
        ..plain.clone()
    };
    let black = || Some(Probe::constant([0.0; 3]));
    let backed = [
        natural.values.clone(),
        [("background".to_owned(), Value::Text("sharp".to_owned()))].into(),
    ];
    let backed: Values = backed.into_iter().flatten().collect();
    let matte = AblationImage { values: number("specular", 0.0), ..plain.clone() };
    let keeping = |shot: &AblationImage, kept: Restored| {
        [shot.clone(), AblationImage { kept: vec![kept], ..shot.clone() }]
    };
    let feature = |name: &str| Restored::Feature(name.to_owned());
    Ok(vec![
        ("colours", keeping(&plain, Restored::Column(COLOR))),
        ("accessibility, its column", keeping(&plain, Restored::Column(AO))),
        ("accessibility, its shader", keeping(&plain, feature("surfelshop::occlusion::COUNTS"))),
        ("materials", keeping(&plain, Restored::Column(MATERIAL))),
        (
            "unequal radii",
            keeping(&AblationImage { cloud: alike.clone(), ..plain.clone() }, Restored::Radii),
        ),
        ("highlights", keeping(&matte, feature("surfelshop::phong::HIGHLIGHTS"))),
        (
            "a probe, matte light",
            [natural.clone(), AblationImage { probe: black(), ..natural.clone() }],
        ),
        (
            "a background",
            [
                AblationImage { probe: black(), ..natural.clone() },
                AblationImage { probe: black(), values: backed.clone(), ..natural.clone() },
            ],
        ),
        ("output depth", keeping(&plain, Restored::Output(Output::Depth))),
        ("output normal", keeping(&plain, Restored::Output(Output::Normal))),
        ("output albedo", keeping(&plain, Restored::Output(Output::Albedo))),
        ("output ao", keeping(&plain, Restored::Output(Output::Ao))),
    ])
}

pub(crate) fn run() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(2).collect();
    let mut option = |name: &str, default: usize| -> anyhow::Result<usize> {
        let Some(at) = arguments.iter().position(|argument| argument == name) else {
            return Ok(default);
        };
        if at + 1 >= arguments.len() {
            bail!("{name} needs a number");
        }
        let value = arguments.remove(at + 1).parse().with_context(|| name.to_owned())?;
        arguments.remove(at);
        Ok(value)
    };
    let (n, size) = (option("--frames", 30)?, option("--size", 512)?);
    let file = arguments.first().map_or("assets/sample.ply", String::as_str);
    let read = surfelshop_cloud::read(file, &Default::default())?.cloud;
    let n_surfels = read.len();
    for surfels in [SurfelDrawing::Quads, SurfelDrawing::Processor] {
        println!(
            "\n{file}, {n_surfels} surfels, {size} x {size} pixels, {surfels:?}, {n} frames each in turns\n"
        );
        println!(
            "| left out | without, ms | with, ms | saved, ms | quartiles | MB saved | pipelines | passes | picture |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for (what, pair) in pairs(&read, size as u32)? {
            compare(what, pair, surfels, n)?;
        }
    }
    Ok(())
}
