//! Runs tools: over a snapshot of a cloud, on threads of their own.
//!
//! Lifecycle: the thread makes an instance, which has as long as its [`Timeouts`] says; the tool
//! works as long as it needs, tells its progress and stages edits; when it returns, the edits are
//! committed whole to a new cloud, or dropped where it failed or was cancelled. The cloud it ran on
//! stays as it was in every case.
//!
//! Invariants: nobody waits for a tool longer than its patience after it was asked to stop; what a
//! tool that does not stop holds (its thread, the threads of its loops, its device) is its own and
//! is left behind with it; what a loop computes does not depend on the number of threads.

mod device;
mod host_job;
mod pace;
mod progress;

use crate::boundary::Fault;
use crate::plugins::{LoadedUnit, Timeouts, on_own_thread};
use host_job::HostJob;
use progress::Shared;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::time::{Duration, Instant, SystemTime};
use surfelshop_api::HostInfo;
use surfelshop_api::params::Values;
use surfelshop_cloud::files::return_to_folder;
use surfelshop_cloud::{Cloud, EditedCloud, StagedEdits, ToolRun};

pub use device::{DeviceOpener, ToolDevice};
pub use pace::Pace;
pub use progress::Progress;

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
}

impl fmt::Debug for Running {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Running").field("tool", &self.tool).finish_non_exhaustive()
    }
}

impl Running {
    /// Starts a tool over a cloud, which shares its columns with the caller's. Parameters that are
    /// missing or do not fit have their defaults.
    ///
    /// # Errors
    /// Where there is no thread for it.
    pub fn start(
        unit: &LoadedUnit,
        values: &Values,
        cloud: &Cloud,
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
        on_own_thread(move || {
            let version = env!("CARGO_PKG_VERSION").to_owned();
            let host = HostInfo { host_version: version, ..HostInfo::default() };
            let mut instance = match plugin.create(index, &host) {
                Ok(instance) => instance,
                Err(fault) => return drop(answer.send(Err(fault))),
            };
            let desk = HostJob::new(at_work, cloud.clone(), options_given);
            let ran = instance.run(&given, &cloud.view(), &desk);
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
        let limit = match self.time_left() {
            Some(left) => at_most.min(left),
            None => at_most,
        };
        match self.answers.recv_timeout(limit) {
            Ok(Ok(_)) if self.is_cancelled() => Some(Ended::Cancelled),
            Ok(Err(Fault::Error(_))) if self.is_cancelled() => Some(Ended::Cancelled),
            Ok(Ok(staged)) => Some(Ended::Done(Box::new(self.done(staged)))),
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

    fn done(&self, staged: StagedEdits) -> Done {
        let (tool, version) = (self.tool.clone(), self.version.clone());
        let made = ToolRun::new(tool, version, &self.values, SystemTime::now());
        Done {
            edited: staged.commit(made),
            values: self.values.clone(),
            took: self.shared.took(),
            device: self.shared.device(),
            said: self.shared.conclusion(),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.shared.cancel();
    }
}
