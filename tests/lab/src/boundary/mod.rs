//! What the plugin boundary costs: a frame described, a library loaded and loaded again, and its size.
//!
//! ```text
//! cargo run --release -p surfelshop-lab -- boundary [LIBRARY]...
//! ```
//!
//! Libraries, or WebAssembly modules, have a renderer each; without one it is `flat`. Times are medians, with quartiles.

pub(crate) mod ways;

use anyhow::{Context as _, ensure};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;
use surfelshop_api::graph::Structure;
use surfelshop_api::{FrameRequest, HostInfo, Scene, UnitKind, glam::DVec3, static_plugin};
use surfelshop_chains::Chain;
use surfelshop_runtime::boundary::Plugin;
use surfelshop_runtime::plugins::{
    Hosted, Origin, Place, Registry, SearchPath, Timeouts, Trust, UnitRef,
};
use surfelshop_tests::stage::{build_folder, view};

/// Frames that are described for a median.
const FRAMES: usize = 20_000;
/// Loads and reloads for a median.
const LOADS: usize = 15;

static_plugin! { id: "org.surfelshop.test.chains", renderers: [Chain<4>, Chain<10>] }

fn request() -> FrameRequest {
    FrameRequest {
        view: view(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 512),
        scene: Scene::default(),
        cloud: Default::default(),
        frame_index: 3,
        values: Default::default(),
        environment: None,
    }
}

/// Lower quartile, median and upper quartile.
fn quartiles(all: &mut [f64]) -> [f64; 3] {
    all.sort_by(f64::total_cmp);
    [1, 2, 3].map(|share| all.get((all.len().max(1) - 1) * share / 4).copied().unwrap_or(f64::NAN))
}

/// Microseconds of each of so many calls, as median and quartiles.
fn times(n: usize, mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<String> {
    let mut all = Vec::with_capacity(n);
    for _ in 0..n {
        let started = Instant::now();
        work()?;
        all.push(started.elapsed().as_secs_f64() * 1e6);
    }
    let [low, middle, high] = quartiles(&mut all);
    Ok(format!("{middle:9.1} ({low:.1} to {high:.1})"))
}

fn frames() -> anyhow::Result<()> {
    let plugin = Plugin::of::<SurfelshopPackage>();
    let host = HostInfo::default();
    for (unit, passes) in [(0, 4), (1, 10)] {
        let mut instance = plugin.create(unit, &host)?;
        let request = request();
        let graph = instance.frame(&request)?;
        let bytes = graph.structure.len();
        println!("\na graph of {passes} passes, {bytes} bytes of structure        us (quartiles)");
        let described = times(FRAMES, || {
            black_box(instance.frame(&request)?);
            Ok(())
        })?;
        println!("  described: request encoded and read, graph built and encoded {described}");
        let known = graph.structure.clone();
        let compared = times(FRAMES, || {
            ensure!(black_box(&known) == black_box(&graph.structure), "the structure is the same");
            Ok(())
        })?;
        println!("  compared with the last one, every frame                      {compared}");
        let decoded = times(FRAMES, || {
            black_box(rmp_serde::from_slice::<Structure>(&graph.structure)?);
            Ok(())
        })?;
        println!("  decoded, where it is another one                             {decoded}");
        let mut hosted = Hosted::start(plugin, unit, &host, &Timeouts::default())?;
        let there_and_back = times(FRAMES, || {
            black_box(hosted.frame(request.clone())?);
            Ok(())
        })?;
        println!("  described on the renderer's own thread, with the way there   {there_and_back}");
    }
    Ok(())
}

fn library(path: &Path) -> anyhow::Result<()> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    println!("\n{}: {:.2} MB", path.display(), bytes.len() as f64 / 1e6);
    // Each load is that of a file that was never seen before.
    let folder = tempfile::tempdir()?;
    let mut fresh = 0u64;
    let is_module = bytes.starts_with(b"\0asm");
    let mut rebuilt = || -> anyhow::Result<UnitRef> {
        fresh += 1;
        let mut bytes = bytes.clone();
        if is_module {
            bytes.extend([0, 9, 0]); // A section of its own, without a name.
        }
        bytes.extend(fresh.to_le_bytes());
        let file = folder.path().join(if is_module { "plugin.wasm" } else { "plugin.so" });
        std::fs::write(&file, &bytes)?;
        let files = vec![Place::new(file, Origin::CommandLine)];
        let search = SearchPath { files, trust: Trust::everything(), ..SearchPath::default() };
        let registry = Registry::scan(&search);
        let mut units = registry.units(UnitKind::Renderer);
        let (entry, manifest, unit) = units.next().context("it has no renderer")?;
        Ok(entry.unit(manifest, unit))
    };
    let unit = rebuilt()?.load(&Timeouts::default())?;
    let mut instance = unit.create(&HostInfo::default())?;
    let request = request();
    let described = times(FRAMES / 10, || {
        black_box(instance.frame(&request)?);
        Ok(())
    })?;
    println!("  a frame described, us                                        {described}");
    let (mut load, mut reload) = (Vec::new(), Vec::new());
    for _ in 0..LOADS {
        let unit = rebuilt()?;
        let started = Instant::now();
        black_box(unit.load(&Timeouts::default())?);
        load.push(started.elapsed().as_secs_f64() * 1e3);
        let unit = rebuilt()?;
        let started = Instant::now();
        black_box(unit.reload(&HostInfo::default(), &request, &Timeouts::default())?);
        reload.push(started.elapsed().as_secs_f64() * 1e3);
    }
    for (what, mut all) in [
        ("read, hashed, judged, copied, loaded, asked what it is", load),
        ("the same for a new build, with an instance and its first graph", reload),
    ] {
        let [low, middle, high] = quartiles(&mut all);
        println!("  {what:<63} {middle:6.2} ms ({low:.2} to {high:.2})");
    }
    Ok(())
}

pub(crate) fn run() -> anyhow::Result<()> {
    frames()?;
    let mut given: Vec<PathBuf> = std::env::args_os().skip(2).map(PathBuf::from).collect();
    if given.is_empty() {
        let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        // Examples lie beside `deps`, in a folder of the build folder as these do.
        given.push(build_folder().join(format!("{prefix}surfelshop_flat{suffix}")));
    }
    given.iter().try_for_each(|path| library(path))
}
