//! `surfelshop index`: files of any size in, a pyramid out.

use crate::arguments::{IndexArguments, IndexStepChoice};
use serde_json::json;
use std::path::PathBuf;
use surfelshop_pyramid::{IndexOptions, IndexShare, IndexStep, ShareSummary, index, index_share};
use surfelshop_session::input::budget::within_limits;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::output::files;
use surfelshop_session::output::terminal::{self, Progress};

/// Runs the command.
pub(crate) fn run(arguments: &IndexArguments) -> anyhow::Result<()> {
    files::protect(arguments.inputs.iter().map(|input| input.as_path()));
    files::check_writable(&arguments.output)?;
    let formats = SessionFormats::new(&arguments.plugins);
    let progress = Progress::new(match arguments.inputs.as_slice() {
        [only] => format!("indexing {}", only.display()),
        several => format!("indexing {} files", several.len()),
    });
    let tell = |fraction| progress.tell(fraction);
    let options =
        IndexOptions { read: formats.reading(&tell), memory: within_limits(arguments.memory) };
    if let Some(step) = arguments.step {
        let done =
            index_share(&arguments.inputs, &arguments.output, &options, share(step, arguments));
        drop(progress);
        return told(arguments, step, done?);
    }
    let done = index(&arguments.inputs, &arguments.output, &options);
    drop(progress);
    let mut work = arguments.output.clone().into_os_string();
    work.push(".index");
    let work = PathBuf::from(work);
    if done.is_err() && work.join("cube.json").exists() {
        terminal::note(format!(
            "the work so far stays in {}, and the same command goes on from there",
            work.display()
        ));
    }
    let done = done?;
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

/// What a part does of a step; without a part all of it.
fn share(step: IndexStepChoice, arguments: &IndexArguments) -> IndexShare {
    let (number, of) = arguments.part.map_or((1, 1), |part| (part.number, part.of));
    IndexShare {
        step: match step {
            IndexStepChoice::Extent => IndexStep::Extent,
            IndexStepChoice::Points => IndexStep::Points,
            IndexStepChoice::Plan => IndexStep::Plan,
            IndexStepChoice::Surfels => IndexStep::Surfels,
        },
        number: number.saturating_sub(1) as usize,
        of: of as usize,
    }
}

fn told(
    arguments: &IndexArguments,
    step: IndexStepChoice,
    done: ShareSummary,
) -> anyhow::Result<()> {
    let step = format!("{step:?}").to_lowercase();
    let file = arguments.output.display().to_string();
    if arguments.report.json {
        return terminal::json(&json!({
            "command": "index",
            "version": env!("CARGO_PKG_VERSION"),
            "file": file,
            "step": step,
            "part": arguments.part,
            "done": done,
        }));
    }
    let part = arguments.part.map(|part| format!(", {part}")).unwrap_or_default();
    terminal::line(format!("{file}: {step}{part}: {} of {} pieces", done.n_own, done.n_all))
}
