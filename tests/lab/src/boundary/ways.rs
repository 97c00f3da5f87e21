//! What the ways to run a plugin cost: in the program, in a process of its own, and in the sandbox.
//!
//! ```text
//! cargo run --release -p surfelshop-lab -- ways LIBRARY MODULE [ID=VALUE...]
//! ```
//!
//! Both are of the same source. Their renderers describe and draw a million surfels at 512 x 512, and their tools run over
//! these with the values that are named; the ways in turns, medians with quartiles. Tools that take more than a minute run
//! once.

use super::quartiles;
use anyhow::{Context as _, bail, ensure};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{FrameRequest, Scene, UnitKind};
use surfelshop_cloud::Cloud;
use surfelshop_render::{RenderRequest, RendererView};
use surfelshop_runtime::isolate::use_program;
use surfelshop_runtime::plugins::{
    LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust, UnitRef,
};
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};
use surfelshop_session::options::values::Setting;
use surfelshop_session::parameters;
use surfelshop_tests::clouds::wavy_sphere;
use surfelshop_tests::stage::{engine, hard_views};

const SURFELS: usize = 1_000_000;
/// Frames that are described, and drawn, for a median.
const DESCRIBED: usize = 2_000;
const DRAWN: usize = 15;
/// Runs of a tool, and loads, for a median.
const RUNS: usize = 5;
const LOADS: usize = 15;
/// Milliseconds of a run after which there is no other one.
const LONG: f64 = 60_000.0;

/// How a unit runs.
struct Way {
    name: &'static str,
    file: PathBuf,
    is_isolated: bool,
}

impl Way {
    /// Its units of a kind, found anew.
    fn units(&self, kind: UnitKind) -> Vec<UnitRef> {
        let mut trust = Trust::everything();
        if self.is_isolated {
            trust.isolate_file(&self.file);
        }
        let files = vec![Place::new(&self.file, Origin::CommandLine)];
        let registry = Registry::scan(&SearchPath { files, trust, ..SearchPath::default() });
        registry.units(kind).map(|(entry, manifest, unit)| entry.unit(manifest, unit)).collect()
    }

    fn load(&self, kind: UnitKind, id: &str) -> anyhow::Result<LoadedUnit> {
        let unit = self.units(kind).into_iter().find(|unit| unit.id == id);
        let unit = unit.with_context(|| format!("{} has no {id}", self.file.display()))?;
        Ok(unit.load(&Timeouts::default())?)
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// A row of figures, one for each way, and how often the first goes into the others.
fn row(what: &str, ways: &[Way], mut times: Vec<Vec<f64>>) {
    println!("{what}");
    let base = quartiles(&mut times[0])[1];
    for (way, times) in ways.iter().zip(&mut times) {
        let [low, middle, high] = quartiles(times);
        let name = way.name;
        println!("  {name:<24} {middle:10.3} ({low:.3} to {high:.3}), {:.2} times", middle / base);
    }
}

fn renderer(ways: &[Way], id: &str, cloud: &Cloud) -> anyhow::Result<()> {
    let mut engine = engine();
    let host = engine.gpu().host_info();
    let (_, view) = hard_views(cloud, 512)[0];
    let mut units = Vec::new();
    for way in ways {
        let unit = way.load(UnitKind::Renderer, id)?;
        let hosted = unit.start(&host, &Timeouts::default())?;
        let drawn = unit.start(&host, &Timeouts::default())?;
        // Each with its own resources.
        let scope = format!("{} {}", unit.scope(), way.name);
        let drawn = RendererView::new(drawn, scope).needing(&unit.description.needs);
        units.push((hosted, drawn, unit));
    }
    let request = FrameRequest {
        view,
        scene: Scene::default(),
        cloud: cloud.facts().clone(),
        frame_index: 3,
        values: Values::new(),
        environment: None,
    };
    let first = units[0].0.frame(request.clone())?;
    let passes = surfelshop_runtime::boundary::decode(&first)?.passes.len();
    let mut described = vec![Vec::new(); ways.len()];
    let mut drawn = described.clone();
    for _ in 0..DESCRIBED {
        for ((hosted, _, _), times) in units.iter_mut().zip(&mut described) {
            let started = Instant::now();
            let graph = black_box(hosted.frame(request.clone())?);
            times.push(1e3 * ms(started));
            ensure!(graph.structure == first.structure, "the ways describe different graphs");
        }
    }
    row(&format!("{id}, {passes} passes: a frame described, us"), ways, described);
    for frame in 0..=DRAWN {
        for (which, ((_, drawing, _), times)) in units.iter_mut().zip(&mut drawn).enumerate() {
            let mut view = view;
            view.camera.eye.x *= 1.0 + 1e-9 * (ways.len() * frame + which) as f64;
            let values = Values::new();
            let request = RenderRequest {
                clouds: &[cloud.view()],
                facts: cloud.facts(),
                scene: &Scene::default(),
                view,
                values: &values,
                outputs: &[Output::Color],
                frame_index: 0,
                environment: None,
                stride: 1,
                detail_px: 0.0,
                parts: None,
                eye_dome: None,
            };
            let started = Instant::now();
            black_box(engine.render(drawing, &request)?);
            // The first compiles.
            if frame > 0 {
                times.push(ms(started));
            }
        }
    }
    row(&format!("{id}, {passes} passes: the whole frame at 512 x 512, ms"), ways, drawn);
    Ok(())
}

fn tool(ways: &[Way], unit: &UnitRef, cloud: &Cloud, typed: &[Setting]) -> anyhow::Result<()> {
    let id = &unit.id;
    let mut times = vec![Vec::new(); ways.len()];
    for run in 0..RUNS {
        if run > 0 && times.iter().flatten().any(|ms| *ms > LONG) {
            break;
        }
        for (way, times) in ways.iter().zip(&mut times) {
            let loaded = way.load(UnitKind::Tool, id)?;
            let values = parameters::values(unit, &loaded.description.params, typed)?;
            let started = Instant::now();
            let mut running = Running::start(&loaded, &values, cloud, &ToolOptions::default())?;
            let ended = loop {
                if let Some(ended) = running.wait(Duration::from_secs(1)) {
                    break ended;
                }
            };
            match ended {
                Ended::Done(done) => drop(black_box(done)),
                other => bail!("{id} {}: {other:?}", way.name),
            }
            times.push(ms(started));
        }
    }
    row(&format!("{id} over {SURFELS} surfels, ms"), ways, times);
    Ok(())
}

/// Loading a file of new contents, and one that was loaded before.
fn loading(ways: &[Way]) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    let (mut cold, mut again) = (vec![Vec::new(); ways.len()], vec![Vec::new(); ways.len()]);
    for n in 0..LOADS as u64 {
        for (i, way) in ways.iter().enumerate() {
            let mut bytes = std::fs::read(&way.file)?;
            if bytes.starts_with(b"\0asm") {
                bytes.extend([0, 9, 0]); // A section of its own, without a name.
            }
            bytes.extend(n.to_le_bytes());
            let name = way.file.file_name().context("a file has a name")?;
            let file = folder.path().join(name);
            std::fs::write(&file, &bytes)?;
            let (file, is_isolated) = (file.canonicalize()?, way.is_isolated);
            let way = Way { name: way.name, file, is_isolated };
            let kinds = [UnitKind::Renderer, UnitKind::Tool];
            let unit = kinds.iter().flat_map(|kind| way.units(*kind)).next();
            let unit = unit.context("it has no renderer and no tool")?;
            for times in [&mut cold[i], &mut again[i]] {
                let started = Instant::now();
                black_box(unit.load(&Timeouts::default())?);
                times.push(ms(started));
            }
        }
    }
    row("loaded for the first time, ms", ways, cold);
    row("loaded again, ms", ways, again);
    Ok(())
}

pub(crate) fn run() -> anyhow::Result<()> {
    let program = format!("surfelshop{}", std::env::consts::EXE_SUFFIX);
    use_program(std::env::current_exe()?.with_file_name(program));
    let mut given = std::env::args_os().skip(2);
    let (Some(library), Some(module)) = (given.next(), given.next()) else {
        bail!("expected LIBRARY MODULE [ID=VALUE...]")
    };
    let [library, module] = [library, module].map(PathBuf::from);
    let typed =
        given.map(|word| Setting::parse(&word.to_string_lossy()).map_err(anyhow::Error::msg));
    let typed = typed.collect::<anyhow::Result<Vec<_>>>()?;
    let file = |path: &Path| path.canonicalize().with_context(|| path.display().to_string());
    let ways = [
        ("in the program", &library, false),
        ("in a process of its own", &library, true),
        ("in the sandbox", &module, false),
    ];
    let ways = ways
        .map(|(name, path, is_isolated)| anyhow::Ok(Way { name, file: file(path)?, is_isolated }));
    let ways = ways.into_iter().collect::<anyhow::Result<Vec<_>>>()?;
    let cloud = wavy_sphere(SURFELS);
    for unit in ways[0].units(UnitKind::Renderer) {
        renderer(&ways, &unit.id, &cloud)?;
    }
    for unit in ways[0].units(UnitKind::Tool) {
        // Some need what this cloud has not, such as triangles.
        if let Err(error) = tool(&ways, &unit, &cloud, &typed) {
            println!("{error:#}");
        }
    }
    loading(&ways)
}
