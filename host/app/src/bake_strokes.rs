//! Strokes of a file, done again by `surfelshop bake`, and tools over what is selected.

use crate::arguments::BakeArguments;
use crate::bake::leaves_some;
use anyhow::{Context as _, anyhow, bail};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use surfelshop_cloud::selection::{Combine, Selection, SurfelRuns};
use surfelshop_cloud::{Cloud, CloudPart};
use surfelshop_runtime::tools::{Done, ToolOptions};
use surfelshop_session::input::strokes::{self, NamedStroke};
use surfelshop_session::options::select::select;
use surfelshop_session::output::terminal;
use surfelshop_session::tool_run::Step;

/// What was done along strokes.
pub(crate) struct Replayed {
    /// The last run, with the cloud after all.
    pub(crate) done: Done,
    pub(crate) n_strokes: usize,
    /// Surfels that they concerned, those of several strokes several times.
    pub(crate) n_concerned: u64,
}

/// The strokes of the file that was named, each with which of the tools it is of.
pub(crate) fn read(
    arguments: &BakeArguments,
    steps: &[Step],
) -> anyhow::Result<Vec<(usize, NamedStroke)>> {
    let Some(path) = &arguments.strokes else { return Ok(Vec::new()) };
    if let Some(step) = steps.iter().find(|step| !step.is_handled()) {
        bail!(
            "--strokes: `{}` is no interactive tool; run it with a `bake` of its own",
            step.reference.id
        );
    }
    let place = |(i, stroke): (usize, NamedStroke)| {
        let step =
            steps.iter().position(|step| stroke.is_of(&step.reference.package, &step.reference.id));
        let step = step.ok_or_else(|| {
            let (tool, file) = (&stroke.tool, path.display());
            anyhow!("{file}: stroke {i} is of `{tool}`, which is not used; add -t {tool}")
        })?;
        Ok((step, stroke))
    };
    strokes::read(path)?.into_iter().enumerate().map(place).collect()
}

/// Does strokes again, in their order.
pub(crate) fn replay(
    arguments: &BakeArguments,
    steps: &[Step],
    strokes: &[(usize, NamedStroke)],
    (cloud, options, stop): (&mut Cloud, &ToolOptions, &AtomicBool),
) -> anyhow::Result<Vec<Option<Replayed>>> {
    let mut replayed: Vec<Option<Replayed>> = steps.iter().map(|_| None).collect();
    let mut is_warned = false;
    for (i, (step, named)) in strokes.iter().enumerate() {
        let of = || format!("stroke {i} of {}", steps[*step].reference.id);
        let mut values = named
            .fitted(&steps[*step].unit.description.params)
            .map_err(anyhow::Error::msg)
            .with_context(of)?;
        // What is typed counts more than what the file says.
        values.extend(steps[*step].values.clone());
        let chosen = match arguments.select.is_empty() {
            true => None,
            false => {
                Some(select(cloud, &arguments.select, arguments.up.or_of([cloud.source()]).into())?)
            }
        };
        let part = CloudPart::along(cloud, &named.stroke, chosen.as_ref()).with_context(of)?;
        if part.rows.is_empty() {
            continue;
        }
        let is_other = named.n_surfels.is_some_and(|n| n != cloud.len() as u64);
        // One that left surfels out is refused instead.
        if is_other && named.among.is_none() && !is_warned {
            is_warned = true;
            warn_of_another(named, cloud);
        }
        let part = match &named.among {
            Some(among) => {
                let chosen = restricted(cloud, (named, among), chosen).with_context(of)?;
                CloudPart::along(cloud, &named.stroke, Some(&chosen)).with_context(of)?
            }
            None => part,
        };
        let n_concerned = part.rows.len() as u64;
        if n_concerned == 0 {
            continue;
        }
        let stroke = Some(named.stroke.clone());
        let done = steps[*step].run_on(&values, part, stroke, (options, stop)).with_context(of)?;
        if let Some(edited) = &done.edited {
            leaves_some(&steps[*step], cloud.len(), &edited.cloud)?;
            *cloud = edited.cloud.clone();
        }
        let so_far = &mut replayed[*step];
        let (n, all) = so_far.as_ref().map_or((0, 0), |r| (r.n_strokes, r.n_concerned));
        let mut done = done;
        if let Some(before) = so_far.take() {
            done.took += before.done.took;
            merge_columns(&mut done, before.done);
        }
        *so_far = Some(Replayed { done, n_strokes: n + 1, n_concerned: all + n_concerned });
    }
    Ok(replayed)
}

/// Says that a cloud is not the one that a stroke was led over.
fn warn_of_another(named: &NamedStroke, cloud: &Cloud) {
    let (n, found) = (named.n_surfels.unwrap_or_default(), cloud.len());
    terminal::warn(format!(
        "a stroke was led over a cloud of {n} surfels, and this one has {found}: the file says nothing of what else was done \
         to that cloud"
    ));
}

/// The surfels that a stroke is led over again, of those that were asked for, where it left others out.
fn restricted(
    cloud: &Cloud,
    (named, among): (&NamedStroke, &SurfelRuns),
    chosen: Option<Selection>,
) -> anyhow::Result<Selection> {
    let found = cloud.len();
    if let Some(n) = named.n_surfels.filter(|n| *n != found as u64) {
        bail!(
            "it left out surfels, by their numbers in a cloud of {n}, and this one has {found}; first do what was done \
             before it, such as deleting"
        );
    }
    let among = among.selection(found)?;
    match chosen {
        Some(chosen) => Ok(chosen.combined(&among, Combine::Intersect)?),
        None => Ok(among),
    }
}

/// What strokes before made is still there.
fn merge_columns(done: &mut Done, before: Done) {
    let Some(before) = before.edited else { return };
    match &mut done.edited {
        Some(edited) => {
            let more = before.columns.into_iter().filter(|name| !edited.columns.contains(name));
            let more: Vec<String> = more.collect();
            edited.columns.extend(more);
        }
        none => *none = Some(before),
    }
}

/// Runs a tool over what is selected alone.
pub(crate) fn run_selected(
    arguments: &BakeArguments,
    step: &Step,
    (cloud, options, stop): (&Cloud, &ToolOptions, &AtomicBool),
) -> anyhow::Result<(Done, Option<Duration>)> {
    let chosen = select(cloud, &arguments.select, arguments.up.or_of([cloud.source()]).into())?;
    let part = CloudPart::selected(cloud, &chosen)?;
    Ok((step.run_on(&step.values, part, None, (options, stop))?, None))
}
