//! Options that several commands share, and the values they take as they are typed.

pub mod camera;
pub mod colors;
pub mod explicit;
pub mod lights;
pub mod measures;
pub mod part;
pub mod path;
mod plugin_files;
pub mod select;
pub mod values;

pub(crate) use plugin_files::check_isolated;
pub use plugin_files::{FileColorBits, FormatArguments, PluginFiles, is_plugin_file};

use crate::options::camera::CameraSpec;
use crate::options::colors::ColorArguments;
use crate::options::lights::LightSpec;
use crate::options::values::{Backdrop, Size};
use clap::{ArgAction, Args, ValueEnum};
use surfelshop_cloud::Source;
use surfelshop_cloud::environment_map::Mapping;
use surfelshop_cloud::scene::{Axis, EyeDomeLighting};
use surfelshop_image::png;

/// What is seen, and in which light: all that a renderer has no say in.
#[derive(Clone, Debug, Args)]
pub struct PictureArguments {
    /// Width and height in pixels, or one number for a square.
    #[arg(long, value_name = "WxH", default_value = "1024x1024", value_parser = Size::parse)]
    pub size: Size,
    /// The camera.
    #[command(flatten)]
    pub lens: LensArguments,
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
    pub light: Vec<LightSpec>,
    /// The environment map.
    #[command(flatten)]
    pub environment: EnvironmentArguments,
    /// What colours surfels, and which are shown.
    #[command(flatten)]
    pub colors: ColorArguments,
    /// Factor on brightness in stops: 1 doubles, -1 halves.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = values::stops,
          allow_hyphen_values = true)]
    pub exposure: f32,
    /// How brightness above white is brought down in a PNG.
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    pub tone_map: ToneMapChoice,
    /// What stands where no surfel is: transparent, white, black, gray, #rrggbb or r,g,b (linear); two of these as
    /// TOP:BOTTOM for a gradient.
    #[arg(long, value_name = "COLOR", default_value = "transparent",
          value_parser = Backdrop::parse)]
    pub background: Backdrop,
    /// Make edges smooth: draw so many frames, each seen at another place of every pixel, and show their mean, 1 to
    /// 1024; 16 is good, and takes the time of 16. Tracers have samples of their own and are not changed by it
    /// [default: that of the scene, else 1].
    #[arg(long, value_name = "FRAMES", default_value_t = 1, hide_default_value = true,
          value_parser = values::antialias)]
    pub antialias: u32,
    /// Darken what lies behind something near it on the screen (eye-dome lighting), which shows the shape of clouds
    /// whose normals say little: `on`, `off`, `automatic`, or a strength and perhaps a radius in pixels, usually
    /// 1,1.4. Automatic is on where a quarter of the surfels or more are round splats, as points are, and off in
    /// commands that measure. Tracers are not changed by it [default: that of the scene, else automatic].
    #[arg(long, value_name = "STRENGTH[,RADIUS]", num_args = 0..=1, require_equals = true,
          default_value = "automatic", default_missing_value = "on", hide_default_value = true,
          value_parser = values::eye_dome)]
    pub eye_dome_lighting: EyeDomeLighting,
    /// Factor on every surfel's radius.
    #[arg(long, value_name = "FACTOR", value_parser = values::factor,
          allow_hyphen_values = true)]
    pub radius_scale: Option<f32>,
    /// How far behind the nearest surfel others still blend with it, in surfel radii, 0 to 16.
    #[arg(long, value_name = "RADII", value_parser = values::depth_tolerance,
          allow_hyphen_values = true)]
    pub depth_tolerance: Option<f32>,
    /// Draw several surfels as one where that has at most this radius, in pixels: large clouds take a
    /// fraction of the time. Renderers say whether they take it [default: 0, never; of pyramids 1].
    #[arg(long, value_name = "PIXELS", default_value_t = 0.0, hide_default_value = true,
          value_parser = values::detail, allow_hyphen_values = true)]
    pub detail: f32,
    /// Memory that an open pyramid takes at most, such as 500MB or 4GB [default: half of what is free].
    #[arg(long, value_name = "SIZE", value_parser = values::memory)]
    pub memory: Option<u64>,
    /// Read files whose points lie in an octree (COPC, Potree) in place, node by node, and never as a whole. Without it
    /// that is done where memory would not hold them.
    #[arg(long)]
    pub in_place: bool,
    /// Radius in pixels of the filter that keeps fine surfels from vanishing and flickering, 0
    /// (none) to 4 [default: 1].
    #[arg(long, value_name = "PIXELS", value_parser = values::low_pass,
          allow_hyphen_values = true)]
    pub low_pass: Option<f32>,
    /// Leave out surfels that are seen from behind; `--one-sided=false` draws them where a scene
    /// does not.
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true,
          default_value_t = false, default_missing_value = "true", action = ArgAction::Set,
          hide_default_value = true, hide_possible_values = true)]
    pub one_sided: bool,
}

/// The light around the scene.
#[derive(Clone, Debug, Default, Args)]
pub struct EnvironmentArguments {
    /// Light from around, for renderers that use it: a light probe (.hdr or .exr),
    /// `studio`, `sky`, or `none`.
    ///
    /// Renderers that use it leave lights out that follow the camera.
    #[arg(long, value_name = "PROBE")]
    pub env: Option<String>,
    /// How the probe's picture shows directions, where that cannot be told by its shape: angular,
    /// mirrored-ball, lat-long, vertical-cross, horizontal-cross or octahedral.
    #[arg(long, value_name = "MAPPING", value_parser = values::mapping)]
    pub env_mapping: Option<Mapping>,
    /// The world direction that the centre of the probe's picture shows: x, -x, y, -y, z or -z
    /// [default: -z].
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub env_forward: Option<Axis>,
    /// The world direction that is up in the probe's picture [default: y].
    #[arg(long, value_name = "AXIS", value_parser = values::axis, allow_hyphen_values = true)]
    pub env_up: Option<Axis>,
    /// Turns the light about its up direction, counterclockwise seen from above.
    #[arg(long, value_name = "DEGREES", value_parser = values::turn, allow_hyphen_values = true)]
    pub env_rotation: Option<f64>,
    /// Factor on the probe's light in stops.
    #[arg(long, value_name = "STOPS", value_parser = values::stops, allow_hyphen_values = true)]
    pub env_exposure: Option<f32>,
}

/// Where the camera stands and what it sees.
#[derive(Clone, Debug, Args)]
pub struct LensArguments {
    /// Where the camera stands: a preset, or position, target, up and field of view.
    ///
    /// Presets frame the whole cloud: front (from +z, or from -y with --up z), back, left (from
    /// -x), right, top, bottom, three-quarter; inside stands where a scan was taken. Numbers are "px,py,pz; tx,ty,tz[; ux,uy,uz[;
    /// DEGREES]]" in world space: position, target, up direction and vertical field of view.
    #[arg(long, value_name = "CAMERA", default_value = "three-quarter",
          value_parser = CameraSpec::parse, allow_hyphen_values = true)]
    pub camera: CameraSpec,
    /// The axis that points upwards in the presets, where --camera leaves up out, and for heights [default: that
    /// of the scene, else that of the files, where they say it, as scans do, else -y for points as a depth camera
    /// has them, else y].
    #[arg(
        long,
        value_enum,
        value_name = "AXIS",
        default_value_t,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub up: UpAxis,
    /// Vertical field of view in degrees [default: 35].
    #[arg(long, value_name = "DEGREES", value_parser = values::field_of_view)]
    pub fov: Option<f64>,
    /// Parallel instead of central projection; what is at the target keeps its size.
    /// `--orthographic=false` makes a scene's parallel projection central.
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true,
          default_value_t = false, default_missing_value = "true", action = ArgAction::Set,
          hide_default_value = true, hide_possible_values = true)]
    pub orthographic: bool,
    /// Enlarge the middle of the picture by this factor, from the same place.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = values::zoom)]
    pub zoom: f64,
}

/// How surfels are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SurfelChoice {
    /// The CPU where the device is software, else quads.
    #[default]
    Auto,
    /// Quads, by the device.
    Quads,
    /// Compute for small surfels, quads for large ones, by the device.
    Compute,
    /// The CPU.
    Cpu,
}

/// Which graphics device to use.
#[derive(Clone, Debug, Default, Args)]
pub struct DeviceArguments {
    /// How surfels are drawn: as quads by the device, by the device's compute where they are small, or
    /// by the CPU, which on software devices takes a fraction of the time.
    #[arg(long, value_enum, value_name = "HOW", default_value_t)]
    pub surfels: SurfelChoice,
    /// The graphics interface, instead of the best one.
    #[arg(long, value_enum, value_name = "INTERFACE")]
    pub backend: Option<BackendChoice>,
    /// The graphics adapter: any part of its name.
    #[arg(long, value_name = "TEXT")]
    pub adapter: Option<String>,
    /// Whether memory of a software device goes back as soon as it is let go: for windows.
    #[arg(skip)]
    pub small_blocks: bool,
}

/// The form of what is printed.
#[derive(Clone, Debug, Default, Args)]
pub struct PrintArguments {
    /// Print one JSON object with everything, and nothing else.
    #[arg(long)]
    pub json: bool,
}

/// The axis that points upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum UpAxis {
    /// As the files say or their points lie, and y where neither tells.
    #[default]
    Auto,
    /// As in modelling programs and in this one.
    Y,
    /// As in surveying.
    Z,
    /// Coordinates of a camera: y points down in them.
    #[value(name = "-y")]
    MinusY,
    /// The cloud stands on its head.
    #[value(name = "-z")]
    MinusZ,
    /// The cloud lies on its side.
    X,
    /// The cloud lies on its other side.
    #[value(name = "-x")]
    MinusX,
}

impl UpAxis {
    /// The axis, where files that say something may decide, and else the places of their points.
    #[must_use]
    pub fn or_of<'a>(self, sources: impl IntoIterator<Item = &'a Source>) -> Self {
        let Self::Auto = self else { return self };
        let (mut said, mut guessed) = (None, None);
        for source in sources {
            let one = source.said_up();
            // What is surveyed decides for what stands beside it.
            if said.is_none() || one == Some(Axis::PlusZ) {
                said = one.or(said);
            }
            guessed = guessed.or_else(|| source.guessed_up());
        }
        said.or(guessed).unwrap_or_default().into()
    }

    /// The axis; y where nobody says it.
    #[must_use]
    pub fn axis(self) -> Axis {
        match self {
            Self::Auto | Self::Y => Axis::PlusY,
            Self::Z => Axis::PlusZ,
            Self::MinusY => Axis::MinusY,
            Self::MinusZ => Axis::MinusZ,
            Self::X => Axis::PlusX,
            Self::MinusX => Axis::MinusX,
        }
    }
}

impl From<UpAxis> for Axis {
    fn from(up: UpAxis) -> Self {
        up.axis()
    }
}

impl From<Axis> for UpAxis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::PlusX => Self::X,
            Axis::MinusX => Self::MinusX,
            Axis::PlusY => Self::Y,
            Axis::MinusY => Self::MinusY,
            Axis::PlusZ => Self::Z,
            Axis::MinusZ => Self::MinusZ,
        }
    }
}

/// Graphics interfaces by name.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum BackendChoice {
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
pub enum ToneMapChoice {
    /// Cut off.
    #[default]
    Clamp,
    /// Compressed and desaturated (Khronos PBR Neutral).
    Neutral,
}

/// Bits per channel of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Bits {
    /// What screens show.
    #[default]
    #[value(name = "8")]
    Eight,
    /// For pictures that are worked on.
    #[value(name = "16")]
    Sixteen,
}

impl From<Bits> for png::Bits {
    fn from(bits: Bits) -> Self {
        match bits {
            Bits::Eight => Self::Eight,
            Bits::Sixteen => Self::Sixteen,
        }
    }
}

impl Bits {
    /// The number.
    pub fn number(self) -> u32 {
        match self {
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

/// The names of the fields that only pictures have a use for.
pub fn options_of_pictures() -> Vec<String> {
    let all = PictureArguments::augment_args(clap::Command::new("pictures"));
    all.get_arguments().map(|argument| argument.get_id().to_string()).collect()
}
