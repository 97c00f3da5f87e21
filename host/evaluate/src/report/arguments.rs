//! What can be typed behind `surfelshop report`.

use clap::{ArgGroup, Args};
use std::path::PathBuf;
use std::time::Duration;
use surfelshop_session::options::part::Part;
use surfelshop_session::options::values::{self, Setting};
use surfelshop_session::options::{DeviceArguments, PictureArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop report`.
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
pub struct ReportArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together. A tool takes one.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The renderer or tracer, by its id or as PACKAGE/ID.
    #[arg(short, long, value_name = "RENDERER", group = "subject")]
    pub renderer: Option<String>,
    /// The tool, by its id or as PACKAGE/ID: errors are those of a column that it makes.
    #[arg(short, long, value_name = "TOOL", group = "subject")]
    pub tool: Option<String>,
    /// A parameter to turn and its values, as id=value,value,…; may be repeated [default: all that are
    /// declared to trade time for quality, over their ranges].
    #[arg(long, value_name = "ID=VALUES", value_parser = Setting::parse)]
    pub knob: Vec<Setting>,
    /// What errors are measured against: a renderer or tracer, or a picture (.exr of linear radiance);
    /// of a tool, a tool or a cloud (.ply) with the column [default: itself, with what --reference-set
    /// says].
    #[arg(long, value_name = "RENDERER|TOOL|FILE")]
    pub reference: Option<String>,
    /// A parameter of the reference, as id=value; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub reference_set: Vec<Setting>,
    /// Makes a tool's reference a second time, with this parameter otherwise, such as seed=1: the mean
    /// of both counts, and their difference tells its noise.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub reference_again: Option<Setting>,
    /// The column whose values are compared [default: the first that the tool makes].
    #[arg(long, value_name = "NAME")]
    pub column: Option<String>,
    /// Leave out the values of a tool's knob behind one whose first run took longer than this.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = values::seconds)]
    pub longest: Duration,
    /// Threads of a tool's loops [default: as many as the machine has].
    #[arg(long, value_name = "NUMBER", default_value_t = 0, hide_default_value = true,
          value_parser = values::threads)]
    pub threads: usize,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// Measure one part of the values, such as 3/8, into a folder part-3-of-8 in that of --out; run again, it goes on.
    /// `surfelshop merge` joins parts. 0/8 makes the reference for all of them; without it each part makes its own.
    #[arg(long, value_name = "K/N", value_parser = Part::parse_with_shared)]
    pub part: Option<Part>,
    /// Frames or runs that are timed for each value, in turns with the other values, after one that is
    /// not.
    #[arg(long, value_name = "NUMBER", default_value_t = 7, value_parser = values::repeats)]
    pub repeats: u32,
    /// A parameter that stays, as id=value; may be repeated.
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
