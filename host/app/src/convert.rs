//! `surfelshop convert`: reads a cloud and writes it in another format.

use crate::arguments::ConvertArguments;
use serde_json::json;
use surfelshop_cloud::WriteOptions;
use surfelshop_session::input::clouds;
use surfelshop_session::output::files;
use surfelshop_session::output::terminal::{self, Progress};

/// Runs the command.
pub(crate) fn run(arguments: &ConvertArguments) -> anyhow::Result<()> {
    files::check_writable(&arguments.output)?;
    let loaded = clouds::read(&arguments.input)?;
    let progress = Progress::new(format!("writing {}", arguments.output.display()));
    let tell = |fraction| progress.tell(fraction);
    let options =
        WriteOptions { ascii: arguments.ascii, progress: &tell, ..WriteOptions::default() };
    surfelshop_cloud::write(&arguments.output, &loaded.cloud, &options)?;
    drop(progress);
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "convert",
            "version": env!("CARGO_PKG_VERSION"),
            "file": arguments.output.display().to_string(),
            "cloud": loaded.summary,
        }));
    }
    let n_surfels = loaded.cloud.len();
    let columns: Vec<&str> = loaded.cloud.columns().iter().map(|column| column.name()).collect();
    let encoding = if arguments.ascii { "text" } else { "binary" };
    terminal::line(format!(
        "{}: {n_surfels} surfels, {encoding} PLY with {}",
        arguments.output.display(),
        columns.join(", ")
    ))
}
