//! Tools: a tool runs on a thread of its own over one cloud, and its result is an edit of the clouds.

use super::unit_loader::{Readiness, UnitLoader, mark_in_use};
use crate::document::{OpenClouds, generations};
use crate::render_thread::mark_abandoned;
use crate::views::messages::Messages;
use eframe::egui::Context;
use std::collections::HashMap;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::columns::AO;
use surfelshop_api::params::Values;
use surfelshop_cloud::{Cloud, How};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{Contents, CrashMark, Registry, UnitRef, UnitState};
use surfelshop_runtime::tools::{Done, Ended, Progress, Running, ToolOptions};
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::session;

/// Time between two checks of a running tool.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

/// The state of tools.
pub(crate) struct Tools {
    options: ToolOptions,
    /// The tool whose window is open, as [`Registry::names`] calls it.
    pub(crate) open: Option<String>,
    /// Parameter values by tool, without those at their default.
    pub(crate) values: HashMap<String, Values>,
    /// The index of the cloud to edit.
    pub(crate) cloud_index: usize,
    pub(crate) units: UnitLoader,
    run: Option<ToolRun>,
}

/// What a tool made of the clouds.
pub(crate) struct ToolEdit {
    pub(crate) clouds: OpenClouds,
    /// A column that pictures hardly show as they are, so that it colours the surfels.
    pub(crate) colors_by: Option<&'static str>,
}

/// A running tool.
struct ToolRun {
    name: String,
    reference: UnitRef,
    contents: Contents,
    process: Running,
    cloud_index: usize,
    /// The cloud before the run.
    base: Cloud,
    /// A file that names the tool while it runs, so that a crash is attributed to it.
    _mark: Option<CrashMark>,
}

impl Tools {
    pub(crate) fn new(device: &DeviceArguments, plugins: &PluginFiles) -> Self {
        let device = session::gpu_options(device);
        Self {
            options: ToolOptions {
                patience: plugins.patience(),
                device: device.into(),
                threads: 0,
            },
            open: None,
            values: HashMap::new(),
            cloud_index: 0,
            units: UnitLoader::new(UnitKind::Tool, plugins.patience()),
            run: None,
        }
    }

    /// How tools are run.
    pub(crate) fn options(&self) -> &ToolOptions {
        &self.options
    }

    /// The running tool, its progress, and whether it was cancelled.
    pub(crate) fn running(&self) -> Option<(&str, Progress, bool)> {
        let run = self.run.as_ref()?;
        Some((&run.name, run.process.progress(), run.process.is_cancelled()))
    }

    /// Starts a tool on the chosen cloud.
    pub(crate) fn run(
        &mut self,
        registry: &Registry,
        open_clouds: &OpenClouds,
        name: &str,
    ) -> Result<(), String> {
        let reference = registry.find(UnitKind::Tool, name).map_err(|error| error.to_string())?;
        self.units.health.check(&reference).map_err(|refusal| refusal.to_string())?;
        let (Readiness::Ready(unit), None) = (self.units.readiness(name), &self.run) else {
            return Err(format!("{name} cannot run now"));
        };
        let open_cloud =
            open_clouds.all().get(self.cloud_index).ok_or("there is no cloud to work on")?;
        let base = open_cloud.loaded.cloud.clone();
        if open_clouds.clouds.pyramid_of(&base).is_some() {
            return Err(format!(
                "{name} works on clouds in memory, and {} is a pyramid: `surfelshop bake` makes another one of \
                 it, or open the files that it was made of",
                open_cloud.name()
            ));
        }
        let values = self.values.get(name).cloned().unwrap_or_default();
        let process = Running::start(unit, &values, &base, &self.options)
            .map_err(|fault| format!("{reference} could not start: {fault}"))?;
        let (name, contents, cloud_index) = (name.to_owned(), unit.contents, self.cloud_index);
        let mark = mark_in_use(&reference);
        self.run =
            Some(ToolRun { name, reference, contents, process, cloud_index, base, _mark: mark });
        Ok(())
    }

    /// Cancels the running tool.
    pub(crate) fn cancel(&mut self) {
        if let Some(run) = &mut self.run {
            run.process.cancel();
        }
    }

    /// Checks the running tool; returns the edited clouds once it has ended with an edit.
    pub(crate) fn advance(
        &mut self,
        ctx: &Context,
        open_clouds: Option<&OpenClouds>,
        messages: &mut Messages,
    ) -> Option<ToolEdit> {
        let run = self.run.as_mut()?;
        let Some(ended) = run.process.wait(Duration::ZERO) else {
            ctx.request_repaint_after(POLL_INTERVAL);
            return None;
        };
        let run = self.run.take()?;
        match ended.fault() {
            Some(fault) => self.failed(&run, &fault),
            None => self.units.health.succeeded(&run.reference, run.contents),
        }
        match ended {
            Ended::Done(done) => return commit(&run, *done, open_clouds, messages),
            Ended::Cancelled => {
                messages.report(format!("{} was cancelled; nothing was changed", run.name));
            }
            Ended::Failed(fault) => {
                messages.warn(format!("{} failed, nothing was changed: {fault}", run.reference));
            }
            Ended::LeftBehind(limit) => {
                mark_abandoned();
                messages.warn(format!(
                    "{} did not stop within {} s; it was left behind and is switched off, and \
                     nothing was changed",
                    run.reference,
                    limit.as_secs_f64()
                ));
            }
        }
        None
    }

    fn failed(&mut self, run: &ToolRun, fault: &Fault) {
        if self.units.health.failed(&run.reference, run.contents, fault) == UnitState::Off {
            self.units.unload(&run.name);
        }
    }
}

impl Drop for Tools {
    /// A running tool may still use the graphics driver when the program ends.
    fn drop(&mut self) {
        if self.run.is_some() {
            mark_abandoned();
        }
    }
}

/// The clouds after a run, which is reported in one line.
fn commit(
    run: &ToolRun,
    done: Done,
    open_clouds: Option<&OpenClouds>,
    messages: &mut Messages,
) -> Option<ToolEdit> {
    let (name, took) = (&run.name, done.took.as_secs_f64());
    let said = if done.said.is_empty() { String::new() } else { format!(" ({})", done.said) };
    let Some(edited) = done.edited else {
        messages.report(format!("{name} found nothing to change, in {took:.1} s{said}"));
        return None;
    };
    let open_cloud = open_clouds.and_then(|open_clouds| open_clouds.all().get(run.cloud_index));
    let is_same = |cloud: &Cloud| generations(cloud) == generations(&run.base);
    let (Some(open_clouds), Some(open_cloud)) =
        (open_clouds, open_cloud.filter(|open_cloud| is_same(&open_cloud.loaded.cloud)))
    else {
        messages.warn(format!(
            "{name} is done, but its cloud was changed or closed meanwhile; its result was dropped"
        ));
        return None;
    };
    let (columns, cloud) = (edited.columns.join(", "), open_cloud.name());
    let (n_now, n_before) = (edited.cloud.len(), run.base.len());
    if n_now == 0 && n_before > 0 {
        messages.warn(format!(
            "{name} leaves no surfel of {cloud}, and was undone; a cloud cannot be without any"
        ));
        return None;
    }
    let colors_by = (edited.columns.iter().any(|column| column == AO)).then_some(AO);
    let shown = match colors_by {
        Some(column) => format!("; {column} colours the surfels now"),
        None => String::new(),
    };
    messages.report(match edited.whole {
        None | Some(How::Stroked) => {
            format!("{name} made {columns} of {cloud} in {took:.1} s{said}{shown}")
        }
        Some(How::Enlarged) => {
            let more = n_now.saturating_sub(n_before);
            format!("{name} added {more} surfels to {cloud} in {took:.1} s{said}")
        }
        Some(How::Kept) => {
            format!("{name} kept {n_now} of {n_before} surfels of {cloud} in {took:.1} s{said}")
        }
        Some(How::Derived) => format!(
            "{name} made a cloud of {n_now} surfels, given {n_before}, in {took:.1} s; {cloud} is \
             hidden now, the list of clouds shows it again{said}"
        ),
    });
    let clouds = match edited.whole {
        Some(How::Derived) => open_clouds.derived(run.cloud_index, edited.cloud, name),
        _ => open_clouds.edited(run.cloud_index, edited.cloud),
    };
    Some(ToolEdit { clouds, colors_by })
}
