//! The worker's state, and how failures of renderers are recorded.

use super::beside::Beside;
use super::refining_view::RefiningView;
use super::traced::{LeavingTracer, TracedView};
use crate::render_thread::cloud_upload::{CloudUpload, LARGE};
use crate::render_thread::command::{CommandQueue, RenderCommand};
use crate::render_thread::event::{EventSender, RenderEvent, UnitHealth};
use crate::render_thread::view_request::{ViewRequest, ViewSlot};
use anyhow::Context as _;
use std::collections::{HashMap, HashSet, VecDeque};
use std::path::PathBuf;
use std::time::Instant;
use surfelshop_api::View;
use surfelshop_api::params::{ParamKind, Value, Values};
use surfelshop_render::{RenderError, RendererView};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{
    Contents, CrashGuard, CrashMark, LoadedUnit, PluginHealth, Record, Registry, UnitRef,
    UnitState, Watcher,
};
use surfelshop_session::input::environment_map::Probes;
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::session;
use surfelshop_session::session::RenderSession;

/// The renderer of a slot.
pub(super) struct ActiveRenderer {
    pub(super) name: String,
    pub(super) reference: UnitRef,
    pub(super) unit: LoadedUnit,
    pub(super) view: RendererView,
    /// A file that names the unit until its first picture, so that a crash is attributed to it.
    pub(super) mark: Option<CrashMark>,
    /// Its last request.
    pub(super) request: ViewRequest,
    /// Renderers that draw some clouds beside it.
    pub(super) beside: Beside,
}

impl ActiveRenderer {
    /// Whether an error may come from a file that a parameter names: such errors never count as
    /// failures of the plugin.
    fn is_file_error(&self, error: &RenderError) -> bool {
        let refused =
            matches!(error, RenderError::Pass { .. } | RenderError::Plugin(Fault::Error(_)));
        refused && self.files().next().is_some()
    }

    /// The files that its parameters name.
    pub(super) fn files(&self) -> impl Iterator<Item = PathBuf> {
        files_of(&self.unit, &self.request.values)
    }
}

/// The files that parameters of a unit name.
pub(super) fn files_of(unit: &LoadedUnit, values: &Values) -> impl Iterator<Item = PathBuf> {
    let declared = unit.description.params.iter();
    let paths = declared.filter(|p| matches!(p.kind, ParamKind::File { .. }));
    paths.filter_map(|parameter| match values.get(&parameter.id)? {
        Value::Text(path) if !path.is_empty() => Some(PathBuf::from(path)),
        _ => None,
    })
}

/// The state of the render thread.
pub(in crate::render_thread) struct RenderWorker {
    pub(super) session: RenderSession,
    pub(super) device: DeviceArguments,
    pub(super) plugins: PluginFiles,
    pub(super) registry: Registry,
    pub(super) active: HashMap<ViewSlot, ActiveRenderer>,
    pub(super) health: PluginHealth,
    /// Renderers that the user has switched off after a crash.
    pub(super) avoided: Vec<String>,
    pub(super) crash_guard: Option<CrashGuard>,
    pub(super) probes: Probes,
    pub(super) events: EventSender,
    /// Watches plugin files and parameter files until the worker ends.
    pub(super) watcher: Option<Watcher>,
    /// The files of parameters that are watched.
    pub(super) watched_files: HashSet<PathBuf>,
    pub(super) queue: CommandQueue,
    pub(super) upload: CloudUpload,
    /// Requests that were drawn with a subset of a large cloud, or wait for its upload.
    pub(super) unfinished: HashMap<ViewSlot, ViewRequest>,
    /// The view of each slot's last picture of pyramids: where it goes tells which nodes come next.
    pub(super) last_views: HashMap<ViewSlot, View>,
    /// The pictures being refined, the next one first.
    pub(super) refining: VecDeque<RefiningView>,
    /// The slot of a picture at rest whose motion is not prepared yet.
    pub(super) unprepared: Option<ViewSlot>,
    /// Views that tracers draw.
    pub(super) traced: HashMap<ViewSlot, TracedView>,
    /// Tracers in memory, by name.
    pub(super) tracers: HashMap<String, LoadedUnit>,
    /// Tracers that were asked to stop and have not.
    pub(super) leaving: Vec<LeavingTracer>,
    /// When something in motion was drawn last.
    pub(super) moved: Option<Instant>,
    /// Frames drawn.
    pub(super) n_drawn: u64,
    /// When something was drawn or released last; none once unused memory has been freed since.
    pub(super) drawn: Option<Instant>,
}

/// Opens the device. The host keeps all columns of large clouds, since any may be requested later.
fn open(device: &DeviceArguments, plugins: &PluginFiles) -> anyhow::Result<RenderSession> {
    let device = DeviceArguments { small_blocks: true, ..device.clone() };
    let mut session = RenderSession::open(&device, plugins)?;
    session.engine.keep_whole_from(LARGE);
    session.engine.expect_edits(true);
    // The pointer reads what is seen, whoever drew it.
    session.engine.show_whole_depths(true);
    Ok(session)
}

impl RenderWorker {
    /// Opens the device; sends the reason and returns nothing where there is none.
    pub(in crate::render_thread) fn open(
        device: DeviceArguments,
        plugins: PluginFiles,
        events: EventSender,
        queue: &CommandQueue,
    ) -> Option<Self> {
        // The watcher starts before the scan, so that no change in between is missed.
        let changes = queue.clone();
        // Where the trust list cannot be read, the registry reports it below.
        let search = plugins.search().unwrap_or_default();
        let watcher = Watcher::start(&search, move |changed| {
            changes.add(RenderCommand::FileChanged(changed))
        });
        let opened = session::registry(&plugins)
            .and_then(|registry| open(&device, &plugins).map(|session| (session, registry)));
        match opened {
            Ok((session, registry)) => {
                let worker = Self {
                    session,
                    device,
                    plugins,
                    registry,
                    active: HashMap::new(),
                    health: PluginHealth::default(),
                    avoided: Vec::new(),
                    crash_guard: CrashGuard::of_user(),
                    probes: Probes::default(),
                    watched_files: HashSet::new(),
                    watcher: watcher
                        .map_err(|error| {
                            let line = format!("rebuilt plugins will not be noticed: {error}");
                            events.send(RenderEvent::Message(line));
                        })
                        .ok(),
                    events,
                    queue: queue.clone(),
                    upload: CloudUpload::default(),
                    unfinished: HashMap::new(),
                    last_views: HashMap::new(),
                    refining: VecDeque::new(),
                    unprepared: None,
                    traced: HashMap::new(),
                    tracers: HashMap::new(),
                    leaving: Vec::new(),
                    moved: None,
                    n_drawn: 0,
                    drawn: None,
                };
                worker.send_device();
                Some(worker)
            }
            Err(error) => {
                events.send(RenderEvent::NoDevice(format!("{error:#}")));
                None
            }
        }
    }

    fn send_device(&self) {
        let gpu = self.session.engine.gpu();
        let (adapter, software) = (gpu.describe(), gpu.is_software());
        self.events.send(RenderEvent::DeviceOpened { adapter, software });
    }

    /// Opens the device again after it was lost; the next picture uploads clouds and compiles shaders.
    fn reopen_device(&mut self) -> anyhow::Result<()> {
        self.session = open(&self.device, &self.plugins)
            .context("the graphics device was lost and cannot be opened again")?;
        // A running upload is for the lost device.
        self.upload.cancel();
        self.restart_refining();
        self.events.send(RenderEvent::UploadProgress(None));
        self.events
            .send(RenderEvent::Message("the graphics device was lost and opened again".to_owned()));
        self.send_device();
        Ok(())
    }

    /// Has all pictures refined from their first frame: the frames on the device are lost.
    fn restart_refining(&mut self) {
        self.refining.iter_mut().for_each(|refining| refining.n_frames = 0);
    }

    /// Records that a frame failed, and opens a lost device again.
    pub(super) fn record_fault<T>(
        &mut self,
        active: &ActiveRenderer,
        error: RenderError,
    ) -> anyhow::Result<T> {
        if matches!(error, RenderError::Stopped) {
            return Err(error.into());
        }
        if !active.is_file_error(&error) {
            let (unit, contents) = active.failed_by();
            self.record_failure(&unit, contents, &fault_of(&error));
        }
        if matches!(error, RenderError::DeviceLost(_)) {
            self.reopen_device()?;
        }
        Err(error.into())
    }

    /// Records a failure of a unit and sends all failures.
    pub(super) fn record_failure(&mut self, unit: &UnitRef, contents: Contents, fault: &Fault) {
        self.health.failed(unit, contents, fault);
        self.send_plugin_health();
    }

    /// Sends which units failed or are switched off.
    pub(super) fn send_plugin_health(&self) {
        let of = |record: &Record| UnitHealth {
            renderer: record.unit.id.clone(),
            text: record.to_string(),
            off: record.standing == UnitState::Off,
        };
        let mut all: Vec<UnitHealth> = self.health.records().iter().map(of).collect();
        all.extend(self.avoided.iter().map(|renderer| UnitHealth {
            renderer: renderer.clone(),
            text: "not used, since it was at work when the program crashed".to_owned(),
            off: true,
        }));
        self.events.send(RenderEvent::PluginHealth(all));
    }
}

/// The plugin's part in a failed frame. A lost device counts as a timeout: the renderer's next frame
/// would probably lose it again.
fn fault_of(error: &RenderError) -> Fault {
    match error {
        RenderError::Plugin(fault) => fault.clone(),
        RenderError::DeviceLost(_) => Fault::TimedOut(std::time::Duration::ZERO),
        RenderError::Overran { limit, .. } => Fault::TimedOut(*limit),
        RenderError::Graph(_) | RenderError::Pass { .. } | RenderError::NoOutput { .. } => {
            Fault::Error(error.to_string())
        }
        // The cloud and the host's own shaders are not the plugin's fault.
        _ => Fault::NotAsked(error.to_string()),
    }
}

/// Whether a picture was left because its view moved on.
pub(super) fn is_stopped(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref::<RenderError>(), Some(RenderError::Stopped))
}
