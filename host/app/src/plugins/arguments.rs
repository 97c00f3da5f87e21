//! What can be typed behind `surfelshop plugins`.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop plugins
  surfelshop plugins new rim
  surfelshop plugins trust --place rim/target/release/librim.so
  surfelshop plugins add rim/target/release/librim.so
  surfelshop plugins pack rim -o rim.surfelplug
No plugin's code runs: files are judged by their bytes.")]
pub(crate) struct PluginsArguments {
    #[command(subcommand)]
    pub(crate) action: Option<PluginsAction>,
    /// A plugin file to look at besides the installed ones; may be repeated.
    #[arg(long = "plugin", value_name = "FILE", global = true)]
    pub(crate) plugin: Vec<PathBuf>,
    /// The list of trusted plugins to use instead of your own.
    #[arg(long, value_name = "FILE", global = true)]
    pub(crate) trust_file: Option<PathBuf>,
    /// Print one JSON object with everything, and nothing else.
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

/// What to do with plugins.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum PluginsAction {
    /// List them, with the files that were refused and why; what happens without a word, too.
    List,
    /// Start a plugin of your own: a project that builds, with a README of its own.
    New(NewArguments),
    /// Say in a plugin's project where this machine has the crates that it links: once on each machine.
    Sdk(SdkArguments),
    /// Let the code of these files run, now and later.
    Trust {
        /// The plugin files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
        /// Trust whatever will be built at this path, instead of this very build: for plugins that you
        /// work on.
        #[arg(long)]
        place: bool,
    },
    /// Take trust back from files, builds (by the digits that the list shows) and places.
    Distrust {
        /// Files, or at least 8 digits of a SHA-256.
        #[arg(required = true, value_name = "FILE|SHA256")]
        what: Vec<String>,
    },
    /// Run the libraries of packages in processes of their own from now on: if their code crashes, nothing else does.
    Isolate {
        /// Package ids, or plugin files.
        #[arg(required = true, value_name = "PACKAGE|FILE")]
        what: Vec<String>,
        /// Run them in the program again.
        #[arg(long)]
        undo: bool,
    },
    /// Pack a module into one file to hand on: with its README, its licence and a preview.
    Pack(PackArguments),
    /// Copy plugin files into your own folder, where every start finds them, and trust them.
    Add {
        /// The plugin files, or packed plugins (.surfelplug).
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Remove plugins from your own folder.
    Remove {
        /// Their package ids or file names.
        #[arg(required = true, value_name = "PACKAGE|FILE")]
        what: Vec<String>,
    },
}

/// What kind of plugin to start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum NewKind {
    /// A renderer of one WGSL function, called for each pixel of the surface.
    #[default]
    Shading,
    /// A renderer with a graph of its own: visibility, a buffer of its own and an effect over it.
    Graph,
    /// A renderer of one WGSL function, called for each surfel, that says what a splat looks like.
    Splat,
    /// A tool that edits columns of a cloud, with progress.
    Tool,
    /// An interactive tool, led over a cloud: a brush.
    Brush,
    /// A renderer that computes pixels itself, on all cores.
    Tracer,
    /// A file format that clouds are read from and written to.
    Format,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct PackArguments {
    /// The plugin's folder, with README.md and LICENSE: its only module (.wasm) is packed, from there or from
    /// target/wasm32-unknown-unknown/release.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// The file to write, such as look.surfelplug.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// What a renderer's preview shows [default: the sample].
    #[arg(long, value_name = "FILE")]
    pub(crate) cloud: Option<PathBuf>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct NewArguments {
    /// The folder to make; its last part names the plugin: a-z, 0-9 and -.
    #[arg(value_name = "NAME")]
    pub(crate) path: PathBuf,
    /// What kind of plugin.
    #[arg(long, value_enum, default_value_t)]
    pub(crate) kind: NewKind,
    /// The id of its package [default: org.example.NAME].
    #[arg(long, value_name = "ID")]
    pub(crate) id: Option<String>,
    /// Where `surfelshop-api` is: a folder, or the address of a git repository [default: what came with this
    /// program, named by its version].
    ///
    /// A folder that is not typed from the root is written from the project's folder, so that both can be
    /// moved together.
    #[arg(long, value_name = "PATH|URL")]
    pub(crate) api: Option<String>,
    /// The tag of that repository to build with.
    #[arg(long, value_name = "NAME", requires = "api", conflicts_with = "rev")]
    pub(crate) tag: Option<String>,
    /// The commit of that repository to build with.
    #[arg(long, value_name = "COMMIT", requires = "api")]
    pub(crate) rev: Option<String>,
    /// The oldest minor version of the ABI whose hosts the plugin is to run in [default: that of
    /// `surfelshop-api`].
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u16).range(0..=i64::from(surfelshop_api::manifest::ABI_MINOR)))]
    pub(crate) minor: Option<u16>,
    /// Have Cargo build a WebAssembly module, which runs in a sandbox and needs nobody's trust.
    #[arg(long)]
    pub(crate) sandbox: bool,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct SdkArguments {
    /// The folder of the project; its .cargo/config.toml is written.
    #[arg(value_name = "DIR", default_value = ".")]
    pub(crate) project: PathBuf,
    /// The checkout whose crates are meant [default: those that came with this program].
    #[arg(long, value_name = "PATH")]
    pub(crate) api: Option<String>,
}

#[cfg(test)]
mod tests {
    use crate::arguments::Cli;
    use clap::Parser as _;

    #[test]
    fn words_behind_plugins_are_known_or_refused() {
        let parsed = |line: &str| Cli::try_parse_from(line.split(' '));
        for line in [
            "",
            " --json",
            " list --json",
            " new a/b --kind tool",
            " new a --kind format",
            " new a --kind brush",
            " new a --kind splat",
            " new a --kind tracer --sandbox",
            " new a --api https://example.org/s.git --tag v1 --minor 7",
            " trust a.so --place",
            " isolate org.example.rim --undo",
            " pack rim -o rim.surfelplug",
            " sdk",
            " sdk rim --api ../surfelshop",
        ] {
            assert!(parsed(&format!("surfelshop plugins{line}")).is_ok(), "{line}");
        }
        for line in [
            " eat",
            " new",
            " trust",
            " isolate",
            " add",
            " new a --kind window",
            " new a --tag v1",
            " new a --minor 99",
            " pack rim",
        ] {
            assert!(parsed(&format!("surfelshop plugins{line}")).is_err(), "{line}");
        }
    }
}
