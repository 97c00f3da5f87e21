//! What can be typed behind `surfelshop explain`.

use clap::Args;
use std::path::PathBuf;
use surfelshop_api::graph::Output;
use surfelshop_session::options::values::{self, Setting};
use surfelshop_session::options::{DeviceArguments, PictureArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop explain`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop explain scan.ply
  surfelshop explain scan.ply -r environment --env studio --set ks=0
  surfelshop explain scan.ply -r ewa-phong --measure
  surfelshop explain room.scene.toml -r procedural --output color --output depth --json")]
pub struct ExplainArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The renderer, by its id or as PACKAGE/ID; `surfelshop plugins` lists them.
    #[arg(short, long, value_name = "RENDERER", default_value = "ewa-phong")]
    pub renderer: String,
    /// An output that is asked for: color, depth, normal, albedo, ao, or debug.NAME; may be repeated
    /// [default: color].
    #[arg(long, value_name = "NAME", value_parser = values::output)]
    pub output: Vec<Output>,
    /// A parameter, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub set: Vec<Setting>,
    /// Measures what leaving out saves: each thing is put back in for so many frames, in turns with the
    /// frame as it is [default: 30].
    #[arg(long, value_name = "FRAMES", num_args = 0..=1, default_missing_value = "30",
          value_parser = values::frames)]
    pub measure: Option<usize>,
    /// What is seen, and in which light.
    #[command(flatten)]
    pub picture: PictureArguments,
    /// Plugins beside the installed ones.
    #[command(flatten)]
    pub plugins: PluginFiles,
    /// The graphics device.
    #[command(flatten)]
    pub device: DeviceArguments,
    /// The form of what is printed.
    #[command(flatten)]
    pub report: PrintArguments,
}
