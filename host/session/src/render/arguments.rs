//! What can be typed behind `surfelshop render`.

use crate::options::part::Part;
use crate::options::path::PathSpec;
use crate::options::values::{self, OutputFile, Setting};
use crate::options::{Bits, DeviceArguments, PictureArguments, PluginFiles, PrintArguments};
use clap::Args;
use std::path::PathBuf;
use surfelshop_api::graph::Output;

/// Options of `surfelshop render`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop render bunny.ply -o bunny.png
  surfelshop render bunny.ply -r flat -o bunny.png --size 1920x1080 --camera front --zoom 1.5
  surfelshop render a.ply b.ply -o both.exr --light 0,1,0 --light -1,0,0:0.2,0.2,0.3
  surfelshop render bunny.ply -o bunny.png --light point:0.1,0.3,0.1:0.05,0.05,0.05
  surfelshop render bunny.ply -o bunny.png --camera \"0,0.1,0.6; 0,0.1,0; 0,1,0; 30\"
  surfelshop render bunny.ply -r environment --env studio -o bunny.png
  surfelshop render bunny.ply -o depth.png --output depth
  surfelshop render scan.ply -o classes.png --up z --color-by classification --hide \
      classification=7,18 --legend
  surfelshop render room.scene.toml -o room.png --exposure 1
  surfelshop render bunny.ply -o turn/bunny.png --path orbit:240")]
pub struct RenderArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    ///
    /// A scene brings clouds with their places, camera, light and surface settings, and the renderer
    /// and parameters of its first view, or of its first one with the renderer that is typed. Options
    /// that are typed count instead of what the scene says.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// The renderer, by its id or as PACKAGE/ID; `surfelshop plugins` lists them. It draws the clouds for which a scene
    /// names none. Where none is typed, clouds with columns that a renderer needs, such as Gaussian splats, are drawn by
    /// that.
    #[arg(short, long, value_name = "RENDERER", default_value = "ewa-phong")]
    pub renderer: String,
    /// A captured graph to draw instead of a renderer's: a file that --save-graph wrote. No plugin is
    /// loaded; the camera and the parameters that went into its numbers are those of then.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["renderer", "set"])]
    pub graph: Option<PathBuf>,
    /// Also write the graph that the renderer described, for --graph, a test or a bug report.
    #[arg(long, value_name = "FILE")]
    pub save_graph: Option<PathBuf>,
    /// The picture to write, .png or .exr; may be repeated.
    ///
    /// PNG holds what a screen shows. EXR holds linear 32-bit floats before exposure, tone mapping
    /// and background, with alpha premultiplied: the layers colour (R, G, B, A), depth.Z, normal
    /// and albedo, or only the one chosen with --output.
    #[arg(short, long, required = true, value_name = "FILE", value_parser = OutputFile::parse)]
    pub out: Vec<OutputFile>,
    /// What the picture shows: color, depth, normal, albedo, ao, or debug.NAME.
    ///
    /// As PNG: depth runs from near (white) to far (dark) over the range that is covered, normals
    /// are n * 0.5 + 0.5 in world space, ao is as it is, albedo is sRGB-encoded.
    #[arg(long, value_name = "NAME", value_parser = values::output)]
    pub output: Option<Output>,
    /// Several cameras: orbit:N, once around what the camera looks at in N pictures, views, the cameras of a scene's
    /// views, or along:N, a smooth way through these in N pictures. Pictures get numbers: bunny-0001.png.
    #[arg(long, value_name = "PATH", value_parser = PathSpec::parse, conflicts_with = "save_graph")]
    pub path: Option<PathSpec>,
    /// Draw one part of the path's pictures, such as 3/8, into a folder part-3-of-8 beside the file that --out names; run
    /// again, it draws what is missing. `surfelshop merge` joins parts.
    #[arg(long, value_name = "K/N", value_parser = Part::parse, requires = "path")]
    pub part: Option<Part>,
    /// What is seen, and in which light.
    #[command(flatten)]
    pub picture: PictureArguments,
    /// Draw what colours mean into a corner of each PNG, where numbers or categories colour surfels.
    #[arg(long)]
    pub legend: bool,
    /// Draw the measures of the scene into each PNG: their lines and numbers.
    #[arg(long)]
    pub measures: bool,
    /// Bits per channel of a PNG.
    #[arg(long, value_enum, value_name = "BITS", default_value_t)]
    pub bits: Bits,
    /// A parameter of the renderer, as id=value or RENDERER:id=value; may be repeated.
    ///
    /// An id that does not exist is answered with the list of those that do, and their ranges.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub set: Vec<Setting>,
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
