//! `surfelshop report`: error against time, as knobs turn.
//!
//! A bench runs a renderer or a tool with a knob at a value and says its errors and its time; what
//! was measured is kept after every run, so that a report that was interrupted goes on.

mod arguments;
pub mod cells;
mod error_columns;
pub mod knobs;
pub mod page;
pub(crate) mod parted;
mod pictures;
pub mod plot;
mod subject;
#[cfg(test)]
mod tests;
mod tools;
mod without_reference;

pub use arguments::ReportArguments;

use anyhow::{Context as _, bail};
use cells::{Cell, ResultsFile};
use knobs::Knob;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, ParamKind, Value, Values};
use surfelshop_session::input::scenes::Source;
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::output::command_line;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::session;
use surfelshop_session::timing::Run;

/// Runs the command.
pub fn run(arguments: &ReportArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    let registry = session::registry(&arguments.plugins)?;
    match (&arguments.renderer, &arguments.tool) {
        _ if arguments.reference.is_none() && arguments.reference_set.is_empty() => bail!(
            "say what errors are measured against: --reference, or --reference-set with what makes \
             the best of the same, such as samples=1024"
        ),
        (Some(renderer), _) => {
            for option in ["column", "longest", "threads", "reference_again"] {
                refuse(given, option, "a tool")?;
            }
            let unit = surfelshop_session::setup::drawer(&registry, renderer)?;
            pictures::report(arguments, given, &registry, &unit)
        }
        (None, Some(tool)) => {
            for option in surfelshop_session::options::options_of_pictures() {
                refuse(given, &option, "renderers")?;
            }
            let unit = registry.find(UnitKind::Tool, tool)?;
            tools::report(arguments, &registry, &unit)
        }
        (None, None) => bail!("name a renderer with -r or a tool with -t"),
    }
}

fn refuse(given: &ExplicitOptions, option: &str, whose: &str) -> anyhow::Result<()> {
    let typed = option.replace('_', "-");
    match given.has(option) {
        true => bail!("--{typed} is meant for {whose}; leave it out here"),
        false => Ok(()),
    }
}

/// What is measured as a knob turns.
trait Bench {
    /// Runs with a knob at a value for the first time, which is not timed with the others: its errors.
    fn first(&mut self, knob: &str, value: &str) -> Result<Cell, String>;

    /// Runs again, to be timed.
    fn again(&mut self, knob: &str, value: &str) -> Result<Run, String>;
}

/// What is known of a value that could be measured.
fn known(kept: &ResultsFile, knob: &str, value: &str) -> Option<Cell> {
    kept.cell(knob, value).filter(|cell| !cell.is_faulty())
}

/// Runs that are still to be done: what is known takes no time.
fn n_runs_to_come(Knob { id, values }: &Knob, n_repeats: usize, kept: &ResultsFile) -> usize {
    let n_runs = |value: &String| match known(kept, id, value) {
        Some(cell) if cell.runs.len() >= n_repeats => 0,
        Some(cell) => 1 + n_repeats - cell.runs.len(),
        None => 1 + n_repeats,
    };
    values.iter().map(n_runs).sum()
}

/// Turns one knob: values that are known are kept, the others are run once and then in turns.
fn sweep(
    bench: &mut dyn Bench,
    knob: &Knob,
    arguments: &ReportArguments,
    kept: &ResultsFile,
) -> anyhow::Result<Vec<Cell>> {
    let Knob { id, values } = knob;
    let n_repeats = arguments.repeats as usize;
    let progress = Progress::new(format!("{id}: {} values", values.len()));
    let n_runs = n_runs_to_come(knob, n_repeats, kept);
    let mut n_done = 0;
    let mut tell = || {
        n_done += 1;
        // Ctrl-C ends the program; what was measured is on the disk.
        let _goes_on = progress.tell(n_done as f64 / n_runs as f64);
    };
    let longest_ms = arguments.longest.as_secs_f64() * 1e3;
    let mut open: Vec<&String> = Vec::new();
    let mut too_long = None;
    for value in values {
        let known = known(kept, id, value);
        if known.as_ref().is_none_or(|cell| cell.runs.len() < n_repeats) {
            let first = bench.first(id, value);
            // Of a value that was interrupted, what is known stays: this run only warms up.
            if known.is_none() {
                kept.put(first.unwrap_or_else(|line| Cell::faulty(id, value, line)));
                kept.store()?;
            }
            open.push(value);
            tell();
        }
        if arguments.tool.is_some() && kept.cell(id, value).is_some_and(|c| c.first_ms > longest_ms)
        {
            too_long = Some(value);
            break;
        }
    }
    for number in 0..n_repeats {
        for value in &open {
            let waits = |cell: &Cell| cell.runs.len() == number && !cell.is_faulty();
            if kept.cell(id, value).is_some_and(|cell| waits(&cell)) {
                let run = bench.again(id, value);
                kept.add(id, value, run);
                kept.store()?;
                tell();
            }
        }
    }
    drop(progress);
    kept.store_all()?;
    let known: Vec<Cell> = values.iter().filter_map(|value| kept.cell(id, value)).collect();
    if let Some(last) = too_long
        && known.len() < values.len()
    {
        let (n, limit) = (values.len() - known.len(), arguments.longest.as_secs_f64());
        terminal::note(format!(
            "{id}: {n} values behind {last} are left out, which took longer than {limit} s; \
             --longest allows more"
        ));
    }
    Ok(known)
}

/// A file's path, its bytes, and when it was written.
type Stamp = (String, u64, Option<Duration>);

/// What tells a file from a later one at the same place.
fn stamp(path: &Path) -> anyhow::Result<Stamp> {
    let about = path.metadata().with_context(|| path.display().to_string())?;
    let written = about.modified().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
    Ok((path.display().to_string(), about.len(), written))
}

/// The files that were typed, and the clouds that a scene among them shows.
fn stamps_of(files: &[PathBuf], sources: &[Source]) -> anyhow::Result<Vec<Stamp>> {
    let shown = sources.iter().map(|source| &source.path);
    files.iter().chain(shown.filter(|path| !files.contains(path))).map(|path| stamp(path)).collect()
}

/// The files that parameters name.
fn stamps_of_values(declared: &[ParamDecl], values: &Values) -> anyhow::Result<Vec<Stamp>> {
    let files = declared.iter().filter(|declared| matches!(declared.kind, ParamKind::File { .. }));
    let paths = files.filter_map(|declared| match values.get(&declared.id) {
        Some(Value::Text(path)) if !path.is_empty() => Some(path),
        _ => None,
    });
    paths.map(|path| stamp(Path::new(path))).collect()
}

/// Writes the page, or what a part leaves behind.
fn told(whole: parted::Whole<'_>, known: &parted::Known, swept: page::Swept) -> anyhow::Result<()> {
    let arguments = whole.arguments;
    let faults = verdict(&swept.all);
    match arguments.part {
        Some(part) => whole.write(part, known, swept)?,
        None => {
            let words: Vec<String> = command_line::typed_words().collect();
            let (folder, json) = (arguments.out.as_path(), arguments.report.json);
            page::write(&page::Target { folder, json, words: &words }, &swept)?;
        }
    }
    faults
}

/// Fails where a value could not be measured.
pub(crate) fn verdict(all: &[(String, Vec<Cell>)]) -> anyhow::Result<()> {
    let mut cells = all.iter().flat_map(|(_, cells)| cells);
    cells.find_map(|cell| cell.fault.clone()).map_or(Ok(()), |line| bail!("{line}"))
}
