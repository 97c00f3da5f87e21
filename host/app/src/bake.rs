//! `surfelshop bake`: a cloud and tools in, a cloud out.

use crate::arguments::BakeArguments;
use crate::tool_object::tool_object;
use crate::{bake_pyramid, bake_strokes, info};
use anyhow::{anyhow, bail, ensure};
use glam::DQuat;
use serde_json::{Map, Value, json};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::columns::Role;
use surfelshop_cloud::{
    Buffer, Cloud, Column, How, Loaded, ReadError, Transform, WriteOptions, scene,
};
use surfelshop_pyramid::is_pyramid_file;
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_runtime::tools::{Done, ToolOptions};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::pyramids;
use surfelshop_session::input::scenes::Source;
use surfelshop_session::input::strokes::NamedStroke;
use surfelshop_session::options::values;
use surfelshop_session::output::json::plain;
use surfelshop_session::output::terminal::{self, Progress};
use surfelshop_session::output::{files, provenance};
use surfelshop_session::tool_run::{self, LeftBehind, Step};
use surfelshop_session::{interrupt, parameters, session};

/// A tool that has run.
struct Baked {
    done: Done,
    n_before: usize,
    n_after: usize,
    cpu: Option<Duration>,
    columns: Vec<NewColumn>,
    /// Of strokes: how many there were, and how many surfels they concerned.
    strokes: Option<(usize, u64)>,
}

/// A column that a tool made.
struct NewColumn {
    name: String,
    components: u32,
    element: &'static str,
    /// Smallest, largest and mean value, and how many are not finite; of floats alone.
    spread: Option<Spread>,
}

/// What the values of a column are like.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread {
    min: f64,
    max: f64,
    mean: f64,
    n_not_finite: usize,
}

/// Runs the command.
pub(crate) fn run(arguments: &BakeArguments) -> anyhow::Result<()> {
    let request = interrupt::looked_at();
    let stop: &AtomicBool = &request;
    // What can fail at once is tried before a large cloud is read.
    files::check_writable(&arguments.out)?;
    let steps = steps(arguments)?;
    let options = ToolOptions {
        patience: arguments.plugins.patience(),
        threads: arguments.threads,
        device: session::gpu_options(&arguments.device).into(),
    };
    if is_pyramid_file(&arguments.file) {
        if arguments.strokes.is_some() || !arguments.select.is_empty() {
            bail!(
                "{}: --strokes and --select work on clouds in memory, and this is a pyramid; use the files that it \
                 was made of",
                arguments.file.display()
            );
        }
        files::allow(&arguments.file);
        files::check_outputs(&[&arguments.out])?;
        return bake_pyramid::run(arguments, &steps, &options, stop);
    }
    if values::pyramid_file(&arguments.out.display().to_string()).is_ok() {
        bail!(
            "{}: expected a pyramid, which tools make another one of, found something else; `surfelshop index` makes \
             one of it",
            arguments.file.display()
        );
    }
    let strokes = bake_strokes::read(arguments, &steps)?;
    let source = tool_run::source(&arguments.file)?;
    if !scene::is_scene(&arguments.file) {
        // Who names a cloud twice wants it replaced.
        files::allow(&arguments.file);
    }
    files::check_outputs(&[&arguments.out])?;
    let baked = bake(arguments, (&steps, strokes), (source, &options), stop);
    if stop.load(Ordering::Relaxed)
        && let Err(error) = &baked
    {
        tracing::debug!("{error:#}");
        let left_behind = error.downcast_ref::<LeftBehind>();
        let out = arguments.out.display();
        if let Some(why) = left_behind {
            // The usual end of the program would take the graphics driver from under the tool.
            terminal::leave(&anyhow!("cancelled; {out} was not written; {why}"));
        }
        bail!("cancelled; {out} was not written");
    }
    let (loaded, cloud, baked) = baked?;
    if arguments.report.json {
        let steps = steps.iter().zip(&baked).map(|(step, baked)| object(step, baked));
        return terminal::json(&json!({
            "command": "bake",
            "version": env!("CARGO_PKG_VERSION"),
            "file": arguments.out.display().to_string(),
            "cloud": loaded.summary,
            "steps": steps.collect::<Vec<_>>(),
            "surfels": cloud.len(),
            "columns": cloud.columns().iter().map(Column::name).collect::<Vec<_>>(),
        }));
    }
    for repair in info::repairs(&loaded.summary) {
        terminal::line(format!("{}: {repair}", loaded.summary.file))?;
    }
    for (step, baked) in steps.iter().zip(&baked) {
        terminal::line(line(step, baked))?;
    }
    let columns: Vec<&str> = cloud.columns().iter().map(Column::name).collect();
    let (out, n_surfels) = (arguments.out.display(), cloud.len());
    terminal::line(format!("{out}: {n_surfels} surfels with {}", columns.join(", ")))
}

/// Finds all tools and checks all parameters, before anything runs.
fn steps(arguments: &BakeArguments) -> anyhow::Result<Vec<Step>> {
    let registry = session::registry(&arguments.plugins)?;
    let find = |name: &String| Ok(registry.find(UnitKind::Tool, name)?);
    let units: Vec<UnitRef> = arguments.tool.iter().map(find).collect::<anyhow::Result<_>>()?;
    let typed = parameters::dealt(&units, &arguments.set)?;
    let patience = arguments.plugins.patience();
    let step = |(reference, typed): (UnitRef, Vec<_>)| {
        let unit = session::load(&reference, &patience)?;
        let values = parameters::values(&reference, &unit.description.params, typed)?;
        Ok(Step { reference, unit, values })
    };
    units.into_iter().zip(typed).map(step).collect()
}

/// Columns that are named one by one.
const MOST_NAMED: usize = 8;

/// A sentence about columns that may hold lengths or directions, which nobody here can tell, where the cloud was
/// scaled or turned.
fn left_as_they_were(cloud: &Cloud, how: &Transform) -> Option<String> {
    let turned = how.rotation.quaternion().is_some_and(|q| q.angle_between(DQuat::IDENTITY) > 0.0);
    let scaled = how.scale != 1.0;
    let done = match (scaled, turned) {
        (true, true) => format!("scaled by {} and turned", how.scale),
        (true, false) => format!("scaled by {}", how.scale),
        (false, true) => "turned".to_owned(),
        (false, false) => return None,
    };
    let may_be_meant = |column: &&Column| {
        let is_float = matches!(column.values(), Buffer::F32(_) | Buffer::F64(_));
        let stays = column.role() == Role::Plain;
        is_float && stays && !surfelshop_cloud::is_well_known(column.name())
    };
    let names: Vec<&str> = cloud.columns().iter().filter(may_be_meant).map(Column::name).collect();
    if names.is_empty() {
        return None;
    }
    let more = match names.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        n => format!(" and {n} others"),
    };
    let named = names.iter().take(MOST_NAMED).map(|name| format!("`{name}`"));
    let named = named.collect::<Vec<_>>().join(", ");
    Some(format!(
        "the scene has the cloud {done}; {named}{more} stayed as they were: if they hold lengths, \
         directions or rotations, they are wrong now"
    ))
}

/// Reads, runs the tools and writes.
fn bake(
    arguments: &BakeArguments,
    (steps, strokes): (&[Step], Vec<(usize, NamedStroke)>),
    (source, options): (Source, &ToolOptions),
    stop: &AtomicBool,
) -> anyhow::Result<(Loaded, Cloud, Vec<Baked>)> {
    let asked = |flow| if stop.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { flow };
    let formats = SessionFormats::new(&arguments.plugins);
    // A wrong ending is refused before hours of work.
    surfelshop_cloud::writer(&arguments.out, &formats.writing(&surfelshop_cloud::silent))?;
    let read = |file: &Path| -> Result<Loaded, ReadError> {
        let progress = Progress::new(format!("reading {}", file.display()));
        let tell = |fraction| asked(progress.tell(fraction));
        surfelshop_cloud::read(file, &formats.reading(&tell))
    };
    let transform = source.transform;
    let mut clouds = Clouds::read_with(&[source], None, read)?;
    pyramids::refuse(&clouds, "bake of a scene")?;
    let loaded = clouds.loaded.pop();
    let mut loaded = loaded.ok_or_else(|| anyhow!("no cloud was read"))?;
    loaded
        .summary
        .warnings
        .extend(transform.and_then(|how| left_as_they_were(&loaded.cloud, &how)));
    let mut cloud = loaded.cloud.clone();
    let baked = match strokes.is_empty() {
        true => run_all(arguments, steps, (&mut cloud, options, stop))?,
        false => {
            let n_before = cloud.len();
            let given = (&mut cloud, options, stop);
            let replayed = bake_strokes::replay(arguments, steps, &strokes, given)?;
            let baked = steps.iter().zip(replayed).map(|(step, replayed)| match replayed {
                Some(replayed) => {
                    let strokes = Some((replayed.n_strokes, replayed.n_concerned));
                    let baked = Baked::of(replayed.done, (n_before, cloud.len()), None, &cloud);
                    Ok(Baked { strokes, ..baked })
                }
                None => bail!("{}: no stroke of it comes near the cloud", step.reference),
            });
            baked.collect::<anyhow::Result<_>>()?
        }
    };
    tracing::debug!("writing {}", arguments.out.display());
    let progress = Progress::new(format!("writing {}", arguments.out.display()));
    let tell = |fraction| asked(progress.tell(fraction));
    let comments = loaded.summary.comments.clone();
    let options = WriteOptions { comments, ..formats.writing(&tell) };
    let written = surfelshop_cloud::write(&arguments.out, &cloud, &options)?;
    written.lost.iter().for_each(terminal::warn);
    Ok((loaded, cloud, baked))
}

/// Runs tools over a cloud, or over what is selected of it, one after the other.
fn run_all(
    arguments: &BakeArguments,
    steps: &[Step],
    (cloud, options, stop): (&mut Cloud, &ToolOptions, &AtomicBool),
) -> anyhow::Result<Vec<Baked>> {
    let mut baked = Vec::new();
    for step in steps {
        let n_before = cloud.len();
        let (done, cpu) = match arguments.select.is_empty() {
            true => step.run(cloud, options, stop)?,
            false => bake_strokes::run_selected(arguments, step, (cloud, options, stop))?,
        };
        if let Some(edited) = &done.edited {
            *cloud = edited.cloud.clone();
        }
        leaves_some(step, n_before, cloud)?;
        baked.push(Baked::of(done, (n_before, cloud.len()), cpu, cloud));
    }
    Ok(baked)
}

/// Whether a tool left something of a cloud.
pub(crate) fn leaves_some(step: &Step, n_before: usize, cloud: &Cloud) -> anyhow::Result<()> {
    ensure!(
        !cloud.is_empty() || n_before == 0,
        "{}: it takes all {n_before} surfels away; a cloud cannot be left without any",
        step.reference
    );
    Ok(())
}

impl Baked {
    fn of(
        done: Done,
        (n_before, n_after): (usize, usize),
        cpu: Option<Duration>,
        cloud: &Cloud,
    ) -> Self {
        let made = done.edited.iter().flat_map(|edited| &edited.columns);
        let columns = made.filter_map(|name| cloud.column(name)).map(NewColumn::of).collect();
        Self { done, n_before, n_after, cpu, columns, strokes: None }
    }
}

impl NewColumn {
    fn of(column: &Column) -> Self {
        let spread = match column.values() {
            Buffer::F32(values) => Spread::of(values.iter().map(|&value| f64::from(value))),
            Buffer::F64(values) => Spread::of(values.iter().copied()),
            _ => None,
        };
        Self {
            name: column.name().to_owned(),
            components: column.components(),
            element: column.values().element().name(),
            spread,
        }
    }
}

impl Spread {
    /// What these values are like; `None` where none is finite.
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut n, mut sum, mut n_not_finite) = (0u64, 0.0, 0);
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            if value.is_finite() {
                (n, sum) = (n + 1, sum + value);
                (min, max) = (min.min(value), max.max(value));
            } else {
                n_not_finite += 1;
            }
        }
        (n > 0).then(|| Self { min, max, mean: sum / n as f64, n_not_finite })
    }
}

/// A run in JSON.
fn object(step: &Step, baked: &Baked) -> Value {
    let Baked { done, n_before, n_after, cpu, columns, strokes } = baked;
    let parameters: Map<String, Value> =
        done.values.iter().map(|(id, value)| (id.clone(), plain(value))).collect();
    let column = |column: &NewColumn| {
        json!({
            "name": column.name,
            "components": column.components,
            "type": column.element,
            "min": column.spread.map(|spread| spread.min),
            "max": column.spread.map(|spread| spread.max),
            "mean": column.spread.map(|spread| spread.mean),
            "not_finite": column.spread.map(|spread| spread.n_not_finite),
        })
    };
    json!({
        "tool": tool_object(step, parameters),
        "wall_seconds": done.took.as_secs_f64(),
        "cpu_seconds": cpu.map(|cpu| cpu.as_secs_f64()),
        "adapter": done.device,
        "said": done.said,
        "surfels_in": n_before,
        "surfels_out": n_after,
        "whole_cloud": done.edited.as_ref().and_then(|edited| edited.whole).map(provenance::word),
        "strokes": strokes.map(|(n, _)| n),
        "surfels_concerned": strokes.map(|(_, n)| n),
        "columns": columns.iter().map(column).collect::<Vec<_>>(),
    })
}

/// A run in words.
fn line(step: &Step, baked: &Baked) -> String {
    let Baked { done, n_before, n_after, cpu, columns, strokes } = baked;
    let mut parts = Vec::new();
    if let Some((n, n_concerned)) = strokes {
        let plural = if *n == 1 { "" } else { "s" };
        parts.push(format!("{n} stroke{plural} over {n_concerned} surfels"));
    }
    let says_all = !done.said.is_empty();
    match done.edited.as_ref().map(|edited| edited.whole) {
        None => parts.push("changed nothing".to_owned()),
        // Tools that take surfels away say how many.
        Some(Some(How::Kept)) if says_all => {}
        Some(Some(How::Kept)) => parts.push(format!("kept {n_after} of {n_before} surfels")),
        Some(Some(How::Derived)) => {
            parts.push(format!("made a cloud of {n_after} surfels, given {n_before}"));
        }
        Some(Some(How::Enlarged)) => {
            parts.push(format!("added {} surfels", n_after.saturating_sub(*n_before)));
        }
        Some(Some(How::Stroked) | None) => {}
    }
    if says_all {
        parts.push(done.said.clone());
    }
    // The range of a vector's numbers says little.
    for NewColumn { name, spread, components, .. } in columns {
        match spread {
            Some(Spread { min, max, mean, .. }) if *components == 1 => {
                parts.push(format!("{name} from {min:.6} to {max:.6}, mean {mean:.6}"));
            }
            _ if says_all => {}
            _ => parts.push(name.clone()),
        }
    }
    let cpu = cpu.map_or_else(String::new, |cpu| format!(" ({:.2} s CPU)", cpu.as_secs_f64()));
    let seconds = done.took.as_secs_f64();
    format!("{}: {}; {seconds:.2} s{cpu}", step.reference.id, parts.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_leave_out_what_is_not_finite() {
        let spread = Spread::of([1.0, f64::NAN, 3.0, f64::INFINITY].into_iter());
        let expected = Spread { min: 1.0, max: 3.0, mean: 2.0, n_not_finite: 2 };
        assert_eq!(spread, Some(expected));
        assert_eq!(Spread::of([f64::NAN].into_iter()), None);
    }
}
