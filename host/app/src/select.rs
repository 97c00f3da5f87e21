//! `surfelshop select`: some of a cloud's surfels counted, taken out, left out or given values.

use crate::arguments::SelectArguments;
use crate::select_pyramid;
use anyhow::{anyhow, bail};
use serde_json::json;
use std::path::PathBuf;
use surfelshop_cloud::selection::{deleted, extracted, with_value};
use surfelshop_cloud::{Cloud, WriteOptions};
use surfelshop_pyramid::is_pyramid_file;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::layers;
use surfelshop_session::input::pyramids;
use surfelshop_session::options::select::select;
use surfelshop_session::output::files;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::tool_run;

/// Runs the command.
pub(crate) fn run(arguments: &SelectArguments) -> anyhow::Result<()> {
    let SelectArguments { file, what, out, delete, set, .. } = arguments;
    if out.is_none() && (*delete || !set.is_empty()) {
        bail!("--delete and --set change a cloud: name the file to write with -o");
    }
    if let Some(out) = out {
        files::check_writable(out)?;
    }
    if let Some(layer) = &arguments.layer {
        files::protect([layer.as_path()]);
    }
    let source = tool_run::source(file)?;
    // Who names a cloud twice wants it replaced.
    files::allow(file);
    files::check_outputs(&out.iter().map(PathBuf::as_path).collect::<Vec<_>>())?;
    if is_pyramid_file(&source.path) {
        return select_pyramid::run(arguments, &source);
    }
    if arguments.layer.is_some() || out.as_deref().is_some_and(layers::is_layer) {
        bail!(
            "{}: expected a pyramid, which layers of edits belong to, found a cloud that memory holds",
            file.display()
        );
    }
    let formats = SessionFormats::new(&arguments.plugins);
    let mut clouds = Clouds::read(&[source], &formats)?;
    pyramids::refuse(&clouds, "select")?;
    let loaded = clouds.loaded.pop().ok_or_else(|| anyhow!("no cloud was read"))?;
    let cloud = loaded.cloud;
    let of_file = |error| anyhow!("{}: {error}", file.display());
    let chosen =
        select(&cloud, what, arguments.up.or_of([cloud.source()]).into()).map_err(of_file)?;
    let (n_selected, n) = (chosen.count(), cloud.len());
    let mut written = None;
    if let Some(out) = out {
        let changed: Cloud = match (delete, &set[..]) {
            (true, _) => deleted(&cloud, &chosen).map_err(of_file)?,
            (false, []) => extracted(&cloud, &chosen).map_err(of_file)?,
            (false, set) => set.iter().try_fold(cloud, |cloud, value| {
                with_value(&cloud, &chosen, &value.name, &value.values).map_err(of_file)
            })?,
        };
        let progress = Progress::new(format!("writing {}", out.display()));
        let tell = |fraction| progress.tell(fraction);
        let options = WriteOptions { comments: loaded.summary.comments, ..formats.writing(&tell) };
        let done = surfelshop_cloud::write(out, &changed, &options)?;
        done.lost.iter().for_each(terminal::warn);
        written = Some(changed.len() as u64);
    }
    said(arguments, [n_selected, n].map(|n| n as u64), written)
}

/// Says how many surfels were selected, of how many, and how many were written.
pub(crate) fn said(
    arguments: &SelectArguments,
    [n_selected, n]: [u64; 2],
    n_written: Option<u64>,
) -> anyhow::Result<()> {
    let SelectArguments { file, out, .. } = arguments;
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "select",
            "version": env!("CARGO_PKG_VERSION"),
            "selected": n_selected,
            "surfels": n,
            "file": out.as_ref().map(|out| out.display().to_string()),
            "surfels_written": n_written,
        }));
    }
    terminal::line(format!("{}: {n_selected} of {n} surfels selected", file.display()))?;
    let Some((out, n)) = out.as_ref().zip(n_written) else { return Ok(()) };
    let edits = if layers::is_layer(out) { "edits that leave " } else { "" };
    terminal::line(format!("{}: {edits}{n} surfels", out.display()))
}
