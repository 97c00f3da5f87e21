//! Builds plugins outside the workspace, as their authors do.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::glam::DVec3;
use surfelshop_api::params::Values;
use surfelshop_api::{FrameRequest, HostInfo, Scene, UnitKind};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{
    LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust,
};
use surfelshop_tests::stage::{build_folder, view};

/// The checkout.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(1).unwrap().to_owned()
}

/// A folder that stays from one run of the tests to the next, so that little is compiled twice.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("strangers");
    fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

/// What the program says, with nothing of this user's.
pub(crate) fn surfelshop(arguments: &[&str]) -> Output {
    command(arguments).output().unwrap()
}

/// The program, with nothing of this user's.
pub(crate) fn command(arguments: &[&str]) -> Command {
    let program = build_folder().join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX));
    assert!(program.is_file(), "{} is not built; `cargo verify` builds it", program.display());
    let mut command = Command::new(program);
    command.args(arguments).env_remove("SURFELSHOP_PLUGINS").env("NODEVICE_SELECT", "1");
    command.env("XDG_DATA_HOME", folder("data"));
    command
}

/// A project that the program starts.
pub(crate) fn project(name: &str, kind: &str) -> PathBuf {
    let folder = folder(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    let made = surfelshop(&["plugins", "new", folder.to_str().unwrap(), "--kind", kind]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    // The versions that are here already: tests need no network.
    fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    folder
}

/// Runs cargo in a project, with these options and what is meant for the compiler.
pub(crate) fn cargo(project: &Path, options: &[&str], for_rustc: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO"));
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy();
        // What the tests were built with is no affair of a third party's project.
        if name.starts_with("CARGO_") && name != "CARGO_HOME"
            || name.contains("RUSTFLAGS")
            || name == "RUSTC_BOOTSTRAP"
        {
            command.env_remove(&*name);
        }
    }
    command.current_dir(project).env("CARGO_TARGET_DIR", folder("target"));
    // The interface and what it needs are compiled again here. How well they are optimised changes no result, and the
    // whole-program optimisation of the template takes most of the time.
    command.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1");
    command.args(options).arg("--offline").args(for_rustc).output().unwrap()
}

/// Builds a project with these options of cargo; its library is in the folder of this profile.
pub(crate) fn build(project: &Path, options: &[&str], profile: &str) -> PathBuf {
    let built = cargo(project, &[&["build"], options].concat(), &[]);
    let told = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success() && !told.contains("warning"), "{told}");
    let name = project.file_name().unwrap().to_str().unwrap().replace('-', "_");
    folder("target").join(profile).join(format!("{DLL_PREFIX}{name}{DLL_SUFFIX}"))
}

/// What is in a library, or why it is refused.
pub(crate) fn registry(library: &Path) -> Registry {
    let files = vec![Place::new(library, Origin::CommandLine)];
    Registry::scan(&SearchPath { files, trust: Trust::everything(), ..SearchPath::default() })
}

/// The first unit of a kind of a library that has one.
pub(crate) fn unit(library: &Path, kind: UnitKind) -> LoadedUnit {
    let registry = registry(library);
    let (_, manifest, unit) = registry.units(kind).next().unwrap_or_else(|| {
        panic!("{:?}", registry.entries());
    });
    let name = format!("{}/{}", manifest.id, unit.id);
    let unit = registry.find(kind, &name).unwrap();
    registry.load(&unit).unwrap_or_else(|error| panic!("{error}"))
}

/// The renderer of a library that has one.
pub(crate) fn renderer(library: &Path) -> LoadedUnit {
    unit(library, UnitKind::Renderer)
}

/// A request for a frame with these parameters.
pub(crate) fn request(values: &Values) -> FrameRequest {
    FrameRequest {
        view: view(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 64),
        scene: Scene::default(),
        cloud: Default::default(),
        frame_index: 3,
        values: values.clone(),
        environment: None,
    }
}

/// The graph that a renderer describes with these parameters.
pub(crate) fn graph(unit: &LoadedUnit, values: &Values) -> Result<EncodedGraph, Fault> {
    unit.start(&HostInfo::default(), &Timeouts::default())?.frame(request(values))
}
