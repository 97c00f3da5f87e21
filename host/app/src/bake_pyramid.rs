//! `surfelshop bake` over a pyramid: tools run part by part, a pyramid out.

use crate::arguments::BakeArguments;
use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use surfelshop_api::Scope;
use surfelshop_pyramid::{Pyramid, PyramidError, RemakeOptions, RemakeSummary, remake};
use surfelshop_runtime::tools::ToolOptions;
use surfelshop_session::cpu_time::cpu_time;
use surfelshop_session::options::values;
use surfelshop_session::output::json::plain;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::tool_run::{LeftBehind, Step};

/// What a tool did.
struct Baked {
    done: RemakeSummary,
    took: Duration,
    cpu: Option<Duration>,
}

/// Runs the tools one after the other, each over the pyramid that the one before made.
pub(crate) fn run(
    arguments: &BakeArguments,
    steps: &[Step],
    options: &ToolOptions,
    stop: &AtomicBool,
) -> anyhow::Result<()> {
    values::pyramid_file(&arguments.out.display().to_string()).map_err(|line| {
        anyhow!("{}: tools make pyramids of pyramids: {line}", arguments.out.display())
    })?;
    if let Some(step) = steps.iter().find(|step| step.unit.description.scope == Scope::Cloud) {
        bail!(
            "{} sees a cloud as a whole, and {} is a pyramid, which need not fit into memory; run it \
             on the files that the pyramid was made of, and `index` what it makes",
            step.reference,
            arguments.file.display()
        );
    }
    let mut baked = Vec::new();
    let mut source = arguments.file.clone();
    let mut between: Option<Temporary> = None;
    for (number, step) in steps.iter().enumerate() {
        let is_last = number + 1 == steps.len();
        let next = (!is_last).then(|| Temporary(beside(&arguments.out, number + 1)));
        let output = next.as_ref().map_or(arguments.out.as_path(), |next| next.0.as_path());
        baked.push(over(arguments, step, (&source, output), options, stop)?);
        source = output.to_owned();
        // What the step before made goes once the next is whole.
        between = next;
    }
    drop(between);
    said(arguments, steps, &baked)
}

/// A pyramid between two tools, removed when it is no longer needed.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        // What cannot be removed does no harm.
        drop(std::fs::remove_file(&self.0));
    }
}

/// The pyramid that a tool but the last makes.
fn beside(out: &Path, number: usize) -> PathBuf {
    out.with_extension(format!("step-{number}.surfels"))
}

/// A tool over a pyramid.
fn over(
    arguments: &BakeArguments,
    step: &Step,
    (source, output): (&Path, &Path),
    options: &ToolOptions,
    stop: &AtomicBool,
) -> anyhow::Result<Baked> {
    let (started, cpu) = (Instant::now(), cpu_time());
    let pyramid = Pyramid::open(source)?;
    let text = |value: Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let typed = step.values.iter().map(|(id, value)| format!(" {id}={}", text(plain(value))));
    let what = format!(
        "{} {}{}",
        step.reference.id,
        step.unit.manifest.version,
        typed.collect::<String>()
    );
    let bar = Progress::new(step.reference.id.clone());
    let tell = |fraction: f64| {
        let flow = bar.tell(fraction);
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { flow }
    };
    let remaking = RemakeOptions {
        scope: step.unit.description.scope,
        what: &what,
        depends: &[&step.reference.path],
        memory: arguments.memory,
        progress: &tell,
    };
    let mut left_behind = None;
    let done = remake(&pyramid, output, &remaking, &mut |cloud, progress| {
        let told = |now: &surfelshop_runtime::tools::Progress| {
            let _flow = progress(now.fraction);
        };
        let ran = step.run_telling(cloud, options, stop, &told);
        let (done, _) = ran.map_err(|error| {
            let line = format!("{error:#}");
            left_behind = error.downcast::<LeftBehind>().ok();
            line
        })?;
        Ok(done.edited)
    });
    if let (Err(error), Some(why)) = (&done, &left_behind) {
        // The usual end of the program would take the graphics driver from under the tool.
        terminal::leave(&anyhow!("{error}; {why}"));
    }
    let done = match done {
        Err(PyramidError::Points(line)) => bail!("{}: {line}", source.display()),
        done => done?,
    };
    drop(bar);
    done.warnings.iter().for_each(terminal::warn);
    let cpu = cpu_time().zip(cpu).map(|(now, then)| now.saturating_sub(then));
    Ok(Baked { done, took: started.elapsed(), cpu })
}

/// Says what was done.
fn said(arguments: &BakeArguments, steps: &[Step], baked: &[Baked]) -> anyhow::Result<()> {
    let Some(Baked { done: last, .. }) = baked.last() else { return Ok(()) };
    let out = arguments.out.display();
    if arguments.report.json {
        let steps: Vec<Value> =
            steps.iter().zip(baked).map(|(step, baked)| object(step, baked)).collect();
        return terminal::json(&json!({
            "command": "bake",
            "version": env!("CARGO_PKG_VERSION"),
            "file": out.to_string(),
            "steps": steps,
            "pyramid": last,
            "surfels": last.n_surfels,
        }));
    }
    for (step, Baked { done, took, cpu }) in steps.iter().zip(baked) {
        let RemakeSummary { n_before, n_surfels, n_parts, columns, .. } = done;
        let mut what = vec![match n_before == n_surfels {
            true => format!("{n_surfels} surfels in {n_parts} parts"),
            false => format!("{n_surfels} surfels of {n_before} in {n_parts} parts"),
        }];
        what.extend((!columns.is_empty()).then(|| columns.join(", ")));
        let cpu = cpu.map_or_else(String::new, |cpu| format!(" ({:.2} s CPU)", cpu.as_secs_f64()));
        terminal::line(format!(
            "{}: {}; {:.2} s{cpu}",
            step.reference.id,
            what.join("; "),
            took.as_secs_f64()
        ))?;
    }
    terminal::line(format!(
        "{out}: {} surfels in {} nodes, {:.1} bytes a surfel",
        last.n_surfels,
        last.n_nodes,
        last.bytes as f64 / last.n_surfels.max(1) as f64
    ))
}

/// A run in JSON.
fn object(step: &Step, Baked { done, took, cpu }: &Baked) -> Value {
    let declared = step.unit.description.params.iter();
    let parameters: serde_json::Map<String, Value> = declared
        .map(|one| (one.id.clone(), plain(&one.sanitise(step.values.get(&one.id)))))
        .collect();
    json!({
        "tool": {
            "package": step.reference.package,
            "id": step.reference.id,
            "version": step.unit.manifest.version,
            "file": step.reference.path.display().to_string(),
            "parameters": parameters,
        },
        "wall_seconds": took.as_secs_f64(),
        "cpu_seconds": cpu.map(|cpu| cpu.as_secs_f64()),
        "parts": done.n_parts,
        "surfels_in": done.n_before,
        "surfels_out": done.n_surfels,
        "columns": done.columns,
    })
}
