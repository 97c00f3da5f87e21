//! Brings units into memory.
//!
//! Lifecycle: read the file again (it may have changed since the scan); inspect those bytes;
//! write them to a private copy; load that; check the function table; ask the unit to describe
//! itself. Libraries stay loaded until the process ends, and units of one package share one.

#![expect(unsafe_code, reason = "runs the code of a library that was inspected before")]

use super::copy::{self, PrivateCopy};
use super::find::UnitRef;
use super::inspect::{Refused, inspect_bytes, read};
use super::registry::Registry;
use std::collections::HashMap;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, Once, PoisonError};
use surfelshop_api::HostInfo;
use surfelshop_api::abi::host_side::{Fault, Instance, Plugin};
use surfelshop_api::abi::plugin_side::{Description, Package};
use surfelshop_api::abi::table::{self, PluginTable};
use surfelshop_api::manifest::{self, Manifest, UnitEntry};

/// Why a unit could not be loaded; every message names the plugin and its file.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file is no longer what the scan found.
    #[error("{unit} changed since it was listed: the file now {refused}")]
    Refused {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// Why the file is refused now.
        refused: Refused,
    },
    /// The file is a good plugin that does not export the unit any more.
    #[error("{unit} changed since it was listed: the file now exports {found}")]
    Replaced {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// What the file exports instead.
        found: String,
    },
    /// The copy to load could not be written.
    #[error("{unit} could not be copied to the folder for temporary files: {error}")]
    Copy {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// Why.
        error: io::Error,
    },
    /// The system refused to load the library.
    #[error("{unit} could not be loaded: {reason}")]
    Open {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// What the system said.
        reason: String,
    },
    /// The library is loaded and failed at its first call.
    #[error("{unit} failed while it was loaded: {fault}")]
    Fault {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// How it failed.
        fault: Fault,
    },
    /// A manifest registered in this program is damaged or lacks the unit.
    #[error("unit {index} of a plugin registered in this program: {reason}")]
    Static {
        /// The position asked for.
        index: u32,
        /// What is wrong.
        reason: String,
    },
}

/// A unit in memory, ready to make instances.
#[derive(Clone)]
pub struct LoadedUnit {
    /// The package's manifest, as it was in the file that was loaded.
    pub manifest: Manifest,
    /// The unit's entry in it.
    pub unit: UnitEntry,
    /// The unit's position in it.
    pub unit_index: u32,
    /// The unit's parameters.
    pub description: Description,
    /// The functions of its package.
    pub plugin: Plugin,
}

impl fmt::Debug for LoadedUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LoadedUnit")
            .field("package", &self.manifest.id)
            .field("unit", &self.unit)
            .finish_non_exhaustive()
    }
}

impl LoadedUnit {
    /// Makes an instance.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn create(&self, host: &HostInfo) -> Result<Instance, Fault> {
        self.plugin.create(self.unit_index, host)
    }

    /// A unit registered in this program with `static_plugin!`, by its position.
    ///
    /// # Errors
    /// Where the manifest is damaged or has no such unit, or the unit cannot describe itself.
    pub fn from_static<P: Package>(manifest: &[u8], unit_index: u32) -> Result<Self, LoadError> {
        let wrong = |reason: String| LoadError::Static { index: unit_index, reason };
        let manifest = manifest::decode(manifest).map_err(|refusal| wrong(refusal.to_string()))?;
        let Some(unit) = manifest.units.get(unit_index as usize).cloned() else {
            return Err(wrong(format!("its manifest has {} units", manifest.units.len())));
        };
        let plugin = Plugin::of::<P>();
        let description = plugin.describe(unit_index).map_err(|fault| wrong(fault.to_string()))?;
        Ok(Self { manifest, unit, unit_index, description, plugin })
    }
}

impl Registry {
    /// Loads a unit that [`find`](Self::find) found.
    ///
    /// A file that was loaded before and has the same contents is not loaded again.
    ///
    /// # Errors
    /// Where the file has changed to something that does not export the unit, or the plugin fails;
    /// names the plugin, its file and the reason.
    pub fn load(&self, unit: &UnitRef) -> Result<LoadedUnit, LoadError> {
        let Loaded { plugin, manifest } = load_package(unit)?;
        let is_unit = |entry: &UnitEntry| entry.kind == unit.kind && entry.id == unit.id;
        let position = manifest.units.iter().position(is_unit);
        let index = position.and_then(|i| u32::try_from(i).ok());
        let Some(unit_index) = index.filter(|_| manifest.id == unit.package) else {
            let found = manifest.units.iter().map(|u| format!("{}/{}", manifest.id, u.id));
            let found = found.collect::<Vec<_>>().join(", ");
            return Err(LoadError::Replaced { unit: Box::new(unit.clone()), found });
        };
        let description = plugin
            .describe(unit_index)
            .map_err(|fault| LoadError::Fault { unit: Box::new(unit.clone()), fault })?;
        let entry = manifest.units[unit_index as usize].clone();
        Ok(LoadedUnit { manifest, unit: entry, unit_index, description, plugin })
    }
}

/// A library in memory.
#[derive(Clone)]
struct Loaded {
    plugin: Plugin,
    manifest: Manifest,
}

/// What tells one state of a file from another.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Identity {
    path: PathBuf,
    len: usize,
    /// Contents are compared rather than times of change: a copy may keep the time of its source.
    digest: u64,
}

/// Loads the file of a unit, or takes it from those loaded before.
fn load_package(unit: &UnitRef) -> Result<Loaded, LoadError> {
    static LOADED: LazyLock<Mutex<HashMap<Identity, Loaded>>> = LazyLock::new(Mutex::default);
    static REMOVE_STALE: Once = Once::new();
    REMOVE_STALE.call_once(copy::remove_stale);

    let refused = |refused| LoadError::Refused { unit: Box::new(unit.clone()), refused };
    let bytes = read(&unit.path).map_err(refused)?;
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    let path = unit.path.canonicalize().unwrap_or_else(|_| unit.path.clone());
    let identity = Identity { path, len: bytes.len(), digest: hasher.finish() };
    // Held while loading, so that two threads do not load the same file twice. An entry is only
    // added whole, so the list is sound even if a thread died holding the lock.
    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = loaded.get(&identity) {
        return Ok(known.clone());
    }
    let manifest = inspect_bytes(&bytes).map_err(refused)?;
    let copy = PrivateCopy::write(&unit.path, &bytes)
        .map_err(|error| LoadError::Copy { unit: Box::new(unit.clone()), error })?;
    let opened = open(copy.path());
    let copied_to = copy.path().display().to_string();
    copy.loaded();
    let plugin = opened.map_err(|error| match error {
        OpenError::System(reason) => {
            // The reader knows the file by its own name, not by the copy's.
            let reason = reason.replace(&copied_to, &unit.path.display().to_string());
            LoadError::Open { unit: Box::new(unit.clone()), reason: with_advice(reason) }
        }
        OpenError::Plugin(fault) => LoadError::Fault { unit: Box::new(unit.clone()), fault },
    })?;
    let package = Loaded { plugin, manifest };
    loaded.insert(identity, package.clone());
    Ok(package)
}

fn with_advice(reason: String) -> String {
    // Said by the loader where the folder for temporary files forbids running programs.
    if reason.contains("failed to map segment") {
        let folder = std::env::temp_dir();
        let advice = "may forbid running programs; set TMPDIR to a folder that allows it";
        return format!("{reason} ({} {advice})", folder.display());
    }
    reason
}

enum OpenError {
    System(String),
    Plugin(Fault),
}

/// Loads a library for the rest of the process's life and checks its function table.
fn open(path: &Path) -> Result<Plugin, OpenError> {
    let system = |error: libloading::Error| OpenError::System(one_line(&error));
    let library = open_library(path).map_err(system)?;
    // Plugins leave behind threads, thread-local values and function pointers, so a library is
    // never unloaded, not even one that turns out to be useless.
    let library = Box::leak(Box::new(library));
    // SAFETY: the symbol's address is taken and nothing is read through it here.
    let symbol = unsafe { library.get::<*const PluginTable>(table::SYMBOL) }.map_err(system)?;
    let table: *const PluginTable = *symbol;
    if table.is_null() || !table.is_aligned() {
        let line = format!("its function table lies at the impossible address {table:p}");
        return Err(OpenError::Plugin(Fault::Misbehaved(line)));
    }
    // SAFETY: inspection found room for a whole table at this symbol inside one segment of the
    // library, and the library stays loaded.
    unsafe { Plugin::from_table(table) }.map_err(OpenError::Plugin)
}

#[cfg(unix)]
fn open_library(path: &Path) -> Result<libloading::os::unix::Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // With `RTLD_NOW` a missing function is an error here rather than the end of the process at
    // its first call.
    // SAFETY: this runs the library's initialisers. Native plugins are trusted like any program;
    // the bytes are those inspected, in a file nobody else writes to.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }
}

#[cfg(windows)]
fn open_library(path: &Path) -> Result<libloading::os::windows::Library, libloading::Error> {
    // SAFETY: this runs the library's initialisers. Native plugins are trusted like any program;
    // the bytes are those inspected, in a file nobody else writes to.
    unsafe { libloading::os::windows::Library::new(path) }
}

fn one_line(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    if let Some(source) = error.source() {
        text = format!("{text}: {source}");
    }
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
