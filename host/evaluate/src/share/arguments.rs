//! What can be typed behind `surfelshop share`.

use clap::Args;
use std::path::PathBuf;
use surfelshop_session::options::path::PathSpec;
use surfelshop_session::options::values::{self, Setting};
use surfelshop_session::options::{DeviceArguments, PictureArguments, PluginFiles, PrintArguments};

/// Options of `surfelshop share`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop share bunny.ply -o bunny.html
  surfelshop share bunny.ply -r flat -r ewa-phong -r environment --env studio -o bunny.html
  surfelshop share room.scene.toml --path views -o room.html
  surfelshop share tile.laz --up z --color-by classification --path orbit:24 --size 800x600 -o tile.html
The page is one file that needs no network: turn it with the mouse, the arrow keys or the slider, choose renderers, and
wipe between two of them.")]
pub struct ShareArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// A renderer or tracer, by its id or as PACKAGE/ID, also behind a name of your own, as NAME=RENDERER; may be
    /// repeated: each is switched to by a click [default: those of the scene's views, else ewa-phong].
    #[arg(short, long, value_name = "[NAME=]RENDERER")]
    pub renderer: Vec<String>,
    /// The cameras: orbit:N, once around what the camera looks at in N pictures, views, the cameras of a scene's views, or
    /// along:N, a smooth way through these in N pictures.
    #[arg(long, value_name = "PATH", default_value = "orbit:36", value_parser = PathSpec::parse)]
    pub path: PathSpec,
    /// The page to write, .html.
    #[arg(short, long, value_name = "FILE", value_parser = page_file)]
    pub out: PathBuf,
    /// Most bytes of the page: pictures get smaller and are compressed more until they fit, and a line says how.
    #[arg(long, value_name = "SIZE", default_value = "10MB", value_parser = values::bytes)]
    pub most: u64,
    /// The title [default: the names of the files].
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// A parameter, as NAME:id=value or RENDERER:id=value, or id=value for all that have it; may be repeated.
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

fn page_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("html" | "htm") => Ok(path),
        _ => Err("expected a name ending in .html".to_owned()),
    }
}
