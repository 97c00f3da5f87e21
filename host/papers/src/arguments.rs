//! What can be typed behind `surfelshop papers`.

use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use surfelshop_session::options::part::Part;
use surfelshop_session::options::{DeviceArguments, PluginFiles, PrintArguments};

/// The papers, and what is wrong in them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PaperChoice {
    /// Liu 2006, "High Quality Rendering for Point Sampled Geometry".
    Thesis,
    /// Botsch, Spornat & Kobbelt 2004, "Phong Splatting".
    PhongSplatting,
    /// Preiner 2010, "Real-Time Global Illumination in Point Clouds".
    PointGi,
    /// The errata of all three: as printed beside as corrected.
    Errata,
}

/// Options of `surfelshop papers`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop papers -o page
  surfelshop papers thesis --data models -o page
  surfelshop papers thesis --only \"Figure 15\" -o page
  surfelshop papers errata --only T2 --size 512 -o page
The folder holds index.html and a page for each paper, which need no network, papers.json with every number and the
command that measures it, and the folder work, from which an interrupted run goes on.")]
pub struct PapersArguments {
    /// Which to make [default: all].
    #[arg(value_enum, value_name = "PAPER")]
    pub paper: Option<PaperChoice>,
    /// The folder to write; made where it does not exist.
    #[arg(short, long, value_name = "FOLDER", required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// A folder of the papers' own models and light probes, found by the names of their files; what is not there is
    /// stood in for by the samples of the program.
    #[arg(long, value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Make this figure, table or erratum alone, as `Figure 15` or `T2`; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Width and height of each picture in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 320,
          value_parser = clap::value_parser!(u32).range(16..=2048))]
    pub size: u32,
    /// Paths for each pixel of the pictures that others are measured against.
    #[arg(long, value_name = "NUMBER", default_value_t = 64,
          value_parser = clap::value_parser!(u32).range(2..=65_536))]
    pub samples: u32,
    /// Runs that are timed of each renderer and tool.
    #[arg(long, value_name = "NUMBER", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(1..=100))]
    pub repeats: u32,
    /// Make one part of the figures, tables and errata, such as 3/8, and write no pages. The command without it finds
    /// what all parts made, where their folders `work` are one, and writes the pages.
    #[arg(long, value_name = "K/N", value_parser = Part::parse, conflicts_with = "gallery")]
    pub part: Option<Part>,
    /// Make what the gallery shows alone, and write its small pictures into this folder as well.
    #[arg(long, value_name = "FOLDER")]
    pub gallery: Option<PathBuf>,
    /// List the figures, tables and errata, and make nothing.
    #[arg(long)]
    pub list: bool,
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

impl PapersArguments {
    /// The folder that is written; the current one where only a list was asked for.
    pub(crate) fn folder(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }

    /// Whether a paper is to be made, by its id.
    pub(crate) fn has_paper(&self, id: &str) -> bool {
        self.paper.is_none_or(|paper| {
            paper.to_possible_value().is_some_and(|value| value.get_name() == id)
        })
    }

    /// Whether an entry was named.
    pub(crate) fn has_entry(&self, id: &str) -> bool {
        self.only.iter().any(|name| name.eq_ignore_ascii_case(id))
    }
}
