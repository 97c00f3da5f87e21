//! An engine, a scene and renderers to test with.

use glam::DVec3;
use std::path::PathBuf;
use surfelshop_api::abi::host_side::Plugin;
use surfelshop_api::abi::plugin_side::Package;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{Camera, Projection, Scene, UnitKind, View};
use surfelshop_cloud::Cloud;
use surfelshop_engine::plugins::{
    Hosted, LoadedUnit, Origin, Patience, Place, Registry, SearchPath, Trust,
};
use surfelshop_engine::{
    Engine, EngineOptions, Gpu, GpuOptions, RenderError, RenderRequest, Rendered, RendererView,
    SurfelDrawing,
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

/// The engine of a test, on the adapter a user would get.
///
/// # Panics
/// Where there is no adapter: these tests draw.
#[must_use]
pub fn engine() -> Engine {
    engine_with(&GpuOptions::default(), &EngineOptions::default())
}

/// Says how tests draw surfels that do not say it themselves: `quads`, `compute` or `cpu`; `cargo
/// verify` runs those of drawing with each.
const DRAWN_AS: &str = "SURFELSHOP_TEST_SURFELS";

fn drawn_as() -> SurfelDrawing {
    match std::env::var(DRAWN_AS).as_deref() {
        Err(_) => SurfelDrawing::Automatic,
        Ok("quads") => SurfelDrawing::Quads,
        Ok("compute") => SurfelDrawing::Compute,
        Ok("cpu") => SurfelDrawing::Processor,
        Ok(other) => panic!("{DRAWN_AS} is {other}, expected quads, compute or cpu"),
    }
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
        options.surfels = drawn_as();
    }
    Engine::new(gpu, &options).expect("the host's shaders compose")
}

/// The folder that cargo puts libraries and programs of this build into.
///
/// # Panics
/// Where the test program was moved out of it.
#[must_use]
pub fn build_folder() -> PathBuf {
    let test = std::env::current_exe().expect("the test has a path");
    let deps = test.parent().expect("the test lies in a folder");
    deps.parent().expect("which lies in the build folder").to_owned()
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
    let hosted = loaded.start(&host, &Patience::default()).expect("the renderer starts");
    RendererView::new(hosted, unit)
}

/// A renderer registered in the test's own code, by its position in the package.
///
/// # Panics
/// Where the renderer does not start.
#[must_use]
pub fn static_renderer<P: Package>(engine: &Engine, unit: u32) -> RendererView {
    let host = engine.gpu().host_info();
    let hosted = Hosted::start(Plugin::of::<P>(), unit, &host, &Patience::default())
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
    };
    engine.render(renderer, &request)
}
