//! What can be typed behind `surfelshop explain`.

use super::{DeviceArguments, PictureArguments, PluginFiles, ReportArguments};
use crate::values::{self, Setting};
use clap::Args;
use std::path::PathBuf;
use surfelshop_api::graph::Output;

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop explain scan.ply
  surfelshop explain scan.ply -r environment --env studio --set ks=0
  surfelshop explain scan.ply -r ewa-phong --measure
  surfelshop explain room.scene.toml -r procedural --output color --output depth --json")]
pub(crate) struct ExplainArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The renderer, by its id or as PACKAGE/ID; `surfelshop plugins` lists them.
    #[arg(short, long, value_name = "RENDERER", default_value = "ewa-phong")]
    pub(crate) renderer: String,
    /// An output that is asked for: color, depth, normal, albedo, ao, or debug.NAME; may be repeated
    /// [default: color].
    #[arg(long, value_name = "NAME", value_parser = values::output)]
    pub(crate) output: Vec<Output>,
    /// A parameter, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    /// Measures what leaving out saves: each thing is put back in for so many frames, in turns with the
    /// frame as it is [default: 30].
    #[arg(long, value_name = "FRAMES", num_args = 0..=1, default_missing_value = "30",
          value_parser = values::frames)]
    pub(crate) measure: Option<usize>,
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}
