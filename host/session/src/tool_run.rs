//! Tools over a cloud, without a window: found, run to their end, and stopped when the user says so.

use crate::cpu_time::cpu_time;
use crate::input::scenes::{Inputs, Source};
use crate::output::terminal::Progress;
use anyhow::{anyhow, bail};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use surfelshop_api::params::Values;
use surfelshop_api::{Handling, Stroke};
use surfelshop_cloud::{Cloud, CloudPart};
use surfelshop_runtime::plugins::{LoadedUnit, UnitRef};
use surfelshop_runtime::tools::{self, Done, Ended, Running, ToolOptions};

/// How often the bar and the wish to stop are looked at.
const TICK: Duration = Duration::from_millis(50);

/// A tool with the parameters it is to run with.
pub struct Step {
    /// The unit as it was named.
    pub reference: UnitRef,
    /// The unit, loaded.
    pub unit: LoadedUnit,
    /// Its parameters.
    pub values: Values,
}

/// The one cloud of a file or scene.
pub fn source(file: &Path) -> anyhow::Result<Source> {
    let mut sources = Inputs::open(std::slice::from_ref(&file.to_owned()))?.sources;
    match (sources.pop(), sources.len()) {
        (Some(source), 0) => Ok(source),
        (last, n_others) => bail!(
            "{}: expected a scene that shows one cloud, found {}; name the cloud's own file",
            file.display(),
            n_others + usize::from(last.is_some())
        ),
    }
}

/// A tool that did not stop when it was asked to.
#[derive(Debug)]
pub struct LeftBehind(String);

impl std::fmt::Display for LeftBehind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for LeftBehind {}

impl Step {
    /// Runs the tool to its end: what it did, and the CPU time it took where the system tells.
    pub fn run(
        &self,
        cloud: &Cloud,
        options: &ToolOptions,
        stop: &AtomicBool,
    ) -> anyhow::Result<(Done, Option<Duration>)> {
        let progress = Progress::new(self.reference.id.clone());
        self.run_telling(cloud, options, stop, &|now| progress.tell_tool(now))
    }

    /// The same with a bar of another's: `tell` is told how far it is.
    pub fn run_telling(
        &self,
        cloud: &Cloud,
        options: &ToolOptions,
        stop: &AtomicBool,
        tell: &dyn Fn(&tools::Progress),
    ) -> anyhow::Result<(Done, Option<Duration>)> {
        let Self { reference, unit, values } = self;
        let running = Running::start(unit, values, cloud, options)
            .map_err(|fault| anyhow!("{reference} could not start: {fault}"))?;
        self.ended(running, stop, tell)
    }

    /// Whether the tool is led by hand.
    pub fn is_handled(&self) -> bool {
        self.unit.description.handling != Handling::Cloud
    }

    /// Runs the tool over a part of a cloud, along a stroke where it is led by hand.
    pub fn run_on(
        &self,
        values: &Values,
        part: CloudPart,
        stroke: Option<Stroke>,
        (options, stop): (&ToolOptions, &AtomicBool),
    ) -> anyhow::Result<Done> {
        let Self { reference, unit, .. } = self;
        let running = Running::start_on(unit, values, part, stroke, options)
            .map_err(|fault| anyhow!("{reference} could not start: {fault}"))?;
        Ok(self.ended(running, stop, &|_| {})?.0)
    }

    /// Waits for the end of a run.
    fn ended(
        &self,
        mut running: Running,
        stop: &AtomicBool,
        tell: &dyn Fn(&tools::Progress),
    ) -> anyhow::Result<(Done, Option<Duration>)> {
        let (reference, cpu) = (&self.reference, cpu_time());
        tracing::debug!("running {reference}");
        loop {
            if stop.load(Ordering::Relaxed) {
                running.cancel();
            }
            match running.wait(TICK) {
                None => tell(&running.progress()),
                Some(Ended::Done(done)) => {
                    let cpu = cpu_time().zip(cpu).map(|(now, then)| now.saturating_sub(then));
                    return Ok((*done, cpu));
                }
                Some(Ended::Cancelled) => bail!("{reference} was cancelled"),
                Some(Ended::Failed(fault)) => bail!("{reference} failed: {fault}"),
                Some(Ended::LeftBehind(limit)) => bail!(LeftBehind(format!(
                    "{reference} did not stop within {} s and was left behind",
                    limit.as_secs_f64()
                ))),
            }
        }
    }
}
