//! Which plugins to use, how far to trust them, and how long to wait for them.

use crate::input::formats::typed_values;
use crate::options::values;
use crate::options::values::Setting;
use crate::output::terminal;
use crate::trust_file::TrustFile;
use anyhow::{Context as _, ensure};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::time::Duration;
use surfelshop_api::params::Values;
use surfelshop_cloud::ColorBits;
use surfelshop_runtime::plugins::{
    Contents, Entry, Origin, Place, Registry, SearchPath, Timeouts, Trust, has_library_extension,
};

/// Plugins beside the installed ones.
#[derive(Clone, Debug, Default, Args)]
pub struct PluginFiles {
    /// A plugin file to use besides the installed ones; may be repeated.
    ///
    /// Most plugins are native libraries: using a renderer of one runs its code with your rights, as starting
    /// a program does. One that you have not used before needs --trust, or `surfelshop plugins trust`. A WebAssembly
    /// module (.wasm) runs in a sandbox and needs neither.
    #[arg(long = "plugin", value_name = "FILE")]
    pub plugin: Vec<PathBuf>,
    /// Trust every plugin that is found, for this once.
    #[arg(long)]
    pub trust: bool,
    /// A list of plugins that are trusted, by their SHA-256 or place, instead of your own list;
    /// `surfelshop plugins trust --trust-file FILE` writes one.
    #[arg(long, value_name = "FILE")]
    pub trust_file: Option<PathBuf>,
    /// Run a plugin's library in a process of its own: a package, as in org.example.mine, or a file; may be repeated.
    ///
    /// If its code crashes, that process ends, and nothing else does. `surfelshop plugins isolate` remembers it.
    #[arg(long, value_name = "PLUGIN")]
    pub isolate: Vec<String>,
    /// How long the program waits for a plugin's own code before it gives it up [default: 10 to
    /// start, 5 for a frame, 3 for a tool to stop].
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds)]
    pub patience: Option<Duration>,
    /// Read and write files through modules of the program's own formats, which run in a sandbox, instead of its
    /// libraries: what a hostile file does to its reader then ends there.
    ///
    /// They lie in `sandbox-formats` beside the program; in a checkout `cargo sandbox-formats` builds them. PLY and
    /// .surfels files are read by the program itself.
    #[arg(long)]
    pub sandbox_formats: bool,
    /// Builds that were said yes to in the window, until it is closed.
    #[arg(skip)]
    pub trusted_once: Vec<Contents>,
    /// How files of plugins' formats are read.
    #[command(flatten)]
    pub format: FormatArguments,
}

/// How files of plugins' formats are read.
#[derive(Clone, Debug, Default, Args)]
pub struct FormatArguments {
    /// Read files with this format, whatever they look like: ply, obj, off, or one that `surfelshop plugins` lists.
    #[arg(long, value_name = "FORMAT")]
    pub format: Option<String>,
    /// What the columns of a text file hold, such as x,y,z,intensity,-; `-` leaves one out.
    ///
    /// Without it they are guessed, and `surfelshop info` shows what was.
    #[arg(long, value_name = "NAMES")]
    pub text_columns: Option<String>,
    /// A parameter of the format, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub format_set: Vec<Setting>,
    /// What colours of 16 bits hold: values of 8 bits, of 16, or what their values tell.
    #[arg(long, value_enum, value_name = "BITS", default_value_t)]
    pub color_bits: FileColorBits,
}

/// What colours of 16 bits hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FileColorBits {
    /// 8 bits where no value is larger than 255, else 16.
    #[default]
    Auto,
    /// Values of 8 bits, as some programs leave them in LAS files; larger ones count as 255.
    #[value(name = "8")]
    Eight,
    /// Values of 16 bits, however dark they are.
    #[value(name = "16")]
    Sixteen,
}

impl From<FileColorBits> for ColorBits {
    fn from(bits: FileColorBits) -> Self {
        match bits {
            FileColorBits::Auto => Self::Told,
            FileColorBits::Eight => Self::Eight,
            FileColorBits::Sixteen => Self::Sixteen,
        }
    }
}

impl FormatArguments {
    /// The values as they were typed.
    pub(crate) fn values(&self) -> Option<Values> {
        let columns = self.text_columns.as_deref().map(|names| ("columns", names));
        let typed = self.format_set.iter().map(|set| (set.id.as_str(), set.value.as_str()));
        typed_values(columns.into_iter().chain(typed))
    }
}

impl PluginFiles {
    /// How long to wait for plugins.
    pub fn patience(&self) -> Timeouts {
        self.patience.map_or_else(Timeouts::default, Timeouts::of)
    }

    /// Where to look for plugins, and which may run.
    pub fn search(&self) -> anyhow::Result<SearchPath> {
        let mut trust = if self.trust { Trust::everything() } else { Trust::default() };
        match TrustFile::named(self.trust_file.as_deref()) {
            Ok(list) => trust.add(list.trust()),
            // What came with the program works without it; a list that was named is needed.
            Err(error) if self.trust_file.is_none() => {
                terminal::warn_once(format!("{error:#}"));
            }
            Err(error) => return Err(error),
        }
        for contents in &self.trusted_once {
            trust.build(*contents);
        }
        for plugin in &self.isolate {
            match is_plugin_file(plugin) {
                true => trust.isolate_file(Path::new(plugin)),
                false => trust.isolate(plugin),
            }
        }
        let mut search = SearchPath::standard(self.plugin.clone(), trust);
        if self.sandbox_formats {
            search.folders.push(Place::new(modules_of_formats()?, Origin::CommandLine));
        }
        Ok(search)
    }
}

/// Whether what was typed for a plugin is a file and no package.
#[must_use]
pub fn is_plugin_file(plugin: &str) -> bool {
    plugin.contains(std::path::is_separator) || has_library_extension(Path::new(plugin))
}

/// Refuses what was to be isolated and is not there: it would run in the program unnoticed.
pub(crate) fn check_isolated(plugins: &[String], registry: &Registry) -> anyhow::Result<()> {
    for plugin in plugins {
        let is_it = |entry: &Entry| match is_plugin_file(plugin) {
            true => Path::new(plugin).canonicalize().is_ok_and(|file| file == entry.file),
            false => entry.manifest().is_some_and(|manifest| manifest.id == *plugin),
        };
        ensure!(
            registry.entries().iter().any(is_it),
            "--isolate {plugin}: expected the package or the file of a plugin that is found, as \
             `surfelshop plugins` lists them"
        );
    }
    Ok(())
}

/// The folder of the modules of the program's own formats.
fn modules_of_formats() -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().context("the place of the program is not known")?;
    let folder = program.with_file_name("sandbox-formats");
    let has_modules = folder.read_dir().is_ok_and(|mut files| {
        files.any(|file| file.is_ok_and(|file| has_library_extension(&file.path())))
    });
    ensure!(
        has_modules,
        "--sandbox-formats: expected modules of formats in {}, found none; `cargo sandbox-formats` in a checkout \
         builds them",
        folder.display()
    );
    Ok(folder)
}
