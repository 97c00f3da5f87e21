//! The plugin libraries the tests take apart, and a folder to scan.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use surfelshop_api::{
    Camera, FrameRequest, HostInfo, Projection, Scene, UnitKind, View, glam::DVec3,
};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{
    Entry, LoadedUnit, Origin, Place, Registry, SearchPath, State, Trust,
};
use tempfile::TempDir;

/// Package id of [`faulty`].
pub(crate) const FAULTY: &str = "org.surfelshop.test.faulty";
/// Package id of [`rival`].
pub(crate) const RIVAL: &str = "org.surfelshop.test.rival";

/// The library with all misbehaving units.
pub(crate) fn faulty() -> PathBuf {
    built("faulty")
}

/// A library of formats, of which `triplets` is without fault.
pub(crate) fn formats() -> PathBuf {
    built("formats")
}

/// A library whose one unit `fine` is without fault.
pub(crate) fn rival() -> PathBuf {
    built("rival")
}

/// The contents of [`faulty`].
pub(crate) fn faulty_bytes() -> Vec<u8> {
    fs::read(faulty()).unwrap()
}

/// The contents of [`faulty`] built anew, with the code of another renderer behind the name `fine`.
pub(crate) fn faulty_with_fine_being(id: &str, title: &str) -> Vec<u8> {
    let bytes = replaced(faulty_bytes(), b"\tfine\tFine\t", b"\tgood\tFine\t");
    // The manifest's lines must keep their length.
    let title_len = title.len() + id.len() - "fine".len();
    let renamed = format!("\tfine\t{title:title_len$}\t");
    replaced(bytes, format!("\t{id}\t{title}\t").as_bytes(), renamed.as_bytes())
}

/// A library of the fixture package. Test programs lie in `deps`, beside `examples`.
fn built(name: &str) -> PathBuf {
    let program = std::env::current_exe().unwrap();
    let profile = program.parent().and_then(Path::parent).unwrap();
    let path = profile.join("examples").join(format!("{DLL_PREFIX}{name}{DLL_SUFFIX}"));
    assert!(
        path.is_file(),
        "{} is not built; `cargo verify` builds it, or `cargo build -p surfelshop-faulty \
         --examples` in the profile of this test",
        path.display()
    );
    path
}

/// The name of a library on this system.
pub(crate) fn library_name(stem: &str) -> String {
    format!("{stem}{DLL_SUFFIX}")
}

/// A folder of plugins.
pub(crate) struct PluginFolder {
    folder: TempDir,
}

impl PluginFolder {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// A folder with [`rival`] under the name `good`.
    pub(crate) fn with_good_plugin() -> Self {
        let shelf = Self::new();
        shelf.put("good", &fs::read(rival()).unwrap());
        shelf
    }

    /// The folder.
    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Where a library of this stem lies.
    pub(crate) fn at(&self, stem: &str) -> PathBuf {
        self.path().join(library_name(stem))
    }

    /// Writes a library.
    pub(crate) fn put(&self, stem: &str, bytes: &[u8]) -> PathBuf {
        let path = self.at(stem);
        fs::write(&path, bytes).unwrap();
        path
    }

    /// A search path with this folder alone.
    pub(crate) fn search(&self) -> SearchPath {
        let folders = vec![Place::new(self.path(), Origin::UserFolder)];
        SearchPath { folders, trust: Trust::everything(), ..SearchPath::default() }
    }

    /// What is in the folder.
    pub(crate) fn scan(&self) -> Registry {
        Registry::scan(&self.search())
    }
}

/// The entry of a path.
pub(crate) fn entry<'a>(registry: &'a Registry, path: &Path) -> &'a Entry {
    registry.entries().iter().find(|entry| entry.path == path).unwrap()
}

/// Puts the bytes beside a good plugin, expects them to be refused with all these words in one
/// line, and the good plugin to go on working.
#[track_caller]
pub(crate) fn assert_refused(bytes: &[u8], words: &[&str]) {
    let shelf = PluginFolder::with_good_plugin();
    let path = shelf.put("hostile", bytes);
    let registry = shelf.scan();
    let State::Refused(reason) = &entry(&registry, &path).state else {
        panic!("not refused: {:?}", entry(&registry, &path));
    };
    assert_says(reason, words);
    assert_good_plugin_works(&registry);
}

/// Expects one line with all these words.
#[track_caller]
pub(crate) fn assert_says(line: &str, words: &[&str]) {
    assert!(!line.contains('\n'), "more than one line: {line}");
    for word in words {
        assert!(line.contains(word), "`{word}` is missing in: {line}");
    }
}

/// Loads `fine` of [`rival`] and has it describe a frame.
#[track_caller]
pub(crate) fn assert_good_plugin_works(registry: &Registry) {
    let unit = registry.find(UnitKind::Renderer, &format!("{RIVAL}/fine")).unwrap();
    assert_makes_graph(&registry.load(&unit).unwrap());
}

/// Has a renderer describe a frame with one pass.
#[track_caller]
pub(crate) fn assert_makes_graph(unit: &LoadedUnit) {
    let mut instance = unit.create(&HostInfo::default()).unwrap();
    let graph = instance.frame(&request()).unwrap();
    // The shader is the longest part of the structure, and the one uniform is all the data.
    assert!(graph.structure.windows(12).any(|text| text == b"var<uniform>"));
    assert_eq!(graph.data.len(), 4);
}

/// Loads a unit of [`faulty`] from where it was built.
pub(crate) fn load(kind: UnitKind, id: &str) -> LoadedUnit {
    let registry = faulty_registry();
    let unit = registry.find(kind, id).unwrap();
    registry.load(&unit).unwrap_or_else(|error| panic!("{error}"))
}

/// [`faulty`] as named on the command line.
pub(crate) fn faulty_registry() -> Registry {
    let files = vec![Place::new(faulty(), Origin::CommandLine)];
    Registry::scan(&SearchPath { files, trust: Trust::everything(), ..SearchPath::default() })
}

/// A small frame.
pub(crate) fn request() -> FrameRequest {
    let camera = Camera {
        eye: DVec3::new(0.0, 0.0, 4.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 0.7 },
    };
    FrameRequest {
        view: View { camera, size_px: [4, 2], near: 0.1, far: 10.0 },
        scene: Scene::default(),
        cloud: surfelshop_api::CloudFacts::default(),
        frame_index: 0,
        values: surfelshop_api::params::Values::new(),
        environment: None,
    }
}

/// The line of a panic.
#[track_caller]
pub(crate) fn panic_line<T>(result: Result<T, Fault>) -> String {
    match result {
        Err(Fault::Panic(line)) => line,
        Err(other) => panic!("not a panic: {other}"),
        Ok(_) => panic!("it went well"),
    }
}

/// Where `needle` first lies in `bytes`.
#[track_caller]
pub(crate) fn find(bytes: &[u8], needle: &[u8]) -> usize {
    let first = needle[0];
    let starts = bytes.iter().enumerate().filter(|(_, byte)| **byte == first);
    let found = starts.map(|(i, _)| i).find(|&i| bytes[i..].starts_with(needle));
    found.unwrap_or_else(|| panic!("{:?} is not in the library", needle.escape_ascii().to_string()))
}

/// Replaces every `from` by `to`, of the same length.
#[track_caller]
pub(crate) fn replaced(mut bytes: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut at = find(&bytes, from);
    loop {
        bytes[at..at + to.len()].copy_from_slice(to);
        let Some(next) = bytes[at..].windows(from.len()).position(|window| window == from) else {
            return bytes;
        };
        at += next;
    }
}
