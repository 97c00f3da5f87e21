//! What the window knows of plugins.

use super::previews::Previews;
use super::tools::Tools;
use crate::render_thread::UnitHealth;
use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;
use surfelshop_api::params::ParamDecl;
use surfelshop_runtime::plugins::{self, Contents, Crash, CrashGuard, CrashMark, Registry};
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::options::{DeviceArguments, PluginFiles};

/// The installed plugins, their trust and their failures.
pub(crate) struct Plugins {
    pub(crate) tools: Tools,
    pub(crate) registry: Registry,
    /// The pictures that plugins were packed with, as far as they were shown.
    pub(crate) previews: Previews,
    /// The parameters of each renderer that was loaded.
    pub(crate) declared: HashMap<String, Vec<ParamDecl>>,
    /// Renderers that failed.
    pub(crate) unit_health: Vec<UnitHealth>,
    /// The plugin in use when the program crashed, until the user has decided about it.
    pub(crate) crash: Option<Crash>,
    /// Repeats the question at the next start, should this program be killed first.
    pub(crate) crash_mark: Option<CrashMark>,
    /// Untrusted plugins that the user has answered about without trusting them for good.
    pub(crate) undecided: BTreeSet<Contents>,
    /// A trust list in place of the user's own.
    pub(crate) trust_file: Option<PathBuf>,
    /// The options that plugins were searched with.
    files: PluginFiles,
}

impl Plugins {
    pub(crate) fn new(registry: Registry, device: &DeviceArguments, files: &PluginFiles) -> Self {
        let crash = CrashGuard::of_user().and_then(|guard| guard.crashed_last_time());
        Self {
            tools: Tools::new(device, files),
            registry,
            previews: Previews::default(),
            declared: HashMap::new(),
            unit_health: Vec::new(),
            crash_mark: crash.as_ref().and_then(|crash| CrashGuard::of_user()?.keep(crash).ok()),
            crash,
            undecided: BTreeSet::new(),
            trust_file: files.trust_file.clone(),
            files: files.clone(),
        }
    }

    /// Looks at plugin files that were dropped onto the window, besides the installed ones; says of each what it
    /// offers, or why it is refused.
    pub(crate) fn add_files(&mut self, files: &[PathBuf]) -> Vec<Result<String, String>> {
        self.files.plugin.extend_from_slice(files);
        let told = |file: &PathBuf| match plugins::inspect(file) {
            Ok((manifest, _)) => {
                let units = manifest.units.iter();
                let units = units.map(|unit| format!("{} {}", unit.kind.word(), unit.title));
                Ok(format!("{}: {}", manifest.id, units.collect::<Vec<_>>().join(", ")))
            }
            Err(refused) => Err(format!("{} {refused}", file.display())),
        };
        files.iter().map(told).collect()
    }

    /// The formats of the plugins that are known now.
    pub(crate) fn formats(&self) -> SessionFormats {
        SessionFormats::of_registry(&self.files, Arc::new(self.registry.clone()))
    }
}
