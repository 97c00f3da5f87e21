//! Brings units into memory.
//!
//! Lifecycle: read again the file that the scan found (it may have changed since, and a link to it may lead
//! elsewhere by now); ask whether these bytes are trusted; inspect them; write them to a private copy; load that; check the function table; ask the unit to describe
//! itself. All of it happens on a thread of its own, which is abandoned where initialisers or the
//! description take too long. Libraries stay loaded until the process ends, and units of one
//! package share one. A WebAssembly module is not asked about, and runs from the bytes that were inspected. A library that is
//! to be isolated is loaded by processes of its own, each from a private copy of these bytes.

use super::copy::{self, PrivateCopy};
use super::find::UnitRef;
use super::inspect::{Contents, Refused, inspect_bytes, read};
use super::modules::{self, is_module};
use super::open::{OpenError, open};
use super::registry::Registry;
use super::trust::{TrustState, resolved};
use super::watchdog::{Timeouts, within};
use crate::boundary::{Fault, Instance, Plugin};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock, Mutex, Once, PoisonError};
use std::time::{Duration, Instant};
use std::{fmt, io};
use surfelshop_api::abi::plugin_side::{Description, Package, Unit};
use surfelshop_api::manifest::{self, Manifest, UnitEntry};
use surfelshop_api::{HostInfo, UnitKind};

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
    /// Nobody has said that its code may run.
    #[error(
        "{unit} is {what}, and a plugin can do all that you can: to use it once add --trust, to trust it \
         from now on run `surfelshop plugins trust {file}`",
        file = .unit.path.display()
    )]
    Untrusted {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// What is new about it.
        what: &'static str,
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
    /// No instance could be made.
    #[error("{unit} could not start: {fault}")]
    Start {
        /// The unit asked for.
        unit: Box<UnitRef>,
        /// How it failed.
        fault: Fault,
    },
    /// The first frame could not be described.
    #[error("{unit} failed at its first frame: {fault}")]
    Frame {
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

impl LoadError {
    /// How the plugin's own code failed, where it did.
    #[must_use]
    pub fn fault(&self) -> Option<&Fault> {
        match self {
            Self::Fault { fault, .. } | Self::Start { fault, .. } | Self::Frame { fault, .. } => {
                Some(fault)
            }
            Self::Refused { .. }
            | Self::Replaced { .. }
            | Self::Untrusted { .. }
            | Self::Copy { .. }
            | Self::Open { .. }
            | Self::Static { .. } => None,
        }
    }
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
    /// The file it was loaded from, as it was then.
    pub contents: Contents,
    /// How long loading took.
    pub took: LoadTimes,
}

/// How long the steps of loading took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadTimes {
    /// Reading, judging and copying the file and bringing it into memory; reading alone where it
    /// was there already.
    pub load: Duration,
    /// The unit's description of itself.
    pub handshake: Duration,
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
    /// Makes an instance on the caller's thread, which then depends on the plugin to answer.
    ///
    /// # Errors
    /// Where the plugin fails.
    pub fn create(&self, host: &HostInfo) -> Result<Instance, Fault> {
        self.plugin.create(self.unit_index, host)
    }

    /// Where this unit's persistent resources live: apart from those of other units and of other
    /// builds of this one, which may have filled them otherwise.
    #[must_use]
    pub fn scope(&self) -> String {
        format!("{}/{} {}", self.manifest.id, self.unit.id, self.contents)
    }

    /// What stands for the renderer of a captured graph in lists: a unit of no package.
    #[must_use]
    pub fn of_graph(name: &str) -> Self {
        struct Nothing;
        impl Package for Nothing {
            const UNITS: &'static [Unit] = &[];
        }
        let title = format!("Captured graph {name}");
        let (id, kind, summary) = (name.to_owned(), UnitKind::Renderer, String::new());
        let (files, needs, handling) = Default::default();
        let unit = UnitEntry { kind, id, title, summary, files, needs, handling };
        let manifest = Manifest { id: "graph".to_owned(), ..Manifest::default() };
        let plugin = Plugin::of::<Nothing>();
        let (unit_index, description, contents, took) = Default::default();
        Self { manifest, unit, unit_index, description, plugin, contents, took }
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
        let (contents, took) = Default::default();
        Ok(Self { manifest, unit, unit_index, description, plugin, contents, took })
    }
}

impl Registry {
    /// Loads a unit that [`find`](Self::find) found, with the usual patience.
    ///
    /// # Errors
    /// As [`UnitRef::load`].
    pub fn load(&self, unit: &UnitRef) -> Result<LoadedUnit, LoadError> {
        unit.load(&Timeouts::default())
    }
}

impl UnitRef {
    /// Loads the unit from its file as it is now.
    ///
    /// A file that was loaded before and has the same contents is not loaded again.
    ///
    /// # Errors
    /// Where the file has changed to something that does not export the unit, or the plugin fails
    /// or does not answer in time; names the plugin, its file and the reason.
    pub fn load(&self, patience: &Timeouts) -> Result<LoadedUnit, LoadError> {
        let unit = self.clone();
        let timeouts = *patience;
        within(patience.load, move || load(&unit, timeouts))
            .unwrap_or_else(|fault| Err(LoadError::Fault { unit: Box::new(self.clone()), fault }))
    }
}

fn load(unit: &UnitRef, timeouts: Timeouts) -> Result<LoadedUnit, LoadError> {
    let started = Instant::now();
    let (Loaded { plugin, manifest }, contents) = load_package(unit, timeouts)?;
    let is_unit = |entry: &UnitEntry| entry.kind == unit.kind && entry.id == unit.id;
    let position = manifest.units.iter().position(is_unit);
    let index = position.and_then(|i| u32::try_from(i).ok());
    let Some(unit_index) = index.filter(|_| manifest.id == unit.package) else {
        let found = manifest.units.iter().map(|u| format!("{}/{}", manifest.id, u.id));
        let found = found.collect::<Vec<_>>().join(", ");
        return Err(LoadError::Replaced { unit: Box::new(unit.clone()), found });
    };
    let load = started.elapsed();
    let started = Instant::now();
    let description = plugin
        .describe(unit_index)
        .map_err(|fault| LoadError::Fault { unit: Box::new(unit.clone()), fault })?;
    let took = LoadTimes { load, handshake: started.elapsed() };
    let entry = manifest.units[unit_index as usize].clone();
    Ok(LoadedUnit { manifest, unit: entry, unit_index, description, plugin, contents, took })
}

/// A library in memory.
#[derive(Clone)]
struct Loaded {
    plugin: Plugin,
    manifest: Manifest,
}

/// A library that is in memory or about to be; locked while somebody loads it, so that two threads
/// do not load the same file twice and one that hangs does not keep others from loading.
type Slot = Arc<Mutex<Option<Loaded>>>;

/// What tells one library in memory from another: its file, what that holds, and whether it is isolated.
type Key = (PathBuf, Contents, bool);

/// Loads the file of a unit, or takes it from those loaded before.
fn load_package(unit: &UnitRef, timeouts: Timeouts) -> Result<(Loaded, Contents), LoadError> {
    static SLOTS: LazyLock<Mutex<HashMap<Key, Slot>>> = LazyLock::new(Mutex::default);
    static REMOVE_STALE: Once = Once::new();
    REMOVE_STALE.call_once(copy::remove_stale);

    let refused = |refused| LoadError::Refused { unit: Box::new(unit.clone()), refused };
    // Where there was a file is a link now, perhaps: then that is asked about which it leads to.
    let path = resolved(&unit.file);
    let bytes = read(&path).map_err(refused)?;
    let contents = Contents::of(&bytes);
    let is_module = is_module(&bytes);
    let is_isolated = !is_module && unit.is_isolated();
    if !is_module && unit.standing(&path, contents) == TrustState::New {
        let what = match unit.found {
            TrustState::Build => "another build than the one that you trust",
            _ => "from a place that is new here",
        };
        return Err(LoadError::Untrusted { unit: Box::new(unit.clone()), what });
    }
    // Values are only ever added whole, so both are sound even if a thread died holding the lock.
    let slots = SLOTS.lock();
    let key = (path, contents, is_isolated);
    let slot = slots.unwrap_or_else(PoisonError::into_inner).entry(key).or_default().clone();
    let mut loaded = slot.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = &*loaded {
        return Ok((known.clone(), contents));
    }
    let manifest = inspect_bytes(&bytes).map_err(refused)?;
    if is_module {
        // It runs from memory, so there is no file that somebody else could write to.
        let plugin = modules::sandboxed(&bytes)
            .map_err(|reason| LoadError::Open { unit: Box::new(unit.clone()), reason })?;
        let package = loaded.insert(Loaded { plugin, manifest });
        return Ok((package.clone(), contents));
    }
    if is_isolated {
        let plugin = isolated(bytes, &unit.path, timeouts)
            .map_err(|fault| LoadError::Fault { unit: Box::new(unit.clone()), fault })?;
        let package = loaded.insert(Loaded { plugin, manifest });
        return Ok((package.clone(), contents));
    }
    let copy = PrivateCopy::write(&unit.path, &bytes)
        .map_err(|error| LoadError::Copy { unit: Box::new(unit.clone()), error })?;
    let opened = open(copy.path(), &unit.path);
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
    let package = loaded.insert(Loaded { plugin, manifest });
    Ok((package.clone(), contents))
}

/// A library in processes of its own.
#[cfg(unix)]
fn isolated(bytes: Vec<u8>, path: &Path, timeouts: Timeouts) -> Result<Plugin, Fault> {
    let package = crate::isolate::Package::open(bytes, path.to_owned(), timeouts)?;
    Ok(Plugin::apart(package))
}

#[cfg(not(unix))]
fn isolated(_bytes: Vec<u8>, _path: &Path, _timeouts: Timeouts) -> Result<Plugin, Fault> {
    let line = "processes of their own for plugins need a Unix system; leave out --isolate";
    Err(Fault::Error(line.to_owned()))
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
