//! `surfelshop index`: files of any size in, a pyramid out.

use crate::arguments::IndexArguments;
use crate::contents_info;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use surfelshop_api::format::CloudHeader;
use surfelshop_pyramid::{Directory, IndexOptions, Pyramid, index};
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::output::files;
use surfelshop_session::output::terminal::{self, Progress};

/// Runs the command.
pub(crate) fn run(arguments: &IndexArguments) -> anyhow::Result<()> {
    files::protect(arguments.inputs.iter().map(|input| input.as_path()));
    files::check_writable(&arguments.output)?;
    let formats = SessionFormats::new(&arguments.plugins);
    let progress = Progress::new(format!("indexing {} files", arguments.inputs.len()));
    let tell = |fraction| progress.tell(fraction);
    let options = IndexOptions { read: formats.reading(&tell), memory: arguments.memory };
    let done = index(&arguments.inputs, &arguments.output, &options)?;
    drop(progress);
    done.warnings.iter().for_each(terminal::warn);
    let file = arguments.output.display().to_string();
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "index",
            "version": env!("CARGO_PKG_VERSION"),
            "file": file,
            "done": done,
        }));
    }
    let dropped = match done.n_not_finite {
        0 => String::new(),
        n => format!("; {n} of {} points without finite coordinates were left out", done.n_read),
    };
    terminal::line(format!(
        "{file}: {} surfels in {} nodes, {:.1} bytes a surfel{dropped}",
        done.n_surfels,
        done.n_nodes,
        done.bytes as f64 / done.n_surfels.max(1) as f64
    ))
}

/// What is in a pyramid, for programs.
pub(crate) fn object(file: &Path) -> anyhow::Result<Value> {
    let directory = Pyramid::directory_of(file)?;
    Ok(json!({ "file": file.display().to_string(), "pyramid": directory }))
}

/// A row for each thing to know of a pyramid.
pub(crate) fn text(file: &Path) -> anyhow::Result<String> {
    let directory = Pyramid::directory_of(file)?;
    let Directory { generator, n_surfels, n_leaves, n_nodes, bounds, notes, .. } = &directory;
    let mut text = file.display().to_string();
    let mut row = |name: &str, value: String| write!(text, "\n  {name:<9} {value}");
    row("format", format!("pyramid, made by {generator}"))?;
    row("surfels", format!("{n_surfels} in {n_leaves} leaves; {n_nodes} nodes in all"))?;
    row("bounds", contents_info::bounds(bounds[0], bounds[1]))?;
    let columns = directory.columns.clone();
    row("columns", contents_info::columns(&CloudHeader { columns, ..CloudHeader::default() }))?;
    contents_info::source_rows(&directory.source.of_cloud(), &mut row)?;
    for note in notes {
        row("note", note.clone())?;
    }
    Ok(text)
}
