//! Tools at work in the window: loaded on threads of their own, run over one cloud at a time, and
//! what comes of it.

use super::darkroom;
use super::messages::Messages;
use super::shelf::{Readiness, Shelf, mark};
use super::stock::{Stock, generations};
use crate::arguments::{DeviceArguments, PluginFiles};
use crate::studio;
use eframe::egui::Context;
use std::collections::HashMap;
use std::time::Duration;
use surfelshop_api::UnitKind;
use surfelshop_api::abi::host_side::Fault;
use surfelshop_api::params::Values;
use surfelshop_cloud::{Cloud, How};
use surfelshop_engine::plugins::{Contents, Mark, Registry, Standing, UnitRef};
use surfelshop_engine::tools::{Done, Ended, Progress, Running, ToolOptions};

/// Time between two looks at a tool that works.
const TICK: Duration = Duration::from_millis(100);

/// Everything about tools.
pub(crate) struct Tools {
    options: ToolOptions,
    /// The tool whose window is open, as [`Registry::names`] calls it.
    pub(crate) open: Option<String>,
    /// Parameters by tool, those at their default left out.
    pub(crate) values: HashMap<String, Values>,
    /// The cloud to work on.
    pub(crate) item: usize,
    pub(crate) shelf: Shelf,
    work: Option<Work>,
}

/// A tool at work.
struct Work {
    name: String,
    reference: UnitRef,
    contents: Contents,
    running: Running,
    item: usize,
    /// The cloud it works on, as it was.
    base: Cloud,
    /// Says in a file that the tool is at work.
    _mark: Option<Mark>,
}

impl Tools {
    pub(crate) fn new(device: &DeviceArguments, plugins: &PluginFiles) -> Self {
        let device = studio::gpu_options(device);
        Self {
            options: ToolOptions { patience: plugins.patience(), device, threads: 0 },
            open: None,
            values: HashMap::new(),
            item: 0,
            shelf: Shelf::new(UnitKind::Tool, plugins.patience()),
            work: None,
        }
    }

    /// The tool at work and how far it is.
    pub(crate) fn at_work(&self) -> Option<(&str, Progress, bool)> {
        let work = self.work.as_ref()?;
        Some((&work.name, work.running.progress(), work.running.is_cancelled()))
    }

    /// Starts a tool over one of the clouds.
    pub(crate) fn run(
        &mut self,
        registry: &Registry,
        stock: &Stock,
        name: &str,
    ) -> Result<(), String> {
        let reference = registry.find(UnitKind::Tool, name).map_err(|error| error.to_string())?;
        self.shelf.conduct.check(&reference).map_err(|barred| barred.to_string())?;
        let (Readiness::Ready(unit), None) = (self.shelf.readiness(name), &self.work) else {
            return Err(format!("{name} cannot run now"));
        };
        let item = stock.items().get(self.item).ok_or("there is no cloud to work on")?;
        let base = item.loaded.cloud.clone();
        let values = self.values.get(name).cloned().unwrap_or_default();
        let running = Running::start(unit, &values, &base, &self.options)
            .map_err(|fault| format!("{reference} could not start: {fault}"))?;
        let (name, contents, item) = (name.to_owned(), unit.contents, self.item);
        let mark = mark(&reference);
        self.work = Some(Work { name, reference, contents, running, item, base, _mark: mark });
        Ok(())
    }

    /// Asks the tool at work to stop.
    pub(crate) fn cancel(&mut self) {
        if let Some(work) = &mut self.work {
            work.running.cancel();
        }
    }

    /// Looks at the tool at work; returns the clouds after its edit, where it has done one.
    pub(crate) fn go_on(
        &mut self,
        ctx: &Context,
        stock: Option<&Stock>,
        messages: &mut Messages,
    ) -> Option<Stock> {
        let work = self.work.as_mut()?;
        let Some(ended) = work.running.wait(Duration::ZERO) else {
            ctx.request_repaint_after(TICK);
            return None;
        };
        let work = self.work.take()?;
        match ended.fault() {
            Some(fault) => self.failed(&work, &fault),
            None => self.shelf.conduct.succeeded(&work.reference, work.contents),
        }
        match ended {
            Ended::Done(done) => return commit(&work, *done, stock, messages),
            Ended::Cancelled => {
                messages.tell(format!("{} was cancelled; nothing was changed", work.name));
            }
            Ended::Failed(fault) => {
                messages.warn(format!("{} failed, nothing was changed: {fault}", work.reference));
            }
            Ended::LeftBehind(limit) => {
                darkroom::abandon();
                messages.warn(format!(
                    "{} did not stop within {} s; it was left behind and is switched off, and \
                     nothing was changed",
                    work.reference,
                    limit.as_secs_f64()
                ));
            }
        }
        None
    }

    fn failed(&mut self, work: &Work, fault: &Fault) {
        if self.shelf.conduct.failed(&work.reference, work.contents, fault) == Standing::Off {
            self.shelf.put_away(&work.name);
        }
    }
}

impl Drop for Tools {
    /// A tool that still works would have its graphics driver taken from under it.
    fn drop(&mut self) {
        if self.work.is_some() {
            darkroom::abandon();
        }
    }
}

/// The clouds after a run, and a line that says what it did.
fn commit(
    work: &Work,
    done: Done,
    stock: Option<&Stock>,
    messages: &mut Messages,
) -> Option<Stock> {
    let (name, took) = (&work.name, done.took.as_secs_f64());
    let said = if done.said.is_empty() { String::new() } else { format!(" ({})", done.said) };
    let Some(edited) = done.edited else {
        messages.tell(format!("{name} found nothing to change, in {took:.1} s{said}"));
        return None;
    };
    let item = stock.and_then(|stock| stock.items().get(work.item));
    let is_same = |cloud: &Cloud| generations(cloud) == generations(&work.base);
    let (Some(stock), Some(item)) = (stock, item.filter(|item| is_same(&item.loaded.cloud))) else {
        messages.warn(format!(
            "{name} is done, but its cloud was changed or closed meanwhile; its result was dropped"
        ));
        return None;
    };
    let (columns, cloud) = (edited.columns.join(", "), item.name());
    let (n_now, n_before) = (edited.cloud.len(), work.base.len());
    messages.tell(match edited.whole {
        None => format!("{name} made {columns} of {cloud} in {took:.1} s{said}"),
        Some(How::Kept) => {
            format!("{name} kept {n_now} of {n_before} surfels of {cloud} in {took:.1} s{said}")
        }
        Some(How::Derived) => format!(
            "{name} made a cloud of {n_now} surfels from {n_before} in {took:.1} s; {cloud} is \
             hidden now, the list of clouds shows it again{said}"
        ),
    });
    Some(match edited.whole {
        Some(How::Derived) => stock.derived(work.item, edited.cloud, name),
        _ => stock.edited(work.item, edited.cloud),
    })
}
