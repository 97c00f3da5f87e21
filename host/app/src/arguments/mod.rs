//! What can be typed behind `surfelshop`.

mod benchmark;
mod checking;
mod explaining;
mod measuring;
mod plugins;

pub(crate) use benchmark::BenchArguments;
pub(crate) use checking::CheckArguments;
pub(crate) use explaining::ExplainArguments;
pub(crate) use measuring::{CompareArguments, SweepArguments, options_of_pictures};
pub(crate) use plugins::{NewArguments, NewKind, PluginFiles, PluginsAction, PluginsArguments};

use crate::camera::CameraSpec;
use crate::light_spec::LightSpec;
use crate::values::{self, Backdrop, OutputFile, Setting, Size};
use clap::error::ErrorKind;
use clap::{ArgAction, Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use surfelshop_api::graph::Output;
use surfelshop_cloud::probe::Mapping;
use surfelshop_cloud::scene::Axis;

/// Renders point clouds as surfaces of oriented discs (surfels), with renderers that are plugins.
#[derive(Debug, Parser)]
#[command(
    name = "surfelshop",
    version,
    args_conflicts_with_subcommands = true,
    after_help = "Exit code: 0 done, 1 failed, 2 the command line was not understood.\n\
                  SURFELSHOP_PLUGINS names further plugin files and folders; \
                  SURFELSHOP_LOG=debug shows what happens."
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    #[command(flatten)]
    pub(crate) viewer: ViewerArguments,
}

impl Cli {
    /// Takes a word that names neither a command nor a file for a mistyped command.
    pub(crate) fn checked(self) -> Result<Self, clap::Error> {
        let mistyped = |file: &PathBuf| file.extension().is_none() && !file.exists();
        if let Some(word) = self.viewer.files.iter().find(|file| mistyped(file)) {
            let text = format!("`{}` is neither a command nor a file", word.display());
            return Err(Self::command().error(ErrorKind::InvalidSubcommand, text));
        }
        Ok(self)
    }
}

/// Without a command: the window.
#[derive(Clone, Debug, Args)]
pub(crate) struct ViewerArguments {
    /// Clouds to look at in a window; the sample where none is given.
    #[arg(value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The axis that points upwards; scans often have z.
    #[arg(long, value_enum, value_name = "AXIS", default_value_t)]
    pub(crate) up: UpAxis,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render clouds or a scene to a PNG or EXR picture.
    Render(Box<RenderArguments>),
    /// Run tools over a cloud, one after the other, and write what comes of it.
    Bake(Box<BakeArguments>),
    /// Render a scene with several renderers and compare what they make of it: pictures, maps of their
    /// errors, numbers and times, on one page.
    Compare(Box<CompareArguments>),
    /// Turn a renderer's knobs and report its error against its time: plots, tables, one page.
    Report(Box<SweepArguments>),
    /// Measure speed: frames, surfels alone, memory, growth and start-up, with each way to draw surfels.
    Bench(Box<BenchArguments>),
    /// Say what a frame is made of for a scene, what was left out of it, and why.
    Explain(Box<ExplainArguments>),
    /// Check plugins: against scenes with known answers, at the ends of their parameters, on hard clouds,
    /// and for what must not change anything.
    Check(CheckArguments),
    /// Say what is in a cloud and what was repaired or estimated while it was read, or what a scene
    /// shows.
    Info(InfoArguments),
    /// List the plugins, and the files that were refused with the reason.
    Plugins(PluginsArguments),
    /// Read a cloud and write it in another format, with the normals and radii it lacked.
    Convert(ConvertArguments),
    /// Render the sample cloud with every renderer.
    Demo(DemoArguments),
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop render bunny.ply -o bunny.png
  surfelshop render bunny.ply -r flat -o bunny.png --size 1920x1080 --camera front --zoom 1.5
  surfelshop render a.ply b.ply -o both.exr --light 0,1,0 --light -1,0,0:0.2,0.2,0.3
  surfelshop render bunny.ply -o bunny.png --light point:0.1,0.3,0.1:0.05,0.05,0.05
  surfelshop render bunny.ply -o bunny.png --camera \"0,0.1,0.6; 0,0.1,0; 0,1,0; 30\"
  surfelshop render bunny.ply -r environment --env studio -o bunny.png
  surfelshop render bunny.ply -o depth.png --output depth
  surfelshop render room.scene.toml -o room.png --exposure 1")]
pub(crate) struct RenderArguments {
    /// The clouds, and at most one scene (.scene.toml); all are shown together.
    ///
    /// A scene brings clouds with their places, camera, light and surface settings, and the renderer
    /// and parameters of its first view, or of its first one with the renderer that is typed. Options
    /// that are typed count instead of what the scene says.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The renderer, by its id or as PACKAGE/ID; `surfelshop plugins` lists them.
    #[arg(short, long, value_name = "RENDERER", default_value = "ewa-phong")]
    pub(crate) renderer: String,
    /// A captured graph to draw instead of a renderer's: a file that --save-graph wrote. No plugin is
    /// loaded; the camera and the parameters that went into its numbers are those of then.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["renderer", "set"])]
    pub(crate) graph: Option<PathBuf>,
    /// Also write the graph that the renderer described, for --graph, a test or a bug report.
    #[arg(long, value_name = "FILE")]
    pub(crate) save_graph: Option<PathBuf>,
    /// The picture to write, .png or .exr; may be repeated.
    ///
    /// PNG holds what a screen shows. EXR holds linear 32-bit floats before exposure, tone mapping
    /// and background, with alpha premultiplied: the layers colour (R, G, B, A), depth.Z, normal
    /// and albedo, or only the one chosen with --output.
    #[arg(short, long, required = true, value_name = "FILE", value_parser = OutputFile::parse)]
    pub(crate) out: Vec<OutputFile>,
    /// What the picture shows: color, depth, normal, albedo, ao, or debug.NAME.
    ///
    /// As PNG: depth runs from near (white) to far (dark) over the range that is covered, normals
    /// are n * 0.5 + 0.5 in world space, ao is as it is, albedo is sRGB-encoded.
    #[arg(long, value_name = "NAME", value_parser = values::output)]
    pub(crate) output: Option<Output>,
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    /// Bits per channel of a PNG.
    #[arg(long, value_enum, value_name = "BITS", default_value_t)]
    pub(crate) bits: Bits,
    /// A parameter of the renderer, as id=value or RENDERER:id=value; may be repeated.
    ///
    /// An id that does not exist is answered with the list of those that do, and their ranges.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

/// What is seen, and in which light: all that a renderer has no say in.
#[derive(Clone, Debug, Args)]
pub(crate) struct PictureArguments {
    /// Width and height in pixels, or one number for a square.
    #[arg(long, value_name = "WxH", default_value = "1024x1024", value_parser = Size::parse)]
    pub(crate) size: Size,
    #[command(flatten)]
    pub(crate) lens: LensArguments,
    /// A light, instead of the light beside the camera; may be repeated.
    ///
    /// `camera` is that light; x,y,z is a direction towards the light in world space. Both may be
    /// followed by `:r,g,b`, the radiance of a white diffuse surface that faces the light.
    /// `point:x,y,z` is a light at that place, and `spot:x,y,z:x,y,z` one that shines from the first
    /// place towards the second, within 30 degrees of that direction or as many as `:angle` says;
    /// `:angle,softness` says besides over which share of them, from the edge inwards, its light
    /// rises, 0 to 1 and usually 0.2. Both may end with `:r,g,b`, the intensity, which is that radiance
    /// at a distance of 1 and falls with the square of the distance.
    #[arg(long, value_name = "LIGHT", value_parser = LightSpec::parse, allow_hyphen_values = true)]
    pub(crate) light: Vec<LightSpec>,
    #[command(flatten)]
    pub(crate) environment: EnvironmentArguments,
    /// Factor on brightness in stops: 1 doubles, -1 halves.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = values::stops,
          allow_hyphen_values = true)]
    pub(crate) exposure: f32,
    /// How brightness above white is brought down in a PNG.
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    pub(crate) tone_map: ToneMapChoice,
    /// What stands where no surfel is: transparent, white, black, gray, #rrggbb or r,g,b (linear).
    #[arg(long, value_name = "COLOR", default_value = "transparent",
          value_parser = Backdrop::parse)]
    pub(crate) background: Backdrop,
    /// Factor on every surfel's radius.
    #[arg(long, value_name = "FACTOR", value_parser = values::factor,
          allow_hyphen_values = true)]
    pub(crate) radius_scale: Option<f32>,
    /// How far behind the nearest surfel others still blend with it, in surfel radii, 0 to 16.
    #[arg(long, value_name = "RADII", value_parser = values::depth_tolerance,
          allow_hyphen_values = true)]
    pub(crate) depth_tolerance: Option<f32>,
    /// Draw several surfels as one where that has at most this radius, in pixels: large clouds take a
    /// fraction of the time. Renderers say whether they take it [default: 0, never].
    #[arg(long, value_name = "PIXELS", default_value_t = 0.0, hide_default_value = true,
          value_parser = values::detail, allow_hyphen_values = true)]
    pub(crate) detail: f32,
    /// Radius in pixels of the filter that keeps fine surfels from vanishing and flickering, 0
    /// (none) to 4 [default: 1].
    #[arg(long, value_name = "PIXELS", value_parser = values::low_pass,
          allow_hyphen_values = true)]
    pub(crate) low_pass: Option<f32>,
    /// Leave out surfels that are seen from behind; `--one-sided=false` draws them where a scene
    /// does not.
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true,
          default_value_t = false, default_missing_value = "true", action = ArgAction::Set,
          hide_default_value = true, hide_possible_values = true)]
    pub(crate) one_sided: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop bake scan.ply -t ambient-occlusion -o shaded.ply
  surfelshop bake scan.ply -t outliers -t ambient-occlusion --set ambient-occlusion:rays=256 \\
      -o clean.ply --json
The file appears whole or not at all: after a failure or Ctrl-C, what stood there before still does.
`surfelshop info` shows which tools made a file, with which parameters.")]
pub(crate) struct BakeArguments {
    /// The cloud, or a scene (.scene.toml) that shows one; then the cloud is taken where it stands.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// A tool, by its id or as PACKAGE/ID; may be repeated: each works on what the one before made.
    /// `surfelshop plugins` lists them.
    #[arg(short, long, required = true, value_name = "TOOL")]
    pub(crate) tool: Vec<String>,
    /// The file to write, .ply.
    #[arg(short, long, value_name = "FILE", value_parser = values::cloud_file)]
    pub(crate) out: PathBuf,
    /// A parameter of a tool, as id=value, or as TOOL:id=value where there are several; may be
    /// repeated.
    ///
    /// An id that does not exist is answered with the list of those that do, and their ranges.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) set: Vec<Setting>,
    /// Threads the tools work on; as many as the machine has where 0. The result is the same.
    #[arg(long, value_name = "NUMBER", default_value_t = 0, hide_default_value = true,
          value_parser = values::threads)]
    pub(crate) threads: usize,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

/// The light around the scene.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct EnvironmentArguments {
    /// Light from around, for renderers that use it: a light probe (.hdr or .exr),
    /// `studio`, `sky`, or `none`.
    ///
    /// Renderers that use it leave lights out that follow the camera.
    #[arg(long, value_name = "PROBE")]
    pub(crate) env: Option<String>,
    /// How the probe's picture shows directions, where that cannot be told by its shape: angular,
    /// mirrored-ball, lat-long, vertical-cross, horizontal-cross or octahedral.
    #[arg(long, value_name = "MAPPING", value_parser = values::mapping)]
    pub(crate) env_mapping: Option<Mapping>,
    /// The world direction that the centre of the probe's picture shows: x, -x, y, -y, z or -z
    /// [default: -z].
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub(crate) env_forward: Option<Axis>,
    /// The world direction that is up in the probe's picture [default: y].
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub(crate) env_up: Option<Axis>,
    /// Turns the light about its up direction, counterclockwise seen from above.
    #[arg(long, value_name = "DEGREES", value_parser = values::turn, allow_hyphen_values = true)]
    pub(crate) env_rotation: Option<f64>,
    /// Factor on the probe's light in stops.
    #[arg(long, value_name = "STOPS", value_parser = values::stops, allow_hyphen_values = true)]
    pub(crate) env_exposure: Option<f32>,
}

/// Where the camera stands and what it sees.
#[derive(Clone, Debug, Args)]
pub(crate) struct LensArguments {
    /// Where the camera stands: a preset, or position, target, up and field of view.
    ///
    /// Presets frame the whole cloud: front (from +z, or from -y with --up z), back, left (from
    /// -x), right, top, bottom, three-quarter. Numbers are "px,py,pz; tx,ty,tz[; ux,uy,uz[;
    /// DEGREES]]" in world space: position, target, up direction and vertical field of view.
    #[arg(long, value_name = "CAMERA", default_value = "three-quarter",
          value_parser = CameraSpec::parse, allow_hyphen_values = true)]
    pub(crate) camera: CameraSpec,
    /// The axis that points upwards in the presets, and where --camera leaves up out; scans often
    /// have z.
    #[arg(long, value_enum, value_name = "AXIS", default_value_t)]
    pub(crate) up: UpAxis,
    /// Vertical field of view in degrees [default: 35].
    #[arg(long, value_name = "DEGREES", value_parser = values::field_of_view)]
    pub(crate) fov: Option<f64>,
    /// Parallel instead of central projection; what is at the target keeps its size.
    /// `--orthographic=false` makes a scene's parallel projection central.
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true,
          default_value_t = false, default_missing_value = "true", action = ArgAction::Set,
          hide_default_value = true, hide_possible_values = true)]
    pub(crate) orthographic: bool,
    /// Enlarge the middle of the picture by this factor, from the same place.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = values::zoom)]
    pub(crate) zoom: f64,
}

/// How surfels are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum SurfelChoice {
    /// The processor where the device is software, else quads.
    #[default]
    Auto,
    /// Quads, by the device.
    Quads,
    /// Compute for small surfels, quads for large ones, by the device.
    Compute,
    /// The processor.
    Cpu,
}

/// Which graphics device to use.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct DeviceArguments {
    /// How surfels are drawn: as quads by the device, by the device's compute where they are small, or
    /// by the processor, which on software devices takes a fraction of the time.
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    pub(crate) surfels: SurfelChoice,
    /// The graphics interface, instead of the best one.
    #[arg(long, value_enum, value_name = "INTERFACE")]
    pub(crate) backend: Option<BackendChoice>,
    /// The graphics adapter: any part of its name.
    #[arg(long, value_name = "TEXT")]
    pub(crate) adapter: Option<String>,
}

/// The form of what is printed.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct ReportArguments {
    /// Print one JSON object with everything, and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  surfelshop info scan.ply\n  surfelshop info room.scene.toml")]
pub(crate) struct InfoArguments {
    /// The clouds and scenes.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  surfelshop convert scan.ply with-normals.ply")]
pub(crate) struct ConvertArguments {
    /// The cloud to read.
    #[arg(value_name = "IN")]
    pub(crate) input: PathBuf,
    /// The file to write, .ply.
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Write text instead of binary numbers.
    #[arg(long)]
    pub(crate) ascii: bool,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  surfelshop demo --out pictures --size 640x480")]
pub(crate) struct DemoArguments {
    /// The folder to write pictures into; made where it does not exist.
    #[arg(short, long, value_name = "DIR", default_value = "demo")]
    pub(crate) out: PathBuf,
    /// Width and height in pixels, or one number for a square.
    #[arg(long, value_name = "WxH", default_value = "1024x1024", value_parser = Size::parse)]
    pub(crate) size: Size,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    #[command(flatten)]
    pub(crate) report: ReportArguments,
}

/// The axis that points upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpAxis {
    /// As in modelling programs and in this one.
    #[default]
    Y,
    /// As in surveying.
    Z,
}

/// Graphics interfaces by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum BackendChoice {
    /// Vulkan.
    Vulkan,
    /// OpenGL (ES).
    Gl,
    /// Metal, on Apple's systems.
    Metal,
    /// Direct3D 12, on Windows.
    Dx12,
}

/// Tone mapping by name.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub(crate) enum ToneMapChoice {
    /// Cut off.
    #[default]
    Clamp,
    /// Compressed and desaturated (Khronos PBR Neutral).
    Neutral,
}

/// Bits per channel of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Bits {
    /// What screens show.
    #[default]
    #[value(name = "8")]
    Eight,
    /// For pictures that are worked on.
    #[value(name = "16")]
    Sixteen,
}

impl Bits {
    /// The number.
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_argument_is_declared_soundly() {
        Cli::command().debug_assert();
    }

    #[test]
    fn values_may_start_with_a_minus_sign() {
        let line =
            "surfelshop render a.ply -o a.png --light -1,0,0 --exposure -1.5 --camera -1,2,3;0,0,0";
        let cli = Cli::try_parse_from(line.split(' ')).unwrap();
        let Some(Command::Render(render)) = cli.command else { panic!("another command") };
        assert_eq!(render.picture.exposure.to_bits(), (-1.5f32).to_bits());
        assert_eq!(render.picture.light.len(), 1);
    }
}
