//! Plugins and graphs of earlier revisions of the interface, as they were built and captured then.

use flate2::read::GzDecoder;
use glam::{DVec3, Vec3};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;
use surfelshop_api::columns::AO;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{FrameRequest, HostInfo, Light, Scene, Tile, Traced, UnitKind};
use surfelshop_cloud::Buffer;
use surfelshop_render::{Engine, RenderError, Rendered, RendererView};
use surfelshop_runtime::plugins::{
    LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust,
};
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};
use surfelshop_tests::clouds::sphere;
use surfelshop_tests::recording_host::RecordingHost;
use surfelshop_tests::stage::{engine, render, view};

const VERSIONS: [&str; 6] = ["3.0", "3.3", "3.4", "3.5", "3.6", "3.9"];

/// The units of the stored library of a revision, in a folder that must outlive them.
struct Library {
    _folder: tempfile::TempDir,
    registry: Registry,
}

impl Library {
    fn of(version: &str) -> Self {
        let stored = Path::new(env!("CARGO_MANIFEST_DIR")).join("stored");
        let zipped = stored.join(version).join("plugin-x86_64-linux.so.gz");
        let file =
            File::open(&zipped).unwrap_or_else(|error| panic!("{}: {error}", zipped.display()));
        let mut bytes = Vec::new();
        GzDecoder::new(file).read_to_end(&mut bytes).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stored.so");
        std::fs::write(&path, bytes).unwrap();
        let files = vec![Place::new(path, Origin::CommandLine)];
        let search = SearchPath { files, trust: Trust::everything(), ..SearchPath::default() };
        Self { _folder: folder, registry: Registry::scan(&search) }
    }

    fn unit(&self, kind: UnitKind) -> LoadedUnit {
        let unit = self.registry.find(kind, "stored").unwrap_or_else(|error| panic!("{error}"));
        self.registry.load(&unit).unwrap_or_else(|error| panic!("{error}"))
    }
}

fn draw(engine: &mut Engine, unit: &LoadedUnit, scene: &Scene) -> Result<Rendered, RenderError> {
    let hosted = unit.start(&engine.gpu().host_info(), &Timeouts::default()).unwrap();
    let mut renderer = RendererView::new(hosted, unit.scope());
    let view = view(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 64);
    render(engine, &mut renderer, &sphere(2000, 1.0).cloud(), scene, view, &[Output::Color])
}

#[test]
fn manifests_say_which_revision_they_are_of() {
    for version in VERSIONS {
        let unit = Library::of(version).unit(UnitKind::Renderer);
        let manifest = &unit.manifest;
        assert_eq!(format!("{}.{}", manifest.abi_major, manifest.abi_minor), version);
        assert_eq!((&*manifest.version, &*manifest.authors), ("1.2.3", "A. Author:B. Author"));
        assert_eq!(unit.description.params[0].id, "gain");
    }
}

/// Invariant: plugins and graphs of earlier revisions work and draw what they drew
#[test]
fn renderers_draw_as_those_of_today() {
    let mut engine = engine();
    let scene = Scene::default();
    let units = VERSIONS.map(|version| Library::of(version).unit(UnitKind::Renderer));
    let pictures = units
        .each_ref()
        .map(|unit| draw(&mut engine, unit, &scene).unwrap().images[0].1.data.clone());
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    assert!(pictures[0].iter().any(|&value| value > 0.1));
    let [old, new, ..] = units;

    // What a revision did not know it is not asked for, and says so.
    let lamp = Light::Point { position: DVec3::splat(3.0), intensity: Vec3::ONE };
    let scene = Scene { lights: vec![lamp], ..scene };
    let line = draw(&mut engine, &old, &scene).unwrap_err().to_string();
    assert!(line.contains("it speaks ABI 3.0, which knows no point lights"), "{line}");
    draw(&mut engine, &new, &scene).unwrap();
}

#[test]
fn tools_edit_and_tracers_trace() {
    let values: Values = [("gain".to_owned(), Value::Float(0.5))].into();
    for version in VERSIONS {
        let library = Library::of(version);
        let tool = library.unit(UnitKind::Tool);
        let running =
            Running::start(&tool, &values, &sphere(100, 1.0).cloud(), &ToolOptions::default());
        let ended = running.unwrap().wait(Duration::from_secs(60));
        let Some(Ended::Done(done)) = ended else { panic!("{version}: {ended:?}") };
        let edited = done.edited.unwrap();
        let ao = edited.cloud.columns().iter().find(|column| column.name() == AO).unwrap();
        let Buffer::F32(ao) = ao.values() else { panic!("{ao:?}") };
        assert!(ao.iter().all(|&value| value == 0.25), "{version}");

        let tracer = library.unit(UnitKind::Tracer).create(&HostInfo::default()).unwrap();
        let request = FrameRequest {
            view: view(DVec3::Z, DVec3::ZERO, 8),
            scene: Scene::default(),
            cloud: Default::default(),
            frame_index: 0,
            values: values.clone(),
            environment: None,
        };
        let tile = Tile { x: 2, y: 3, width: 2, height: 1, sample: 0 };
        let mut pixels = [0.0; 8];
        let scene = Traced::default();
        tracer.tile(&request, &scene, tile, &mut pixels, &RecordingHost::default()).unwrap();
        assert_eq!(pixels, [1.0, 3.0, 0.0, 1.0, 1.5, 3.0, 0.0, 1.0], "{version}");
    }
}
