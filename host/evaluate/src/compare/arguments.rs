//! What can be typed behind `surfelshop compare`.

use clap::Args;
use std::path::PathBuf;
use surfelshop_session::options::part::Part;
use surfelshop_session::options::path::PathSpec;
use surfelshop_session::options::values::{self, Limit, Setting};
use surfelshop_session::options::{DeviceArguments, PictureArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop compare`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop compare bunny.ply -r flat -r ewa-phong -o compared
  surfelshop compare bunny.ply -r environment -r procedural --set procedural:lighting=natural \\
      --env studio --reference reference --set reference:samples=256 -o compared
  surfelshop compare bunny.ply -r mine --reference truth.exr --fail-above rmse=0.01 -o compared
  surfelshop compare bunny.ply -r two=environment -r four=environment --set two:sh-order=2 \\
      --set four:sh-order=4 --reference four --path orbit:24 --env studio -o compared
The folder holds index.html, which needs no network, metrics.csv, metrics.json and the pictures.")]
pub struct CompareArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// A renderer or tracer, by its id or as PACKAGE/ID, also behind a name of your own, as
    /// NAME=RENDERER; may be repeated.
    #[arg(short, long, required = true, value_name = "[NAME=]RENDERER")]
    pub renderer: Vec<String>,
    /// What the others are measured against: one of their names, another renderer or tracer, or a
    /// picture (.exr of linear radiance) [default: the first renderer].
    #[arg(long, value_name = "NAME|RENDERER|FILE")]
    pub reference: Option<String>,
    /// Several cameras: orbit:N, once around what the camera looks at in N pictures, views, the
    /// cameras of a scene's views, or along:N, a smooth way through these in N pictures.
    #[arg(long, value_name = "PATH", value_parser = PathSpec::parse)]
    pub path: Option<PathSpec>,
    /// Compare one part of the path's pictures, such as 3/8, into a folder part-3-of-8 in that of --out;
    /// `surfelshop merge` joins parts.
    #[arg(long, value_name = "K/N", value_parser = Part::parse, requires = "path")]
    pub part: Option<Part>,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Fail where a metric of any renderer but the reference is above a value, as rmse=0.01; may be
    /// repeated. A picture that cannot be measured fails in any case.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = values::limit)]
    pub fail_above: Vec<Limit>,
    /// Fail where a metric of which more is better, such as psnr or ssim, is below a value; may be
    /// repeated.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = values::limit)]
    pub fail_below: Vec<Limit>,
    /// Frames that are timed of each renderer, in turns with the others, after one that is not.
    #[arg(long, value_name = "NUMBER", default_value_t = 5, value_parser = values::repeats)]
    pub repeats: u32,
    /// A parameter, as NAME:id=value or RENDERER:id=value, or id=value for all that have it; may be
    /// repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub set: Vec<Setting>,
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
