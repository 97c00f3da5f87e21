//! What can be typed behind `surfelshop bench`.

use anyhow::Context as _;
use clap::{Args, FromArgMatches as _};
use std::path::PathBuf;
use surfelshop_session::options::colors::ColorArguments;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::{self, Setting, Size};
use surfelshop_session::options::{
    DeviceArguments, EnvironmentArguments, LensArguments, PictureArguments, PluginFiles,
    PrintArguments, SurfelChoice,
};

/// Options of `surfelshop bench`.
#[derive(Debug, Args)]
#[command(
    // One way to draw is a list of one.
    mut_arg("surfels", |surfels| surfels.hide(true).conflicts_with("strategies")),
    after_help = "Examples:
  surfelshop bench
  surfelshop bench scan.ply room.scene.toml -r ewa-phong -r environment --env studio \\
      --sizes 512,1024 --strategies quads,cpu -o measured
  surfelshop bench --growth --most 3000000 --largest 4096 -o growth
  surfelshop bench scan.ply --split --strategies cpu --sizes 1024
  surfelshop bench scan.ply --start
The folder holds a table (.csv) and all that was measured (.json), with --growth plots (.svg), too."
)]
pub struct BenchArguments {
    /// Clouds and scenes (.scene.toml), each drawn by itself [default: the sample].
    #[arg(value_name = "FILE", conflicts_with = "growth")]
    pub files: Vec<PathBuf>,
    /// Measure how time grows with surfels, pixels and closeness instead, on clouds that are made for
    /// it.
    #[arg(long, conflicts_with = "start")]
    pub growth: bool,
    /// Measure how long the program takes from its start to a picture instead.
    #[arg(long)]
    pub start: bool,
    /// Also say where the CPU time of a frame goes, stage by stage, display transform and PNG included.
    #[arg(long, conflicts_with_all = ["growth", "start"])]
    pub split: bool,
    /// A renderer, by its id or as PACKAGE/ID, also behind a name of your own, as NAME=RENDERER; may be
    /// repeated.
    #[arg(short, long, value_name = "[NAME=]RENDERER", default_value = "ewa-phong")]
    pub renderer: Vec<String>,
    /// Ways to draw surfels, separated by commas; times are compared with those of quads, or else of
    /// the first.
    #[arg(long, value_enum, value_name = "HOW,…", value_delimiter = ',',
          default_values = ["quads", "cpu"])]
    pub strategies: Vec<SurfelChoice>,
    /// Details, separated by commas: radii of merged surfels in pixels, 0 where none are.
    #[arg(long, value_name = "PIXELS,…", value_delimiter = ',', default_values = ["0"],
          value_parser = values::detail, allow_hyphen_values = true)]
    pub detail: Vec<f32>,
    /// Sizes of pictures, each `WxH` or one number for a square, separated by commas.
    #[arg(long, value_name = "SIZE,…", value_delimiter = ',', default_values = ["512", "1024"],
          value_parser = Size::parse, conflicts_with = "growth")]
    pub sizes: Vec<Size>,
    /// Frames that are timed of each, after one that is not: once around what the camera looks at
    /// [default: 12]; with --growth from one place, and with --start as many starts [default: 5].
    #[arg(long, value_name = "NUMBER", value_parser = values::timed)]
    pub frames: Option<u32>,
    /// Draw all frames from where the picture is seen, instead of once around what the camera looks at.
    #[arg(long, conflicts_with_all = ["growth", "start"])]
    pub still: bool,
    /// Most surfels of --growth.
    #[arg(long, value_name = "SURFELS", default_value_t = 1_000_000, requires = "growth",
          value_parser = clap::value_parser!(u32).range(10_000..=20_000_000))]
    pub most: u32,
    /// Most pixels of a picture's side of --growth.
    #[arg(long, value_name = "PIXELS", default_value_t = 2048, requires = "growth",
          value_parser = clap::value_parser!(u32).range(256..=4096))]
    pub largest: u32,
    /// The folder to write tables into; made where it does not exist.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// A parameter, as NAME:id=value or RENDERER:id=value, or id=value for all that have it; may be
    /// repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = Setting::parse)]
    pub set: Vec<Setting>,
    /// The camera.
    #[command(flatten)]
    pub lens: LensArguments,
    /// The environment map.
    #[command(flatten)]
    pub environment: EnvironmentArguments,
    /// What colours surfels, and which are shown.
    #[command(flatten)]
    pub colors: ColorArguments,
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

impl BenchArguments {
    /// Details, each once.
    pub fn details(&self) -> Vec<f32> {
        each_once(&self.detail)
    }

    /// Ways to draw surfels, each once.
    pub fn strategies(&self, given: &ExplicitOptions) -> Vec<SurfelChoice> {
        let typed = match given.has("surfels") {
            true => std::slice::from_ref(&self.device.surfels),
            false => &self.strategies,
        };
        each_once(typed)
    }

    /// The options of a picture of this size; those that a benchmark does not have are the usual ones.
    pub fn picture(&self, size: Size) -> anyhow::Result<PictureArguments> {
        let command = PictureArguments::augment_args(clap::Command::new("picture"));
        let usual = command.try_get_matches_from(["picture"]);
        let usual = usual.and_then(|usual| PictureArguments::from_arg_matches(&usual));
        let usual = usual.context("the usual picture is none")?;
        let (lens, environment) = (self.lens.clone(), self.environment.clone());
        let colors = self.colors.clone();
        Ok(PictureArguments { size, lens, environment, colors, ..usual })
    }
}

/// What was typed, without what was typed before.
fn each_once<T: Copy + PartialEq>(typed: &[T]) -> Vec<T> {
    let mut each = Vec::with_capacity(typed.len());
    for one in typed {
        if !each.contains(one) {
            each.push(*one);
        }
    }
    each
}

#[cfg(test)]
mod tests {
    use super::BenchArguments;
    use clap::ValueEnum as _;
    use surfelshop_session::options::SurfelChoice;
    use surfelshop_session::options::explicit::parse;
    use surfelshop_session::options::values::Size;

    fn strategies(line: &str) -> Result<Vec<SurfelChoice>, clap::Error> {
        let line: Vec<&str> = line.split(' ').collect();
        let (bench, given) = parse::<BenchArguments>(&line)?;
        assert_eq!(bench.picture(Size([3, 2])).unwrap().size, Size([3, 2]));
        Ok(bench.strategies(&given))
    }

    #[test]
    fn strategies_are_all_that_there_are_each_once() {
        use SurfelChoice::{Cpu, Quads};
        assert_eq!(strategies("surfelshop bench").unwrap(), [Quads, Cpu]);
        assert_eq!(
            strategies("surfelshop bench --strategies cpu,quads,cpu").unwrap(),
            [Cpu, Quads]
        );
        assert_eq!(strategies("surfelshop bench --surfels cpu").unwrap(), [Cpu]);
        assert!(strategies("surfelshop bench --surfels cpu --strategies quads").is_err());
        for choice in SurfelChoice::value_variants() {
            let name = choice.to_possible_value().unwrap().get_name().to_owned();
            let line = format!("surfelshop bench --strategies {name}");
            assert_eq!(strategies(&line).unwrap(), [*choice]);
        }
    }

    #[test]
    fn what_is_measured_is_one_thing() {
        for line in [
            "--growth --start",
            "--growth a.ply",
            "--most 20000",
            "--growth --sizes 64",
            "--growth --split",
            "--start --split",
            "--growth --still",
            "--start --still",
        ] {
            assert!(strategies(&format!("surfelshop bench {line}")).is_err(), "{line}");
        }
        assert!(strategies("surfelshop bench --growth --most 20000 --largest 256").is_ok());
    }
}
