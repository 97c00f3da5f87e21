//! What can be typed behind `surfelshop check`.

use clap::Args;
use std::path::PathBuf;
use surfelshop_session::options::values::Size;
use surfelshop_session::options::{DeviceArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop check`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop check
  surfelshop check ./target/release/libmine.so
  surfelshop check ewa-phong --case grazing -o checked
  surfelshop check --list
  surfelshop check target/release/librim.so --scene ball.scene.toml --expect ball.exr
  surfelshop check target/release/librim.so --accept
The exit code is 1 where a case failed. What a plugin cannot do it may declare with the reason; such
cases are shown as limited and fail nothing. Cases of one's own are scenes with pictures, in a file check.toml
beside the folder target that the plugin lies in; `surfelshop help check` says how it looks. With -o the folder gets check.json, check.xml (as JUnit
writes it) and, of each failure, pictures.")]
pub struct CheckArguments {
    /// What is checked: files of plugins, ids of packages or units, or PACKAGE/UNIT [default: all
    /// plugins at hand].
    #[arg(value_name = "PLUGIN")]
    pub wanted: Vec<String>,
    /// A case to run; may be repeated [default: all].
    #[arg(long, value_name = "NAME")]
    pub case: Vec<String>,
    /// A scene or cloud that is drawn and held against --expect, instead of all other cases.
    #[arg(long, value_name = "FILE", requires = "expect", conflicts_with_all = ["cases", "case"])]
    pub scene: Option<PathBuf>,
    /// The picture that --scene has to look as, .exr (linear radiance) or .png (what a screen shows).
    #[arg(long, value_name = "PICTURE", requires = "scene")]
    pub expect: Option<PathBuf>,
    /// The least peak signal-to-noise ratio of --scene, in decibels [default: 40].
    #[arg(long, value_name = "DB", requires = "scene")]
    pub psnr: Option<f64>,
    /// The size that --scene is drawn at [default: that of the picture; 512x512 without one].
    #[arg(long, value_name = "WxH", requires = "scene", value_parser = Size::parse)]
    pub size: Option<Size>,
    /// A file of own cases instead of the check.toml of the plugin's project.
    #[arg(long, value_name = "FILE")]
    pub cases: Option<PathBuf>,
    /// Write what own cases draw as the pictures that are expected from now on, and check nothing.
    #[arg(long)]
    pub accept: bool,
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
