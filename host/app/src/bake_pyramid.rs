//! `surfelshop bake` over a pyramid: tools run part by part, a pyramid out.

use crate::arguments::BakeArguments;
use crate::tool_object::tool_object;
use anyhow::{Context as _, anyhow, bail};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use surfelshop_api::Scope;
use surfelshop_pyramid::{Pyramid, PyramidError, RemakeOptions, RemakeSummary, Rule, remake};
use surfelshop_runtime::tools::ToolOptions;
use surfelshop_session::cpu_time::cpu_time;
use surfelshop_session::input::budget::within_limits;
use surfelshop_session::options::values;
use surfelshop_session::output::files;
use surfelshop_session::output::json::plain;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::tool_run::{LeftBehind, Step};

/// What a tool did.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
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
    let mut work = Between::of(arguments, steps)?;
    let mut baked = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        let source = match number {
            0 => arguments.file.clone(),
            _ => work.path(number - 1),
        };
        let is_last = number + 1 == steps.len();
        let output = if is_last { arguments.out.clone() } else { work.path(number) };
        let done = match work.known(number) {
            Some(done) if !is_last => done,
            _ => {
                let done = over(arguments, step, (&source, &output), options, stop);
                let done = done.inspect_err(|error| work.tell(arguments, error))?;
                if !is_last {
                    work.keep(number, &done)?;
                }
                done
            }
        };
        baked.push(done);
    }
    work.remove();
    said(arguments, steps, &baked)
}

/// The pyramids between several tools, in a folder beside the output until all is done: a bake that was ended goes on
/// with the tool that it was at.
struct Between {
    folder: PathBuf,
    /// What each of the tools works on and does, those before it included.
    identities: Vec<String>,
    done: Vec<(String, Baked)>,
}

/// The file in the folder that says what is done.
const DONE: &str = "done.json";

impl Between {
    /// Finds the folder; of one tool there is none.
    fn of(arguments: &BakeArguments, steps: &[Step]) -> anyhow::Result<Self> {
        let mut name = arguments.out.as_os_str().to_owned();
        name.push(".bake");
        let folder = PathBuf::from(name);
        let mut identity = identity_of(&arguments.file)?;
        let mut identities = Vec::new();
        for step in steps {
            identity += &format!("; {} of {}", words(step), identity_of(&step.reference.path)?);
            identities.push(identity.clone());
        }
        let mut work = Self { folder, identities, done: Vec::new() };
        if steps.len() < 2 {
            return Ok(work);
        }
        let text = std::fs::read(work.folder.join(DONE));
        if text.is_err()
            && std::fs::read_dir(&work.folder).is_ok_and(|mut all| all.next().is_some())
        {
            bail!(
                "{}: expected no folder of this name, or one of a bake that was ended; remove it, or name \
                 another output",
                work.folder.display()
            );
        }
        let known = text.ok().and_then(|text| serde_json::from_slice(&text).ok());
        work.done = known.unwrap_or_default();
        std::fs::create_dir_all(&work.folder)
            .with_context(|| format!("{}: cannot be made", work.folder.display()))?;
        work.save()?;
        Ok(work)
    }

    fn path(&self, number: usize) -> PathBuf {
        self.folder.join(format!("step-{}.surfels", number + 1))
    }

    /// What a tool did in an earlier run, where that is still there.
    fn known(&self, number: usize) -> Option<Baked> {
        let (identity, baked) = self.done.get(number)?;
        let is_it = *identity == self.identities[number] && self.path(number).exists();
        is_it.then(|| baked.clone())
    }

    fn keep(&mut self, number: usize, done: &Baked) -> anyhow::Result<()> {
        self.done.truncate(number);
        self.done.push((self.identities[number].clone(), done.clone()));
        self.save()
    }

    fn save(&self) -> anyhow::Result<()> {
        files::write_whole(&self.folder.join(DONE), &serde_json::to_vec(&self.done)?)
    }

    /// Says where the work so far is, where the system refused: what is cancelled says so itself.
    fn tell(&self, arguments: &BakeArguments, error: &anyhow::Error) {
        if !matches!(error.downcast_ref::<PyramidError>(), Some(PyramidError::Io { .. })) {
            return;
        }
        let mut index = arguments.out.as_os_str().to_owned();
        index.push(".index");
        let left = [self.folder.clone(), PathBuf::from(index)];
        let left: Vec<String> = left
            .iter()
            .filter(|folder| folder.exists())
            .map(|folder| folder.display().to_string())
            .collect();
        if !left.is_empty() {
            terminal::note(format!(
                "the work so far stays in {}, and the same command goes on from there",
                left.join(" and ")
            ));
        }
    }

    fn remove(self) {
        if self.identities.len() > 1 {
            // What cannot be removed does no harm.
            drop(std::fs::remove_dir_all(&self.folder));
        }
    }
}

/// A file by its place, length, and when it was changed.
fn identity_of(path: &Path) -> anyhow::Result<String> {
    let failed = || format!("{}: cannot be read", path.display());
    let place = path.canonicalize().with_context(failed)?;
    let found = place.metadata().with_context(failed)?;
    let changed = found.modified().with_context(failed)?;
    Ok(format!("{} {} {changed:?}", place.display(), found.len()))
}

/// What a tool does, with every parameter.
fn words(step: &Step) -> String {
    let text = |value: Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let all = parameters(step).into_iter().map(|(id, value)| format!("{id} {}", text(value)));
    let all: Vec<String> = all.collect();
    format!(
        "{}/{} {}: {}",
        step.reference.package,
        step.reference.id,
        step.unit.manifest.version,
        all.join(", ")
    )
}

/// Every parameter with the value that the tool runs with.
fn parameters(step: &Step) -> serde_json::Map<String, Value> {
    let declared = step.unit.description.params.iter();
    declared.map(|one| (one.id.clone(), plain(&one.sanitise(step.values.get(&one.id))))).collect()
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
    let what = words(step);
    let bar = Progress::new(step.reference.id.clone());
    let tell = |fraction: f64| {
        let flow = bar.tell(fraction);
        if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { flow }
    };
    let remaking = RemakeOptions {
        scope: step.unit.description.scope,
        what: &what,
        depends: &[&step.reference.path],
        memory: within_limits(arguments.memory),
        rule: Rule::Merged,
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
        Err(PyramidError::Points(line)) => bail!("{}: {line}", arguments.file.display()),
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
    json!({
        "tool": tool_object(step, parameters(step)),
        "wall_seconds": took.as_secs_f64(),
        "cpu_seconds": cpu.map(|cpu| cpu.as_secs_f64()),
        "parts": done.n_parts,
        "surfels_in": done.n_before,
        "surfels_out": done.n_surfels,
        "columns": done.columns,
    })
}
