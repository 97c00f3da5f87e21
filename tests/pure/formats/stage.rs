//! The formats of this build and of the fixture, and files of a test's own.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use surfelshop_cloud::{Cloud, Loaded, ReadOptions, WriteOptions, Written, read, write};
use surfelshop_runtime::formats::PluginFormats;
use surfelshop_runtime::plugins::{Origin, Place, Registry, SearchPath, Timeouts, Trust};
use surfelshop_tests::stage::build_folder;
use tempfile::TempDir;

/// The libraries of this project that have formats.
const LIBRARIES: [&str; 9] =
    ["e57", "gaussian_splatting", "gltf", "las", "pcd", "potree", "sfl", "stl", "text"];

/// How long the fixture's formats may be silent.
pub(crate) const SILENCE: Duration = Duration::from_secs(1);

fn registry(libraries: impl Iterator<Item = PathBuf>) -> Arc<Registry> {
    let found = |path: PathBuf| {
        assert!(path.is_file(), "{} is missing: `cargo verify` builds it", path.display());
        Place::new(path, Origin::CommandLine)
    };
    let files = libraries.map(found).collect();
    let search = SearchPath { files, trust: Trust::everything(), ..SearchPath::default() };
    Arc::new(Registry::scan(&search))
}

/// The formats of this project.
pub(crate) fn formats() -> &'static PluginFormats {
    static FORMATS: LazyLock<PluginFormats> = LazyLock::new(|| {
        let file = |name: &str| format!("{DLL_PREFIX}surfelshop_{name}{DLL_SUFFIX}");
        let libraries = LIBRARIES.iter().map(|name| build_folder().join(file(name)));
        PluginFormats::new(registry(libraries), Timeouts::default())
    });
    &FORMATS
}

/// The formats of the fixture, which are given up after a second without a sign of life.
pub(crate) fn fixture() -> PluginFormats {
    let file = format!("{DLL_PREFIX}formats{DLL_SUFFIX}");
    let library = build_folder().join("examples").join(file);
    PluginFormats::new(registry(std::iter::once(library)), Timeouts::of(SILENCE))
        .with_silence(SILENCE)
}

/// How files are read with these formats.
pub(crate) fn reading(formats: &PluginFormats) -> ReadOptions<'_> {
    ReadOptions { formats, ..ReadOptions::default() }
}

/// How files are written with these formats.
pub(crate) fn writing(formats: &PluginFormats) -> WriteOptions<'_> {
    WriteOptions { formats, ..WriteOptions::default() }
}

/// A folder with files of one test.
pub(crate) struct Files(TempDir);

impl Files {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// A path in the folder.
    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.at(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Names of the files in the folder.
    pub(crate) fn names(&self) -> Vec<String> {
        let listing = self.0.path().read_dir().unwrap();
        let name = |entry: std::io::Result<std::fs::DirEntry>| {
            entry.unwrap().file_name().to_string_lossy().into_owned()
        };
        let mut names: Vec<String> = listing.map(name).collect();
        names.sort();
        names
    }

    /// Writes a cloud with the project's formats.
    #[track_caller]
    pub(crate) fn write(&self, name: &str, cloud: &Cloud) -> Written {
        write(self.at(name), cloud, &writing(formats())).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Reads a file with the project's formats.
    #[track_caller]
    pub(crate) fn read(&self, name: &str) -> Loaded {
        load(&self.at(name))
    }
}

/// Reads a file with the project's formats.
#[track_caller]
pub(crate) fn load(path: &Path) -> Loaded {
    read(path, &reading(formats())).unwrap_or_else(|error| panic!("{error}"))
}

/// The values of a column, widened.
#[track_caller]
pub(crate) fn values(cloud: &Cloud, name: &str) -> Vec<f64> {
    let column = cloud.column(name).unwrap_or_else(|| panic!("there is no column `{name}`"));
    column.values().as_values().iter_f64().collect()
}

/// Places in the world.
pub(crate) fn places(cloud: &Cloud) -> Vec<glam::DVec3> {
    cloud.positions().iter().map(|offset| cloud.origin() + offset.as_dvec3()).collect()
}
