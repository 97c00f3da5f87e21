//! What can be typed behind `surfelshop`.

use crate::farm::arguments::FarmArguments;
use crate::plugins::arguments::PluginsArguments;
use clap::error::ErrorKind;
use clap::{Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use std::path::PathBuf;
use surfelshop_evaluate::bench::BenchArguments;
use surfelshop_evaluate::check::CheckArguments;
use surfelshop_evaluate::compare::CompareArguments;
use surfelshop_evaluate::demo::DemoArguments;
use surfelshop_evaluate::explain::ExplainArguments;
use surfelshop_evaluate::merge::MergeArguments;
use surfelshop_evaluate::report::ReportArguments;
use surfelshop_evaluate::share::ShareArguments;
use surfelshop_papers::PapersArguments;
use surfelshop_session::options::measures::MeasureOptions;
use surfelshop_session::options::part::Part;
use surfelshop_session::options::select::{ColumnValue, SelectStep};
use surfelshop_session::options::values::{self, Setting};
use surfelshop_session::options::{DeviceArguments, PluginFiles, PrintArguments, UpAxis};
use surfelshop_session::render::RenderArguments;
use surfelshop_viewer::ViewerArguments;

/// Renders point clouds as surfaces of oriented discs (surfels), with renderers that are plugins.
#[derive(Debug, Parser)]
#[command(
    name = "surfelshop",
    version,
    args_conflicts_with_subcommands = true,
    disable_help_subcommand = true,
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
    Report(Box<ReportArguments>),
    /// Make the figures, tables and errata of the papers behind the techniques again, on a page for each.
    Papers(Box<PapersArguments>),
    /// Make one page to show people: pictures along a path by several renderers, in a file that needs no network.
    Share(Box<ShareArguments>),
    /// Write a job for render farms (Open Job Description, Slurm) that does work in parts, or run one here.
    Farm(FarmArguments),
    /// Join parts that several processes or machines made of a report, a comparison or a film.
    Merge(MergeArguments),
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
    /// Read a cloud and write it in another format, as it is or with the normals and radii it lacked.
    Convert(ConvertArguments),
    /// Select surfels of a cloud: count them, or write them, the others, or all with another value of a column.
    Select(Box<SelectArguments>),
    /// Measure distances, angles, heights, areas, profiles and volumes, those of a scene and those that are typed.
    Measure(Box<MeasureArguments>),
    /// Make a pyramid of files of any size: a cloud that is drawn without being in memory.
    Index(IndexArguments),
    /// Render the sample cloud with every renderer.
    Demo(DemoArguments),
    /// Tell shells and desktops of the program: completions, manual pages, menu entry, kinds of files.
    Setup(SetupArguments),
    /// Print a page of the manual, or its contents; `surfelshop COMMAND --help` lists options.
    Help {
        /// What the page is about.
        topic: Option<String>,
    },
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop bake scan.ply -t ambient-occlusion -o shaded.ply
  surfelshop bake scan.ply -t outliers -t ambient-occlusion --set ambient-occlusion:rays=256 \\
      -o clean.ply --json
  surfelshop bake scan.ply -t brush -t eraser --strokes scan.strokes.json -o painted.ply
The file appears whole or not at all: after a failure or Ctrl-C, what stood there before still does.
`surfelshop info` shows which tools made a file, with which parameters.")]
pub(crate) struct BakeArguments {
    /// The cloud, or a scene (.scene.toml) that shows one; then the cloud is taken where it stands. Of a pyramid
    /// (.surfels) another one is made, part by part.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// A tool, by its id or as PACKAGE/ID; may be repeated: each works on what the one before made.
    /// `surfelshop plugins` lists them.
    #[arg(short, long, required = true, value_name = "TOOL")]
    pub(crate) tool: Vec<String>,
    /// The file to write, .ply or that of another format; of a pyramid .surfels.
    #[arg(short, long, value_name = "FILE", value_parser = values::cloud_file)]
    pub(crate) out: PathBuf,
    /// Strokes of tools that are led by hand, done again in their order: a file that the window wrote. All tools
    /// that it names have to be there with -t.
    #[arg(long, value_name = "FILE")]
    pub(crate) strokes: Option<PathBuf>,
    /// Work on these surfels alone: as `surfelshop select` takes it; may be repeated.
    #[arg(long, value_name = "WHAT", value_parser = SelectStep::parse, allow_hyphen_values = true)]
    pub(crate) select: Vec<SelectStep>,
    /// The axis that `height` is along where it selects [default: that of the file, else y].
    #[arg(
        long,
        value_enum,
        value_name = "AXIS",
        default_value_t,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub(crate) up: UpAxis,
    /// Memory that the work over a pyramid takes at most, such as 500MB or 4GB.
    #[arg(long, value_name = "SIZE", default_value = "4GB", value_parser = values::memory)]
    pub(crate) memory: u64,
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
    pub(crate) report: PrintArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop select scan.ply classification=7                              how many
  surfelshop select scan.ply box:0,0,0:5,5,3 -o room.ply                   these alone
  surfelshop select scan.ply component:0,0,0 invert --delete -o clean.ply  all others but these
  surfelshop select scan.ply height=..0.2 grow:0.05 --up z --set classification=2 -o ground.ply
  surfelshop select big.surfels box:0,0,0:5,5,3 --delete -o big.layer.json edits, kept beside the pyramid
  surfelshop select big.surfels all --layer big.layer.json -o new.surfels  a pyramid with these edits
Each WHAT adds to those before; not: before one takes it away, and and: keeps what is in both.")]
pub(crate) struct SelectArguments {
    /// The cloud, or a scene (.scene.toml) that shows one. Pyramids (.surfels) are gone through leaf by leaf.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// What is selected: all, box:X,Y,Z:X,Y,Z (with :DEGREES it is turned about its middle), sphere:X,Y,Z:RADIUS,
    /// plane:X,Y,Z:X,Y,Z (a place on it, and its normal), component:X,Y,Z or component:X,Y,Z:DISTANCE (what hangs together
    /// with a place), NAME=LOW..HIGH or NAME=N,N (values of a column, or height); then invert, and grow or shrink, with
    /// :DISTANCE or without.
    #[arg(value_name = "WHAT", required = true, value_parser = SelectStep::parse)]
    pub(crate) what: Vec<SelectStep>,
    /// The file to write; without it surfels are counted. Of a pyramid another one, .surfels, or its edits,
    /// .layer.json, which a scene names beside it.
    #[arg(short, long, value_name = "FILE", value_parser = values::cloud_file)]
    pub(crate) out: Option<PathBuf>,
    /// Edits of the pyramid that were made before.
    #[arg(long, value_name = "FILE")]
    pub(crate) layer: Option<PathBuf>,
    /// Memory that writing a pyramid takes at most, such as 500MB or 4GB.
    #[arg(long, value_name = "SIZE", default_value = "4GB", value_parser = values::memory)]
    pub(crate) memory: u64,
    /// Write what is not selected.
    #[arg(long, conflicts_with = "set")]
    pub(crate) delete: bool,
    /// Write all, with this value of a column where it is selected: NAME=VALUE, or a value for each component; may be
    /// repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = ColumnValue::parse)]
    pub(crate) set: Vec<ColumnValue>,
    /// The axis that `height` is along, and that boxes are turned about [default: that of the file, else y].
    #[arg(
        long,
        value_enum,
        value_name = "AXIS",
        default_value_t,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub(crate) up: UpAxis,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop measure room.scene.toml                                   what the scene measures
  surfelshop measure room.scene.toml --csv
  surfelshop measure scan.ply --distance 0,0,0:1.5,0,0.2
  surfelshop measure scan.ply --profile 0,0,0:5,0,0 --thickness 0.05 --points profile.csv
  surfelshop measure heap.las --volume 0,0,0:9,0,0:9,7,0:0,7,0 -o heap.scene.toml
Surfels that filters of the scene hide are not measured.")]
pub(crate) struct MeasureArguments {
    /// The clouds, and at most one scene (.scene.toml).
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) measures: MeasureOptions,
    /// Print a row for each number, with commas between its fields: in metres where files say how long their units are.
    #[arg(long, conflicts_with = "json")]
    pub(crate) csv: bool,
    /// Write the surfels of the profile, of which there has to be one: how far along and how high each is.
    #[arg(long, value_name = "FILE")]
    pub(crate) points: Option<PathBuf>,
    /// Write a scene with all measures, .scene.toml.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// The axis that heights are along [default: that of the scene or of the file, else y].
    #[arg(
        long,
        value_enum,
        value_name = "AXIS",
        default_value_t,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub(crate) up: UpAxis,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  surfelshop info scan.ply\n  surfelshop info room.scene.toml")]
pub(crate) struct InfoArguments {
    /// The clouds, scenes and light probes.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Load clouds whole, and say what was repaired and estimated.
    #[arg(long)]
    pub(crate) full: bool,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop index tiles/*.laz -o city.surfels
  surfelshop index scan.e57 -o scan.surfels --memory 2GB
  surfelshop render city.surfels -r ewa-phong -o city.png")]
pub(crate) struct IndexArguments {
    /// The files to read, in any format; together they are one cloud.
    #[arg(value_name = "FILE", required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The pyramid to write, a `.surfels` file. What is done so far stays beside it, in a folder `NAME.index`, until
    /// it is whole: the same command goes on where it was ended.
    #[arg(short, long, value_name = "FILE", value_parser = values::pyramid_file)]
    pub(crate) output: PathBuf,
    /// Memory that the work takes at most, such as 500MB or 4GB.
    #[arg(long, value_name = "SIZE", default_value = "4GB", value_parser = values::memory)]
    pub(crate) memory: u64,
    /// Do one step alone, in the folder `NAME.index`, which several processes and machines share: first `extent`, then all
    /// parts of `points`, then `plan`, then all parts of `surfels`; the same command without it ends the work.
    #[arg(long, value_enum, value_name = "STEP")]
    pub(crate) step: Option<IndexStepChoice>,
    /// Do one part of a step, such as 3/8.
    #[arg(long, value_name = "K/N", value_parser = Part::parse, requires = "step")]
    pub(crate) part: Option<Part>,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}

/// A step of an index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum IndexStepChoice {
    /// Looks for a cube around all points.
    Extent,
    /// Reads files, and puts their points on the disk by place.
    Points,
    /// Divides points among chunks.
    Plan,
    /// Makes surfels of the points of chunks.
    Surfels,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  surfelshop convert room.e57 room.laz\n  surfelshop convert tile.laz small.ply --crop 0,0,0:50,50,20 --every 4\n  surfelshop convert scan.ply with-normals.ply --estimate"
)]
pub(crate) struct ConvertArguments {
    /// The files to read; several become one, with a column `scan`.
    #[arg(value_name = "IN", required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write; its ending names the format.
    #[arg(value_name = "OUT", value_parser = values::cloud_file)]
    pub(crate) output: PathBuf,
    /// Write text instead of binary numbers, where the format has both.
    #[arg(long)]
    pub(crate) ascii: bool,
    /// Keep only points in a box, as smallest and largest coordinates: X,Y,Z:X,Y,Z.
    #[arg(long, value_name = "BOX", value_parser = values::crop_box, allow_hyphen_values = true)]
    pub(crate) crop: Option<[DVec3; 2]>,
    /// Keep every so many-th point.
    #[arg(long, value_name = "NUMBER", default_value_t = 1, hide_default_value = true,
          value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) every: u64,
    /// Keep only these columns, besides positions: names with commas between.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) columns: Vec<String>,
    /// A parameter of the format that is written, as id=value, such as version=1.2 of LAS or encoding=ascii of PCD; may
    /// be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub(crate) write_set: Vec<Setting>,
    /// Make one cloud of several scans, even where the format could keep them apart.
    #[arg(long)]
    pub(crate) merge: bool,
    /// Estimate the normals and radii that a file lacks, and write them, too.
    #[arg(long)]
    pub(crate) estimate: bool,
    #[command(flatten)]
    pub(crate) plugins: PluginFiles,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop setup
  surfelshop setup --prefix /usr/local --program surfelshop
  surfelshop setup --remove")]
pub(crate) struct SetupArguments {
    /// Where to write: `share` below it gets the files, and `bin` a link to this program where --program is not given
    /// [default: ~/.local].
    #[arg(long, value_name = "DIR")]
    pub(crate) prefix: Option<PathBuf>,
    /// How desktops start the program [default: the place of this one].
    #[arg(long, value_name = "NAME")]
    pub(crate) program: Option<String>,
    /// Remove what an earlier setup wrote, and nothing else.
    #[arg(long)]
    pub(crate) remove: bool,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
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
