//! What can be typed behind `surfelshop farm`.

use crate::arguments::IndexArguments;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use surfelshop_evaluate::compare::CompareArguments;
use surfelshop_evaluate::report::ReportArguments;
use surfelshop_papers::PapersArguments;
use surfelshop_session::options::PrintArguments;
use surfelshop_session::render::RenderArguments;

#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop farm report scan.ply -r environment --reference-set samples=1024 --parts 8 -o job
  surfelshop farm film scan.ply --path orbit:240 --parts 8 -o job/scan.png
  surfelshop farm index tiles/*.laz --parts 20 -o job/city.surfels
  surfelshop farm papers --data models --parts 8 -o job
  surfelshop farm run job --workers 2
The folder of a job holds a template of Open Job Description (template.yaml, with its parameters in parameters.json),
which render farms take, and scripts for Slurm (slurm.sh) and for hands (task.sh). Results come into the folder `result`.")]
pub(crate) struct FarmArguments {
    #[command(subcommand)]
    pub(crate) command: FarmCommand,
}

/// What a farm is to do.
#[derive(Debug, Subcommand)]
pub(crate) enum FarmCommand {
    /// A report in parts: what `surfelshop report` takes.
    Report(Box<FarmJob<ReportArguments>>),
    /// A film in parts: what `surfelshop render --path` takes; the job's folder is that of the picture.
    Film(Box<FarmJob<RenderArguments>>),
    /// A comparison in parts: what `surfelshop compare --path` takes.
    Compare(Box<FarmJob<CompareArguments>>),
    /// A pyramid in parts: what `surfelshop index` takes; the job's folder is that of the pyramid.
    Index(Box<FarmJob<IndexArguments>>),
    /// The papers in parts: what `surfelshop papers` takes.
    Papers(Box<FarmJob<PapersArguments>>),
    /// Run a job here, by the program `openjd` of the standard.
    Run(FarmRun),
}

/// A command in parts.
#[derive(Debug, Args)]
pub(crate) struct FarmJob<T: Args> {
    #[command(flatten)]
    pub(crate) work: T,
    /// Into how many parts the work is divided, each a task of the farm.
    #[arg(long, value_name = "NUMBER", default_value_t = 8,
          value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) parts: u32,
}

#[derive(Debug, Args)]
pub(crate) struct FarmRun {
    /// The folder of the job.
    #[arg(value_name = "JOB")]
    pub(crate) job: PathBuf,
    /// Tasks that run at a time. Times that a report measures are those of a busy machine with more than one.
    #[arg(long, value_name = "NUMBER", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) workers: u32,
    /// The program that runs templates of Open Job Description.
    #[arg(long, value_name = "PROGRAM", default_value = "openjd")]
    pub(crate) openjd: PathBuf,
    #[command(flatten)]
    pub(crate) report: PrintArguments,
}
