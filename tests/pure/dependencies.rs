//! The direction of dependencies, proved from `cargo metadata`.
//!
//! `sdk <- {cloud, raster, image, sandbox} <- {runtime, pyramid} <- render <- session <- evaluate <- viewer <- app`; plugins see the SDK alone; tests
//! see everything and nobody sees them. Declared dependencies are judged for every platform and kind, development included,
//! since a cycle through a test rots as well as any other. What a package pulls in through others
//! is judged for the platform at hand, because only its packages are sure to be downloaded.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// A layer of the workspace and the layers it may depend on.
struct Layer {
    /// Where its packages lie: the folder itself or the folder around them.
    folder: &'static str,
    sees: &'static [&'static str],
    because: &'static str,
}

const LAYERS: [Layer; 18] = [
    Layer {
        folder: "host/sdk/api",
        sees: &[],
        because: "it is all a plugin must compile, so it stands on nothing of ours",
    },
    Layer {
        folder: "host/sdk/geometry",
        sees: &["host/sdk/api"],
        because: "plugins and the host share it, so it knows neither files nor graphics",
    },
    Layer {
        folder: "host/sdk/shading",
        sees: &["host/sdk/api", "host/sdk/geometry"],
        because: "renderers share it, so it describes passes and runs none",
    },
    Layer {
        folder: "host/cloud",
        sees: &["host/sdk/api", "host/sdk/geometry"],
        because: "clouds are read and written where there is no graphics device",
    },
    Layer {
        folder: "host/raster",
        sees: &[],
        because: "it turns numbers into numbers and stands on nothing of ours",
    },
    Layer {
        folder: "host/pyramid",
        sees: &["host/sdk/api", "host/sdk/geometry", "host/cloud", "host/raster"],
        because: "pyramids are made and read where there is no graphics device",
    },
    Layer {
        folder: "host/image",
        sees: &["host/sdk/api"],
        because: "pictures are written and compared where there is no graphics device",
    },
    Layer {
        folder: "host/sandbox",
        sees: &["host/sdk/api"],
        because: "modules run where there is nothing that they could ask for",
    },
    Layer {
        folder: "host/runtime",
        sees: &["host/sdk/api", "host/cloud", "host/image", "host/sandbox"],
        because: "plugins are loaded, and tools and tracers run, where there is no graphics device",
    },
    Layer {
        folder: "host/render",
        sees: &["host/sdk/api", "host/cloud", "host/raster", "host/image", "host/runtime"],
        because: "it runs graphs for any program and so knows none, nor any plugin",
    },
    Layer {
        folder: "host/session",
        sees: &[
            "host/sdk/api",
            "host/sdk/geometry",
            "host/cloud",
            "host/pyramid",
            "host/image",
            "host/runtime",
            "host/render",
        ],
        because: "commands and window share it, so it knows neither",
    },
    Layer {
        folder: "host/evaluate",
        sees: &[
            "host/sdk/api",
            "host/cloud",
            "host/image",
            "host/runtime",
            "host/render",
            "host/session",
        ],
        because: "it measures any plugin, without a window, and so knows none",
    },
    Layer {
        folder: "host/papers",
        sees: &[
            "host/sdk/api",
            "host/sdk/geometry",
            "host/cloud",
            "host/image",
            "host/session",
            "host/evaluate",
        ],
        because: "it runs commands of the program and so knows no plugin and no window",
    },
    Layer {
        folder: "host/viewer",
        sees: &[
            "host/sdk/api",
            "host/cloud",
            "host/pyramid",
            "host/image",
            "host/runtime",
            "host/render",
            "host/session",
            "host/evaluate",
        ],
        because: "it loads plugins while running and is linked to none",
    },
    Layer {
        folder: "host/app",
        sees: &[
            "host/sdk/api",
            "host/cloud",
            "host/pyramid",
            "host/image",
            "host/runtime",
            "host/render",
            "host/session",
            "host/evaluate",
            "host/papers",
            "host/viewer",
        ],
        because: "it is the command line, and nothing stands on it",
    },
    Layer {
        folder: "plugins",
        sees: &["host/sdk/api", "host/sdk/geometry", "host/sdk/shading"],
        because: "our plugins have what a stranger's have, or the interface rots",
    },
    Layer {
        folder: "assets",
        sees: &["host/sdk/api", "host/sdk/geometry", "host/cloud"],
        because: "samples are made without a graphics device",
    },
    Layer {
        folder: "tests",
        sees: &[
            "host/sdk/api",
            "host/sdk/geometry",
            "host/sdk/shading",
            "host/cloud",
            "host/pyramid",
            "host/raster",
            "host/image",
            "host/sandbox",
            "host/runtime",
            "host/render",
            "host/session",
            "host/evaluate",
            "host/papers",
            "host/viewer",
            "host/app",
            "plugins",
            "assets",
            "tests",
        ],
        because: "tests see everything",
    },
];

/// A family of outside crates and the layers that may name it.
struct Reserved {
    /// The crate, and the beginning of the names of its companions (`wgpu`, `wgpu-hal`).
    family: &'static str,
    layers: &'static [&'static str],
    because: &'static str,
}

const RESERVED: [Reserved; 5] = [
    Reserved {
        family: "wgpu",
        layers: &["host/render", "host/viewer"],
        because: "plugins describe and the engine executes; only the window shares its device",
    },
    Reserved {
        family: "naga",
        layers: &["host/render"],
        because: "shaders are compiled and checked in one place",
    },
    Reserved {
        family: "egui",
        layers: &["host/viewer"],
        because: "everything must run without a window",
    },
    Reserved {
        family: "eframe",
        layers: &["host/viewer"],
        because: "everything must run without a window",
    },
    Reserved {
        family: "winit",
        layers: &["host/viewer"],
        because: "everything must run without a window",
    },
];

/// Rooms whose packages must not even pull in a reserved crate through others.
const CLEAN: [&str; 10] = [
    "host/sdk/api",
    "host/sdk/geometry",
    "host/sdk/shading",
    "host/cloud",
    "host/raster",
    "host/image",
    "host/sandbox",
    "host/runtime",
    "plugins",
    "assets",
];

/// All the api may depend on: whatever is added here, every plugin compiles.
const API_DEPENDENCIES: [&str; 3] = ["glam", "rmp-serde", "serde"];

fn root() -> &'static Path {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().expect("the tests lie in a folder of the workspace")
}

pub(crate) fn cargo_metadata(arguments: &[&str]) -> Value {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(root())
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(arguments)
        .output()
        .expect("cargo runs");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo metadata failed: {errors}");
    serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON")
}

/// The platform tests run on, as rustc calls it.
fn platform() -> String {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("-vV").output().expect("rustc runs");
    let printed = String::from_utf8_lossy(&output.stdout);
    let host = printed.lines().find_map(|line| line.strip_prefix("host: "));
    host.expect("rustc names its host").to_owned()
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_else(|| panic!("`{key}` is missing from {value}"))
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("`{key}` is missing from {value}"))
}

/// The layer a package's folder lies in; `None` for packages from elsewhere.
fn room_of(folder: &Path) -> Option<&'static Layer> {
    let inside = folder.strip_prefix(root()).ok()?;
    LAYERS.iter().find(|layer| inside.starts_with(layer.folder))
}

fn layer_of_package(package: &Value) -> Option<&'static Layer> {
    room_of(Path::new(text(package, "manifest_path")))
}

/// Whether a crate is the family's or one of its companions.
fn belongs(name: &str, family: &str) -> bool {
    name.strip_prefix(family).is_some_and(|rest| rest.is_empty() || rest.starts_with(['-', '_']))
}

fn reserved(name: &str) -> Option<&'static Reserved> {
    RESERVED.iter().find(|reserved| belongs(name, reserved.family))
}

/// What is wrong with one declared dependency, if anything.
fn judge(package: &Value, layer: &Layer, dependency: &Value) -> Option<String> {
    let arrow = format!(
        "{} ({}) -> {} ({} dependency)",
        text(package, "name"),
        layer.folder,
        text(dependency, "name"),
        dependency["kind"].as_str().unwrap_or("normal"),
    );
    if let Some(path) = dependency["path"].as_str() {
        let Some(seen) = room_of(Path::new(path)) else {
            return Some(format!("{arrow}: `{path}` is no layer of the workspace"));
        };
        let allowed = layer.sees.contains(&seen.folder);
        return (!allowed).then(|| format!("{arrow}: {}: {}", layer.folder, layer.because));
    }
    let reserved = reserved(text(dependency, "name"))?;
    let allowed = reserved.layers.contains(&layer.folder);
    (!allowed).then(|| format!("{arrow}: only in {:?}: {}", reserved.layers, reserved.because))
}

#[test]
fn every_package_lies_in_a_room() {
    for package in list(&cargo_metadata(&["--no-deps"]), "packages") {
        let name = text(package, "name");
        assert!(layer_of_package(package).is_some(), "{name} lies in no layer of LAYERS");
    }
}

/// Invariant: dependencies run `sdk <- {cloud, raster, image} <- {runtime, pyramid} <- render <- session <- evaluate <- viewer
/// <- app`; plugins see the SDK alone.
#[test]
fn declared_dependencies_follow_the_arrows() {
    let metadata = cargo_metadata(&["--no-deps"]);
    let mut wrong = Vec::new();
    for package in list(&metadata, "packages") {
        let Some(layer) = layer_of_package(package) else { continue };
        let dependencies = list(package, "dependencies");
        wrong.extend(dependencies.iter().filter_map(|one| judge(package, layer, one)));
    }
    assert!(wrong.is_empty(), "arrows in the wrong direction:\n{}", wrong.join("\n"));
}

/// Invariant: a plugin compiles three crates besides its own and what those need
#[test]
fn api_depends_on_exactly_three_crates() {
    let metadata = cargo_metadata(&["--no-deps"]);
    let packages = list(&metadata, "packages");
    let api = packages.iter().find(|package| text(package, "name") == "surfelshop-api");
    let found: BTreeSet<_> = list(api.expect("the api is a package"), "dependencies")
        .iter()
        .filter(|dependency| dependency["kind"].is_null())
        .map(|dependency| text(dependency, "name"))
        .collect();
    assert_eq!(found, BTreeSet::from(API_DEPENDENCIES), "every plugin compiles all of these");
}

/// Packages and their resolved dependencies on this platform, by package id.
struct Resolved {
    names: HashMap<String, String>,
    dependencies: HashMap<String, Vec<String>>,
}

impl Resolved {
    fn of(metadata: &Value) -> Self {
        let packages = list(metadata, "packages").iter();
        let names = packages
            .map(|package| (text(package, "id").to_owned(), text(package, "name").to_owned()))
            .collect();
        let nodes = list(&metadata["resolve"], "nodes").iter();
        let dependencies = nodes.map(|node| (text(node, "id").to_owned(), linked(node))).collect();
        Self { names, dependencies }
    }

    /// The first chain of names from a package to a reserved crate, breadth first, so that the
    /// shortest one is shown.
    fn chain_to_reserved(&self, start: &str) -> Option<Vec<&str>> {
        let mut parents: HashMap<&str, &str> = HashMap::new();
        let mut queue = VecDeque::from([start]);
        while let Some(id) = queue.pop_front() {
            if reserved(&self.names[id]).is_some() {
                let chain = std::iter::successors(Some(id), |id| parents.get(id).copied());
                let mut chain: Vec<_> = chain.map(|id| self.names[id].as_str()).collect();
                chain.reverse();
                return Some(chain);
            }
            for next in &self.dependencies[id] {
                if next != start && !parents.contains_key(next.as_str()) {
                    parents.insert(next, id);
                    queue.push_back(next);
                }
            }
        }
        None
    }
}

/// The dependencies that are compiled to build a package: all but those of its tests.
fn linked(node: &Value) -> Vec<String> {
    let is_built = |dependency: &&Value| {
        list(dependency, "dep_kinds").iter().any(|kind| kind["kind"].as_str() != Some("dev"))
    };
    let built = list(node, "deps").iter().filter(is_built);
    built.map(|dependency| text(dependency, "pkg").to_owned()).collect()
}

/// Invariant: plugins and what they stand on pull in no graphics library
#[test]
fn plugins_and_what_they_stand_on_pull_in_no_graphics() {
    let metadata = cargo_metadata(&["--filter-platform", &platform()]);
    let resolved = Resolved::of(&metadata);
    let mut judged = 0;
    for package in list(&metadata, "packages") {
        let Some(layer) = layer_of_package(package) else { continue };
        if !CLEAN.contains(&layer.folder) {
            continue;
        }
        judged += 1;
        if let Some(chain) = resolved.chain_to_reserved(text(package, "id")) {
            panic!("{} ({}) pulls in: {}", chain[0], layer.folder, chain.join(" -> "));
        }
    }
    assert!(judged > CLEAN.len(), "only {judged} packages were judged");
}

#[test]
fn engine_is_seen_to_pull_in_graphics() {
    // Guards the test above: a search that finds nothing anywhere would pass it.
    let metadata = cargo_metadata(&["--filter-platform", &platform()]);
    let packages = list(&metadata, "packages");
    let engine = packages.iter().find(|package| text(package, "name") == "surfelshop-render");
    let id = text(engine.expect("surfelshop-render is a package"), "id");
    assert!(Resolved::of(&metadata).chain_to_reserved(id).is_some());
}

#[test]
fn companions_belong_to_a_family_and_namesakes_do_not() {
    assert!(belongs("wgpu", "wgpu") && belongs("wgpu-hal", "wgpu") && belongs("naga_oil", "naga"));
    assert!(!belongs("wgpux", "wgpu") && !belongs("nag", "naga"));
}
