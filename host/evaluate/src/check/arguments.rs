//! What can be typed behind `surfelshop check`.

use clap::Args;
use std::path::PathBuf;
use surfelshop_session::options::{DeviceArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop check`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop check
  surfelshop check ./target/release/libmine.so
  surfelshop check ewa-phong --case grazing -o checked
  surfelshop check --list
The exit code is 1 where a case failed. What a plugin cannot do it may declare with the reason; such
cases are shown as limited and fail nothing. With -o the folder gets check.json, check.xml (as JUnit
writes it) and, of each failure, pictures.")]
pub struct CheckArguments {
    /// What is checked: files of plugins, ids of packages or units, or PACKAGE/UNIT [default: all
    /// plugins at hand].
    #[arg(value_name = "PLUGIN")]
    pub wanted: Vec<String>,
    /// A case to run; may be repeated [default: all].
    #[arg(long, value_name = "NAME")]
    pub case: Vec<String>,
    /// List the cases with what must hold in each, and check nothing.
    #[arg(long)]
    pub list: bool,
    /// The folder to write to; made where it does not exist.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
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
