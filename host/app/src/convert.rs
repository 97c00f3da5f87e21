//! `surfelshop convert`: files from format to format, point by point, or with what they lack estimated.

use crate::arguments::ConvertArguments;
use anyhow::ensure;
use serde_json::json;
use surfelshop_api::params::Values;
use surfelshop_cloud::WriteOptions;
use surfelshop_cloud::convert::{Converted, Selection, convert};
use surfelshop_session::input::clouds;
use surfelshop_session::input::formats::{SessionFormats, typed_values};
use surfelshop_session::output::files;
use surfelshop_session::output::terminal::{self, Progress};

/// Runs the command.
pub(crate) fn run(arguments: &ConvertArguments) -> anyhow::Result<()> {
    files::check_writable(&arguments.output)?;
    let values = parameters(arguments);
    let formats = SessionFormats::new(&arguments.plugins);
    if arguments.estimate {
        return estimated(arguments, values.as_ref(), &formats);
    }
    let names: Vec<String> =
        arguments.inputs.iter().map(|file| file.display().to_string()).collect();
    let progress = Progress::new(format!("converting {}", names.join(", ")));
    let tell = |fraction| progress.tell(fraction);
    let selection = Selection {
        crop: arguments.crop,
        every: arguments.every,
        columns: (!arguments.columns.is_empty()).then(|| arguments.columns.clone()),
    };
    let silent = surfelshop_cloud::silent;
    let (ascii, values) = (arguments.ascii, values.as_ref());
    let writing = WriteOptions { ascii, values, ..formats.writing(&silent) };
    check_parameters(arguments, &writing)?;
    let done = convert(
        &arguments.inputs,
        &arguments.output,
        &selection,
        arguments.merge,
        &formats.reading(&tell),
        &writing,
    )?;
    drop(progress);
    if arguments.ascii && surfelshop_cloud::writer(&arguments.output, &writing)?.is_some() {
        terminal::warn(
            "--ascii is for PLY files and changes nothing here; PCD takes --write-set encoding=ascii",
        );
    }
    done.warnings.iter().chain(&done.lost).for_each(terminal::warn);
    told(arguments, &done)
}

/// The parameters of the format that is written, as they were typed.
fn parameters(arguments: &ConvertArguments) -> Option<Values> {
    let typed = arguments.write_set.iter().map(|set| (set.id.as_str(), set.value.as_str()));
    typed_values(typed)
}

/// Refuses parameters for a file that no format of a plugin writes.
fn check_parameters(
    arguments: &ConvertArguments,
    writing: &WriteOptions<'_>,
) -> anyhow::Result<()> {
    let is_built_in = surfelshop_cloud::writer(&arguments.output, writing)?.is_none();
    ensure!(
        arguments.write_set.is_empty() || !is_built_in,
        "--write-set: {}: expected a format with parameters, found PLY, which has none",
        arguments.output.display()
    );
    Ok(())
}

/// Says what was written.
fn told(arguments: &ConvertArguments, done: &Converted) -> anyhow::Result<()> {
    let file = arguments.output.display().to_string();
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "convert",
            "version": env!("CARGO_PKG_VERSION"),
            "file": file,
            "read": done.n_read,
            "written": done.n_written,
            "not_finite": done.n_not_finite,
            "columns": done.columns,
            "warnings": done.warnings,
            "lost": done.lost,
        }));
    }
    let Converted { n_read, n_written, n_not_finite, .. } = done;
    let of = if n_read == n_written { String::new() } else { format!(" of {n_read}") };
    let dropped = match n_not_finite {
        0 => String::new(),
        n => format!("; {n} without finite coordinates were left out"),
    };
    // Lines above say which columns the format does not hold.
    let columns = match done.lost.is_empty() {
        true => format!(" with {}", done.columns.join(", ")),
        false => String::new(),
    };
    terminal::line(format!("{file}: {n_written}{of} points{columns}{dropped}"))
}

/// Writes a cloud with the normals and radii that it lacked.
fn estimated(
    arguments: &ConvertArguments,
    values: Option<&Values>,
    formats: &SessionFormats,
) -> anyhow::Result<()> {
    let [input] = arguments.inputs.as_slice() else {
        anyhow::bail!("--estimate works on one file; merge them first");
    };
    let selects = arguments.crop.is_some() || arguments.every > 1 || !arguments.columns.is_empty();
    ensure!(!selects, "--estimate takes a whole file; crop or thin it in a command before");
    let silent = surfelshop_cloud::silent;
    check_parameters(arguments, &formats.writing(&silent))?;
    let loaded = clouds::read(input, formats)?;
    let progress = Progress::new(format!("writing {}", arguments.output.display()));
    let tell = |fraction| progress.tell(fraction);
    let comments = loaded.summary.comments.clone();
    let ascii = arguments.ascii;
    let options = WriteOptions { ascii, comments, values, ..formats.writing(&tell) };
    let written = surfelshop_cloud::write(&arguments.output, &loaded.cloud, &options)?;
    drop(progress);
    let n = loaded.cloud.len() as u64;
    let columns = loaded.cloud.columns().iter().map(|column| column.name().to_owned());
    let done = Converted {
        n_read: loaded.summary.n_in_file,
        n_written: n,
        n_not_finite: loaded.summary.n_dropped,
        columns: columns.collect(),
        warnings: loaded.summary.warnings.clone(),
        lost: written.lost,
    };
    done.warnings.iter().chain(&done.lost).for_each(terminal::warn);
    told(arguments, &done)
}
