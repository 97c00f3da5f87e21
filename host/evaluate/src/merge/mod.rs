//! `surfelshop merge`: parts of a report, a comparison or a film become one.

mod compared;
mod pictures;
mod reported;

use anyhow::{Context as _, bail};
use clap::Args;
use std::path::{Path, PathBuf};
use surfelshop_session::options::PrintArguments;
use surfelshop_session::output::machine::Machine;
use surfelshop_session::output::part_file::{PartFile, PartSet};
use surfelshop_session::output::terminal;
use surfelshop_session::render::path_pictures::COMMAND as RENDER;

/// Options of `surfelshop merge`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  surfelshop report scan.ply -r environment --reference-set samples=1024 -o parts --part 1/2
  surfelshop report scan.ply -r environment --reference-set samples=1024 -o parts --part 2/2
  surfelshop merge parts -o report
  surfelshop merge turn/part-*-of-8 -o film
Parts are those of `report`, `compare --path` and `render --path`. A set that lacks a part, or whose parts were made of
other files, with other options or by another version, is refused, and nothing is written.")]
pub struct MergeArguments {
    /// The folders of parts, or a folder in which they lie.
    #[arg(required = true, value_name = "PARTS")]
    pub parts: Vec<PathBuf>,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: PathBuf,
    /// The form of what is printed.
    #[command(flatten)]
    pub report: PrintArguments,
}

/// Runs the command.
pub fn run(arguments: &MergeArguments) -> anyhow::Result<()> {
    let set = PartSet::read(&arguments.parts)?;
    let command = set.command().to_owned();
    match command.as_str() {
        crate::report::parted::COMMAND => reported::merge(arguments, set.parts()?),
        crate::compare::part::COMMAND => compared::merge(arguments, set.parts()?),
        RENDER => pictures::merge(arguments, set.parts()?),
        other => bail!("parts of `{other}` are not merged by this version"),
    }
}

/// Makes the folder that is written.
fn make(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))
}

/// Says what each part took, and where.
fn note_parts<T>(
    arguments: &MergeArguments,
    parts: &[(PathBuf, PartFile<T>)],
) -> anyhow::Result<()> {
    if arguments.report.json {
        return Ok(());
    }
    parts.iter().try_for_each(|(_, part)| terminal::line(part.line()))
}

/// The machines of parts, each once.
fn machines<T>(parts: &[(PathBuf, PartFile<T>)]) -> Vec<Machine> {
    let mut all: Vec<Machine> = parts.iter().map(|(_, part)| part.machine.clone()).collect();
    all.sort();
    all.dedup();
    all
}

/// Puts a file of a part into the folder of the whole: as another name of the same file where the file system has that,
/// else as a copy.
///
/// # Errors
/// One line where it cannot be read or written.
fn put_file(from: &Path, to: &Path) -> anyhow::Result<()> {
    let failed = || format!("{}: cannot be put to {}", from.display(), to.display());
    let folder = surfelshop_cloud::files::folder_of(to);
    let unfinished = tempfile::Builder::new()
        .prefix(surfelshop_cloud::files::PREFIX)
        .tempdir_in(folder)
        .with_context(failed)?;
    let place = unfinished.path().join("file");
    if std::fs::hard_link(from, &place).is_err() {
        std::fs::copy(from, &place).with_context(failed)?;
    }
    std::fs::rename(&place, to).with_context(failed)
}
