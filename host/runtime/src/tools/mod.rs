//! Runs tools: over a snapshot of a cloud, on threads of their own.
//!
//! Lifecycle: the thread makes an instance, which has as long as its [`Timeouts`] says; the tool
//! works as long as it needs, tells its progress and stages edits; when it returns, the edits are
//! committed whole to a new cloud, or dropped where it failed or was cancelled. The cloud it ran on
//! stays as it was in every case.
//!
//! A tool that is handled gets a [`CloudPart`], the surfels along a stroke, and what it makes of them is put into the
//! whole cloud. A stroke has a deadline besides: a hand waits for it.
//!
//! Invariants: nobody waits for a tool longer than its patience after it was asked to stop; what a
//! tool that does not stop holds (its thread, the threads of its loops, its device) is its own and
//! is left behind with it; what a loop computes does not depend on the number of threads.

mod device;
mod host_job;
mod pace;
mod progress;
#[cfg(test)]
mod tests;

use crate::boundary::Fault;
use crate::plugins::{LoadedUnit, Timeouts, on_own_thread};
use host_job::HostJob;
use progress::Shared;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Handling, HostInfo, Stroke, StrokeCall};
use surfelshop_cloud::files::return_to_folder;
use surfelshop_cloud::{AMONG_NOTE, Cloud, CloudPart, EditedCloud, StagedEdits, ToolRun};

pub use device::{DeviceOpener, ToolDevice};
pub use pace::Pace;
pub use progress::Progress;

/// The parameter that a stroke is noted as, besides those of its tool: JSON.
pub const STROKE_NOTE: &str = "stroke";

/// How a tool is run.
#[derive(Clone, Debug, Default)]
pub struct ToolOptions {
    /// How long to wait for the tool to start, and to stop once it was asked to.
    pub patience: Timeouts,
    /// Threads of the tool's loops; as many as the machine has where 0.
    pub threads: usize,
    /// The device for the tool's graphs, which is opened when the tool asks for the first time.
    pub device: DeviceOpener,
}

/// How a run ended.
#[derive(Clone, Debug)]
pub enum Ended {
    /// The tool did its work.
    Done(Box<Done>),
    /// It stopped, as it was asked to.
    Cancelled,
    /// It failed.
    Failed(Fault),
    /// It did not stop within this time after it was asked to, and was left behind.
    LeftBehind(Duration),
}

impl Ended {
    /// The fault that counts against the tool, where it is at fault.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        match self {
            Self::Done(_) | Self::Cancelled => None,
            Self::Failed(fault) => Some(fault.clone()),
            Self::LeftBehind(limit) => Some(Fault::TimedOut(*limit)),
        }
    }
}

/// What came of a run that ended well.
#[derive(Clone, Debug)]
pub struct Done {
    /// The cloud with all edits; `None` where the tool staged nothing.
    pub edited: Option<EditedCloud>,
    /// Every parameter with the value the tool ran with.
    pub values: Values,
    /// Time from the start to the end.
    pub took: Duration,
    /// The device its graphs ran on, where there were any.
    pub device: Option<String>,
    /// What the tool said of its result, on one line; empty where it said nothing.
    pub said: String,
}

/// A tool at work; dropping this asks it to stop and does not wait.
pub struct Running {
    shared: Arc<Shared>,
    answers: Receiver<Result<StagedEdits, Fault>>,
    patience: Timeouts,
    /// What the run is noted as, without its time.
    tool: String,
    version: String,
    values: Values,
    asked_to_stop: Option<Instant>,
    /// What it works on, where that is not all of a cloud.
    part: Option<CloudPart>,
    /// What the hand did.
    stroke: Option<Stroke>,
    /// Whether it took longer than a hand waits.
    is_late: bool,
}

impl fmt::Debug for Running {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Running").field("tool", &self.tool).finish_non_exhaustive()
    }
}

impl Running {
    /// Starts a tool over a cloud, which shares its columns with the caller's. Parameters that are
    /// missing or do not fit have their defaults. One that is handled is led over all of it.
    ///
    /// # Errors
    /// Where there is no thread for it.
    pub fn start(
        unit: &LoadedUnit,
        values: &Values,
        cloud: &Cloud,
        options: &ToolOptions,
    ) -> Result<Self, Fault> {
        if unit.description.handling == Handling::Cloud {
            return Self::begin(unit, values, (cloud, None, None), options);
        }
        let part = CloudPart::all(cloud).map_err(|error| Fault::NotAsked(error.to_string()))?;
        Self::start_on(unit, values, part, None, options)
    }

    /// Starts a tool over a part of a cloud: one that is handled with the stroke that the part lies along, and without
    /// one over all of the part; any other over what is selected.
    ///
    /// # Errors
    /// Where there is no thread for it.
    pub fn start_on(
        unit: &LoadedUnit,
        values: &Values,
        part: CloudPart,
        stroke: Option<Stroke>,
        options: &ToolOptions,
    ) -> Result<Self, Fault> {
        let cloud = part.cloud.clone();
        Self::begin(unit, values, (&cloud, Some(part), stroke), options)
    }

    fn begin(
        unit: &LoadedUnit,
        values: &Values,
        (cloud, part, stroke): (&Cloud, Option<CloudPart>, Option<Stroke>),
        options: &ToolOptions,
    ) -> Result<Self, Fault> {
        let declared = &unit.description.params;
        let values: Values =
            declared.iter().map(|p| (p.id.clone(), p.sanitise(values.get(&p.id)))).collect();
        let shared = Arc::new(Shared::new());
        let (answer, answers) = mpsc::channel();
        let options_given = options.clone();
        let (plugin, index, given) = (unit.plugin, unit.unit_index, values.clone());
        let (cloud, at_work) = (cloud.clone(), shared.clone());
        let is_handled = unit.description.handling != Handling::Cloud;
        let call = StrokeCall { values: given, stroke: stroke.clone().unwrap_or_default() };
        on_own_thread(move || {
            let version = env!("CARGO_PKG_VERSION").to_owned();
            let host = HostInfo { host_version: version, ..HostInfo::default() };
            let mut instance = match plugin.create(index, &host) {
                Ok(instance) => instance,
                Err(fault) => return drop(answer.send(Err(fault))),
            };
            let desk = HostJob::new(at_work, cloud.clone(), (options_given, plugin.is_sandboxed()));
            let ran = match is_handled {
                true => instance.run_stroke(&call, &cloud.view(), &desk),
                false => instance.run(&call.values, &cloud.view(), &desk),
            };
            desk.end();
            return_to_folder();
            // Nobody receives where the host stopped waiting. The instance ends after that: it may
            // take its time.
            drop(answer.send(ran.map(|()| desk.into_staged())));
        })?;
        Ok(Self {
            shared,
            answers,
            patience: options.patience,
            tool: format!("{}/{}", unit.manifest.id, unit.unit.id),
            version: unit.manifest.version.clone(),
            values,
            asked_to_stop: None,
            part,
            stroke,
            is_late: false,
        })
    }

    /// How far the tool is.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.shared.progress()
    }

    /// Asks the tool to stop.
    pub fn cancel(&mut self) {
        self.shared.cancel();
        self.asked_to_stop.get_or_insert_with(Instant::now);
    }

    /// Whether the tool was asked to stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.asked_to_stop.is_some()
    }

    /// Waits at most this long for the end; `None` where the tool is still at work. To be asked
    /// until it has an answer, which it gives once.
    pub fn wait(&mut self, at_most: Duration) -> Option<Ended> {
        // A hand waits for a stroke as long as it would for a picture.
        if self.stroke.is_some() && !self.is_late && self.shared.elapsed() > self.patience.frame {
            self.is_late = true;
            self.cancel();
        }
        let limit = match self.time_left() {
            Some(left) => at_most.min(left),
            None => at_most,
        };
        match self.answers.recv_timeout(limit) {
            Ok(Ok(_) | Err(Fault::Error(_))) if self.is_late => {
                Some(Ended::Failed(Fault::TimedOut(self.patience.frame)))
            }
            Ok(Ok(_)) if self.is_cancelled() => Some(Ended::Cancelled),
            Ok(Err(Fault::Error(_))) if self.is_cancelled() => Some(Ended::Cancelled),
            Ok(Ok(staged)) => Some(match self.done(staged) {
                Ok(done) => Ended::Done(Box::new(done)),
                Err(fault) => Ended::Failed(fault),
            }),
            Ok(Err(fault)) => Some(Ended::Failed(fault)),
            Err(RecvTimeoutError::Disconnected) => {
                Some(Ended::Failed(Fault::Misbehaved("it ended its thread".to_owned())))
            }
            Err(RecvTimeoutError::Timeout) if self.time_left() == Some(Duration::ZERO) => {
                Some(match self.asked_to_stop {
                    Some(_) => Ended::LeftBehind(self.patience.cancel),
                    None => Ended::Failed(Fault::TimedOut(self.patience.create)),
                })
            }
            Err(RecvTimeoutError::Timeout) => None,
        }
    }

    /// How long the tool has until it is left behind; `None` while it works.
    fn time_left(&self) -> Option<Duration> {
        let elapsed = self.shared.elapsed();
        let create = self.patience.create.saturating_sub(elapsed);
        match self.asked_to_stop {
            Some(asked) => Some(self.patience.cancel.saturating_sub(asked.elapsed())),
            None if self.shared.has_begun() => None,
            None => Some(create),
        }
    }

    fn done(&self, staged: StagedEdits) -> Result<Done, Fault> {
        let (tool, version) = (self.tool.clone(), self.version.clone());
        let mut noted = self.values.clone();
        if let Some(stroke) = &self.stroke {
            let text = serde_json::to_string(stroke);
            let text = text.map_err(|error| Fault::NotAsked(error.to_string()))?;
            noted.insert(STROKE_NOTE.to_owned(), Value::Text(text));
            if let Some(among) = self.part.as_ref().and_then(CloudPart::restriction) {
                noted.insert(AMONG_NOTE.to_owned(), Value::Text(among.into()));
            }
        }
        let made = ToolRun::new(tool, version, &noted, SystemTime::now());
        let edited = match (&self.part, staged.commit(made.clone())) {
            (Some(part), Some(edited)) => {
                let whole = part.put_back(&edited, made);
                Some(whole.map_err(|error| Fault::Misbehaved(error.to_string()))?)
            }
            (_, edited) => edited,
        };
        Ok(Done {
            edited,
            values: self.values.clone(),
            took: self.shared.took(),
            device: self.shared.device(),
            said: self.shared.conclusion(),
        })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shared.cancel();
    }
}
