//! What can be typed behind `surfelshop compare` and `surfelshop report`.

use super::{DeviceArguments, PictureArguments, PluginFiles, ReportArguments};
use crate::compare::PathSpec;
use crate::values::{self, Limit, Setting};
use clap::{ArgGroup, Args};
use std::path::PathBuf;
use std::time::Duration;

/// The names of the fields that only pictures have a use for.
pub(crate) fn options_of_pictures() -> Vec<String> {
    let all = PictureArguments::augment_args(clap::Command::new("pictures"));
    all.get_arguments().map(|argument| argument.get_id().to_string()).collect()
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop compare bunny.ply -r flat -r ewa-phong -o compared
  surfelshop compare bunny.ply -r environment -r procedural --set procedural:lighting=natural \\
      --env studio --reference reference --set reference:samples=256 -o compared
  surfelshop compare bunny.ply -r mine --reference truth.exr --fail-above rmse=0.01 -o compared
  surfelshop compare bunny.ply -r two=environment -r four=environment --set two:sh-order=2 \\
      --set four:sh-order=4 --reference four --path orbit:24 --env studio -o compared
The folder holds index.html, which needs no network, metrics.csv, metrics.json and the pictures.")]
pub(crate) struct CompareArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// A renderer or tracer, by its id or as PACKAGE/ID, also behind a name of your own, as
    /// NAME=RENDERER; may be repeated.
    #[arg(short, long, required = true, value_name = "[NAME=]RENDERER")]
    pub(crate) renderer: Vec<String>,
    /// What the others are measured against: one of their names, another renderer or tracer, or a
    /// picture (.exr of linear radiance) [default: the first renderer].
    #[arg(long, value_name = "NAME|RENDERER|FILE")]
    pub(crate) reference: Option<String>,
    /// Several cameras: orbit:N, once around what the camera looks at in N pictures, or views, the
    /// cameras of a scene's views.
    #[arg(long, value_name = "PATH", value_parser = PathSpec::parse)]
    pub(crate) path: Option<PathSpec>,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Fail where a metric of any renderer but the reference is above a value, as rmse=0.01; may be
    /// repeated. A picture that cannot be measured fails in any case.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = values::limit)]
    pub(crate) fail_above: Vec<Limit>,
    /// Fail where a metric of which more is better, such as psnr or ssim, is below a value; may be
    /// repeated.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = values::limit)]
    pub(crate) fail_below: Vec<Limit>,
    /// Frames that are timed of each renderer, in turns with the others, after one that is not.
    #[arg(long, value_name = "NUMBER", default_value_t = 5, value_parser = values::repeats)]
    pub(crate) repeats: u32,
    /// A parameter, as NAME:id=value or RENDERER:id=value, or id=value for all that have it; may be
    /// repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop report bunny.ply -r environment --env studio --set ks=0 --knob sh-order=1,2,3,4,5 \\
      --reference reference --reference-set mode=environment --reference-set samples=1024 -o orders
  surfelshop report bunny.ply -r procedural --set noise=volume --knob volume-size=16,32,64,128 \\
      --reference-set noise=volume --reference-set volume-size=256 -o volumes
  surfelshop report bunny.ply -t ambient-occlusion --knob tolerance=0.001,0.004,0.016,0.064 \\
      --reference-set method=rays --reference-set rays=4096 --reference-set seed=1 \\
      --reference-again seed=2 -o bakes
The folder holds index.html, which needs no network, report.csv, report.json, a plot for each knob and
what was measured so far: run it again after it was interrupted, and it goes on.")]
#[command(group = ArgGroup::new("subject").required(true))]
pub(crate) struct SweepArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together. A tool takes one.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The renderer or tracer, by its id or as PACKAGE/ID.
    #[arg(short, long, value_name = "RENDERER", group = "subject")]
    pub(crate) renderer: Option<String>,
    /// The tool, by its id or as PACKAGE/ID: errors are those of a column that it makes.
    #[arg(short, long, value_name = "TOOL", group = "subject")]
    pub(crate) tool: Option<String>,
    /// A parameter to turn and its values, as id=value,value,…; may be repeated [default: all that are
    /// declared to trade time for quality, over their ranges].
    #[arg(long, value_name = "ID=VALUES", value_parser = Setting::parse)]
    pub(crate) knob: Vec<Setting>,
    /// What errors are measured against: a renderer or tracer, or a picture (.exr of linear radiance);
    /// of a tool, a tool or a cloud (.ply) with the column [default: itself, with what --reference-set
    /// says].
    #[arg(long, value_name = "RENDERER|TOOL|FILE")]
    pub(crate) reference: Option<String>,
    /// A parameter of the reference, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) reference_set: Vec<Setting>,
    /// Makes a tool's reference a second time, with this parameter otherwise, such as seed=1: the mean
    /// of both counts, and their difference tells its noise.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) reference_again: Option<Setting>,
    /// The column whose values are compared [default: the first that the tool makes].
    #[arg(long, value_name = "NAME")]
    pub(crate) column: Option<String>,
    /// Leave out the values of a tool's knob behind one whose first run took longer than this.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = values::seconds)]
    pub(crate) longest: Duration,
    /// Threads of a tool's loops [default: as many as the machine has].
    #[arg(long, value_name = "NUMBER", default_value_t = 0, hide_default_value = true,
          value_parser = values::threads)]
    pub(crate) threads: usize,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Frames or runs that are timed for each value, in turns with the other values, after one that is
    /// not.
    #[arg(long, value_name = "NUMBER", default_value_t = 7, value_parser = values::repeats)]
    pub(crate) repeats: u32,
    /// A parameter that stays, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}
