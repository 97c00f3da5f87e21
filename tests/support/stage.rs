//! An engine, a scene and renderers to test with.

use glam::DVec3;
use std::cell::Cell;
use std::ops::{Deref, DerefMut};
use std::path::PathBuf;
use std::sync::Mutex;
use surfelshop_api::abi::plugin_side::Package;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Projection, Scene, UnitKind, View};
use surfelshop_cloud::Cloud;
use surfelshop_render::{
    Engine, EngineOptions, Gpu, GpuOptions, RenderError, RenderRequest, Rendered, RendererView,
    SurfelDrawing,
};
use surfelshop_runtime::boundary::Plugin;
use surfelshop_runtime::plugins::{
    Hosted, LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust,
};

/// A perspective view from `eye` towards `target`, 45 degrees high.
#[must_use]
pub fn view(eye: DVec3, target: DVec3, size: u32) -> View {
    let camera =
        Camera { eye, target, up: DVec3::Y, projection: Projection::Perspective { fov_y: 0.8 } };
    View { camera, size_px: [size, size], near: 1e-5, far: 1e3 }
}

/// Views of a cloud that are hard in different ways: from the front, grazing along its top, and
/// from the middle of its bounding box.
#[must_use]
pub fn hard_views(cloud: &Cloud, size: u32) -> [(&'static str, View); 3] {
    let facts = cloud.facts();
    let center = 0.5 * (facts.bounds_min + facts.bounds_max);
    let extent = facts.bounds_max - facts.bounds_min;
    let reach = extent.length();
    let top = center + DVec3::new(0.0, 0.49 * extent.y, 0.0);
    let scaled =
        |eye, target| View { near: 1e-6 * reach, far: 4.0 * reach, ..view(eye, target, size) };
    [
        ("front", scaled(center + 1.3 * reach * DVec3::new(0.3, 0.3, 1.0), center)),
        ("grazing", scaled(top + 0.7 * reach * DVec3::new(1.0, 0.02, 0.1), top)),
        ("inside", scaled(center, center + extent * DVec3::new(1.0, 0.1, 0.2))),
    ]
}

/// Ways to draw surfels, of which every test of drawing tries all.
pub const WAYS: [SurfelDrawing; 3] =
    [SurfelDrawing::Processor, SurfelDrawing::Quads, SurfelDrawing::Compute];

thread_local! {
    /// How tests on this thread draw surfels that do not say it themselves: as the CPU does, as on
    /// machines without a graphics card.
    static WAY: Cell<SurfelDrawing> = const { Cell::new(SurfelDrawing::Processor) };

    /// Whether [`each_way`] goes through them on this thread.
    static EACH: Cell<bool> = const { Cell::new(false) };
}

/// Runs a test with each way to draw surfels, of all engines that it asks [`engine`] and
/// [`engine_with`] for on this thread. Within another such test it runs with the way of that one: all are gone through
/// already.
///
/// # Panics
/// Where the test does, with the way.
#[expect(clippy::print_stdout, reason = "a failed test says in which way it drew")]
pub fn each_way(test: impl Fn()) {
    if EACH.get() {
        return test();
    }
    for way in WAYS {
        let before = (WAY.replace(way), EACH.replace(true));
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(&test));
        WAY.set(before.0);
        EACH.set(before.1);
        if let Err(panic) = result {
            println!("drawn as {way:?}:");
            std::panic::resume_unwind(panic);
        }
    }
}

/// Engines that no test uses at the moment. A test has an engine for itself; one that went well leaves
/// it, with its compiled pipelines, to the next.
static IDLE: Mutex<Vec<(SurfelDrawing, Engine)>> = Mutex::new(Vec::new());

/// An engine on loan.
pub struct PooledEngine {
    way: SurfelDrawing,
    engine: Option<Engine>,
}

impl Deref for PooledEngine {
    type Target = Engine;

    fn deref(&self) -> &Engine {
        self.engine.as_ref().expect("it is there until it is dropped")
    }
}

impl DerefMut for PooledEngine {
    fn deref_mut(&mut self) -> &mut Engine {
        self.engine.as_mut().expect("it is there until it is dropped")
    }
}

impl Drop for PooledEngine {
    fn drop(&mut self) {
        let Some(mut engine) = self.engine.take().filter(|_| !std::thread::panicking()) else {
            return;
        };
        engine.forget_surfaces();
        engine.keep_sizes(&[]);
        IDLE.lock().expect("no test panics while it holds this").push((self.way, engine));
    }
}

/// An engine on the adapter a user would get, which may have drawn for other tests before: tests of
/// counters ask for a [`fresh_engine`].
///
/// # Panics
/// Where there is no adapter: these tests draw.
#[must_use]
pub fn engine() -> PooledEngine {
    let way = WAY.get();
    let mut idle = IDLE.lock().expect("no test panics while it holds this");
    let known = idle.iter().position(|(other, _)| *other == way).map(|i| idle.swap_remove(i).1);
    drop(idle);
    PooledEngine { way, engine: Some(known.unwrap_or_else(fresh_engine)) }
}

/// An engine that has done nothing and that other tests have afterwards: for counters.
///
/// # Panics
/// Where there is no adapter: these tests draw.
#[must_use]
pub fn new_engine() -> PooledEngine {
    PooledEngine { way: WAY.get(), engine: Some(fresh_engine()) }
}

/// An engine that has done nothing, on the adapter a user would get.
///
/// # Panics
/// Where there is no adapter: these tests draw.
#[must_use]
pub fn fresh_engine() -> Engine {
    engine_with(&GpuOptions::default(), &EngineOptions::default())
}

/// An engine of these options.
///
/// # Panics
/// Where there is no such adapter.
#[must_use]
pub fn engine_with(gpu: &GpuOptions, options: &EngineOptions) -> Engine {
    let gpu =
        Gpu::headless(gpu).expect("drawing tests need an adapter; `cargo verify` installs one");
    let mut options = options.clone();
    if options.surfels == SurfelDrawing::Automatic {
        options.surfels = WAY.get();
    }
    Engine::new(gpu, &options).expect("the host's shaders compose")
}

/// The folder that cargo puts libraries and programs of this build into: that of this program, or of a test the one above.
///
/// # Panics
/// Where the program was moved out of it.
#[must_use]
pub fn build_folder() -> PathBuf {
    let program = std::env::current_exe().expect("the program has a path");
    let folder = program.parent().expect("the program lies in a folder");
    let above = folder.parent().filter(|_| folder.ends_with("deps"));
    above.unwrap_or(folder).to_owned()
}

/// A unit of a plugin library of this build.
///
/// # Panics
/// Where the library was not built or does not work.
#[must_use]
pub fn built_unit(library: &str, kind: UnitKind, unit: &str) -> LoadedUnit {
    let file = format!(
        "{}{}{}",
        std::env::consts::DLL_PREFIX,
        library.replace('-', "_"),
        std::env::consts::DLL_SUFFIX
    );
    let path = build_folder().join(file);
    assert!(path.exists(), "{} is missing: `cargo verify` builds it", path.display());
    let files = vec![Place::new(path, Origin::CommandLine)];
    let search = SearchPath { files, trust: Trust::everything(), ..SearchPath::default() };
    let registry = Registry::scan(&search);
    let found = registry.find(kind, unit).expect("the library has the unit");
    registry.load(&found).expect("the library loads")
}

/// A renderer of a plugin library of this build, in a view of its own.
///
/// # Panics
/// Where the library was not built or does not work.
#[must_use]
pub fn built_renderer(engine: &Engine, library: &str, unit: &str) -> RendererView {
    let loaded = built_unit(library, UnitKind::Renderer, unit);
    let host = engine.gpu().host_info();
    let hosted = loaded.start(&host, &Timeouts::default()).expect("the renderer starts");
    RendererView::new(hosted, unit)
}

/// A renderer registered in the test's own code, by its position in the package.
///
/// # Panics
/// Where the renderer does not start.
#[must_use]
pub fn static_renderer<P: Package>(engine: &Engine, unit: u32) -> RendererView {
    let host = engine.gpu().host_info();
    let hosted = Hosted::start(Plugin::of::<P>(), unit, &host, &Timeouts::default())
        .expect("the renderer starts");
    RendererView::new(hosted, format!("test/{unit}"))
}

/// Renders outputs of one cloud with default parameters.
///
/// # Errors
/// As the engine's.
pub fn render(
    engine: &mut Engine,
    renderer: &mut RendererView,
    cloud: &Cloud,
    scene: &Scene,
    view: View,
    outputs: &[Output],
) -> Result<Rendered, RenderError> {
    render_with(engine, renderer, cloud, scene, view, &Values::new(), outputs)
}

/// The same with these parameters.
///
/// # Errors
/// As the engine's.
pub fn render_with(
    engine: &mut Engine,
    renderer: &mut RendererView,
    cloud: &Cloud,
    scene: &Scene,
    view: View,
    values: &Values,
    outputs: &[Output],
) -> Result<Rendered, RenderError> {
    let request = RenderRequest {
        clouds: &[cloud.view()],
        facts: cloud.facts(),
        scene,
        view,
        values,
        outputs,
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    engine.render(renderer, &request)
}
