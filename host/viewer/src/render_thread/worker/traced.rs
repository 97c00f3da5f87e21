//! Tracers in views: a picture is traced in the background while nothing moves, and shown as it gets better.
//!
//! A renderer stands in for the tracer: its picture is shown while something moves, and behind tiles that are not
//! traced yet. Exported and measured pictures are sent once all of them is traced.

use super::state::{RenderWorker, files_of};
use crate::render_thread::command::RenderCommand;
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::{RenderedView, TracedState, ViewReply};
use crate::render_thread::view_request::{EXPORT_SLOT, ViewRequest, ViewSlot};
use anyhow::{anyhow, ensure};
use std::path::PathBuf;
use std::time::Instant;
use surfelshop_api::UnitKind;
use surfelshop_api::graph::Output;
use surfelshop_image::{Image, outputs};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{Contents, CrashMark, LoadedUnit, UnitRef};
use surfelshop_runtime::trace::Tracing;
use surfelshop_session::render::traced;

/// The renderer that stands in where none was used before.
const USUAL: &str = "ewa-phong";

/// A view that a tracer draws.
pub(super) struct TracedView {
    /// What was asked for.
    pub(super) request: ViewRequest,
    pub(super) reference: UnitRef,
    unit: LoadedUnit,
    /// None once all is traced.
    tracing: Option<Tracing>,
    /// The stand-in's picture.
    behind: Option<RenderedView>,
    /// A file that names the unit while it works, so that a crash is attributed to it.
    _mark: Option<CrashMark>,
    started: Instant,
}

/// A tracer that was asked to stop.
pub(super) struct LeavingTracer {
    tracing: Tracing,
    since: Instant,
    reference: UnitRef,
    contents: Contents,
}

impl RenderWorker {
    /// The tracer of a name that no renderer has.
    pub(super) fn tracer_of(&self, name: &str) -> Option<UnitRef> {
        match self.registry.find(UnitKind::Renderer, name) {
            Ok(_) => None,
            Err(_) => self.registry.find(UnitKind::Tracer, name).ok(),
        }
    }

    /// Whether a picture is only sent when all of it is there.
    pub(super) fn is_sent_whole(slot: ViewSlot, request: &ViewRequest) -> bool {
        request.for_measurement || slot == EXPORT_SLOT
    }

    /// The same request for the renderer that stands in: the last one of the slot, or the usual one.
    pub(super) fn stand_in(&self, slot: ViewSlot, request: &ViewRequest) -> ViewRequest {
        let last = self
            .active
            .get(&slot)
            .filter(|active| self.registry.suits(&active.name, &request.clouds.facts.clouds));
        let (renderer, values) = match last {
            Some(active) => (active.name.clone(), active.request.values.clone()),
            None => {
                let suited = self.registry.suited(&request.clouds.facts.clouds);
                let suited = suited.map(|unit| self.registry.name(&unit));
                (suited.unwrap_or_else(|| USUAL.to_owned()), Default::default())
            }
        };
        ViewRequest { renderer, values, ..request.clone() }
    }

    /// Marks a stand-in's picture, and starts to trace where nothing moves. Without a picture the tracer starts with
    /// nothing.
    pub(super) fn start_tracing(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
        tracer: UnitRef,
        stand_in: anyhow::Result<RenderedView>,
    ) -> Option<anyhow::Result<RenderedView>> {
        let behind = stand_in.ok().map(|mut rendered| {
            let name = self.active.get(&slot).map(|active| active.name.clone());
            rendered.traced = Some(TracedState { stand_in: name, ..TracedState::default() });
            rendered.refines = true;
            rendered.explained = None;
            rendered
        });
        if request.in_motion {
            self.moved = Some(Instant::now());
            return Some(behind.ok_or_else(|| anyhow!("no renderer can stand in for the tracer")));
        }
        match self.trace(slot, request, tracer, behind.clone()) {
            Ok(()) => behind.map(Ok),
            Err(error) => Some(Err(error)),
        }
    }

    /// Traces a picture; its replies come as commands.
    fn trace(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
        reference: UnitRef,
        behind: Option<RenderedView>,
    ) -> anyhow::Result<()> {
        self.health.check(&reference)?;
        ensure!(
            !self.avoided.contains(&reference.id),
            "{reference} was at work when the program crashed; the plugin list switches it on"
        );
        let mark = self.crash_guard.as_ref().and_then(|guard| guard.leave(&reference).ok());
        let unit = self.load_tracer(slot, &request.renderer, &reference)?;
        let light = self.environment_light(request);
        let view = request.detail.view(request.view);
        let mut order = traced::order(
            &unit,
            &request.values,
            &request.clouds,
            &request.scene,
            light.as_ref(),
            view,
        );
        // One is left to the window.
        let available = std::thread::available_parallelism().map_or(1, usize::from);
        order.threads = available.saturating_sub(1).max(1);
        let (queue, serial) = (self.queue.clone(), request.serial);
        let notice = move || queue.add(RenderCommand::TraceProgress(slot, serial));
        let tracing = Tracing::start(&unit, order, notice).map_err(|fault| anyhow!("{fault}"))?;
        let view = TracedView {
            request: request.clone(),
            reference,
            unit,
            tracing: Some(tracing),
            behind,
            _mark: mark,
            started: Instant::now(),
        };
        self.watch_files(view.files());
        self.traced.insert(slot, view);
        Ok(())
    }

    /// A tracer in memory; says what its parameters are when it is loaded.
    fn load_tracer(
        &mut self,
        slot: ViewSlot,
        name: &str,
        reference: &UnitRef,
    ) -> anyhow::Result<LoadedUnit> {
        if let Some(unit) = self.tracers.get(name) {
            return Ok(unit.clone());
        }
        self.events.send(RenderEvent::Preparing { slot, renderer: name.to_owned() });
        let unit = match reference.load(&self.plugins.patience()) {
            Ok(unit) => unit,
            Err(error) => {
                if let Some(fault) = error.fault() {
                    self.record_failure(reference, Contents::of_file(&reference.path), fault);
                }
                return Err(error.into());
            }
        };
        let parameters = unit.description.params.clone();
        self.events.send(RenderEvent::Declared { renderer: name.to_owned(), parameters });
        self.tracers.insert(name.to_owned(), unit.clone());
        Ok(unit)
    }

    /// Traces a picture that is sent once all of it is there.
    pub(super) fn trace_whole(&mut self, slot: ViewSlot, request: ViewRequest, tracer: UnitRef) {
        if let Err(error) = self.trace(slot, &request, tracer, None) {
            self.reply(slot, &request, Err(format!("{error:#}")));
        }
    }

    /// Shows what is traced so far.
    pub(super) fn show_traced(&mut self, slot: ViewSlot, serial: u64) {
        self.see_off_tracers();
        let Some(view) = self.traced.get(&slot).filter(|view| view.request.serial == serial) else {
            return;
        };
        let Some(tracing) = &view.tracing else { return };
        if let Some(fault) = tracing.take_fault() {
            let (reference, contents) = (view.reference.clone(), view.unit.contents);
            let request = view.request.clone();
            self.stop_tracing(slot);
            self.record_failure(&reference, contents, &fault);
            return self.reply(slot, &request, Err(format!("{reference}: {fault}")));
        }
        let picture = if tracing.is_over() { tracing.picture() } else { None };
        let (is_done, request) = (picture.is_some(), view.request.clone());
        if Self::is_sent_whole(slot, &request) && !is_done {
            return;
        }
        let rendered = match picture {
            Some(picture) => view.rendered(tracing, picture.color, true),
            None => {
                let [width, height] = request.detail.view(request.view).size_px;
                let empty = || vec![0.0; 4 * width as usize * height as usize];
                let four =
                    |behind: &RenderedView| outputs::four_components(&Output::Color, &behind.color);
                let empty = || Image { width, height, components: 4, data: empty() };
                let mut color = view.behind.as_ref().map_or_else(empty, four);
                tracing.put_over(&mut color);
                view.rendered(tracing, color, false)
            }
        };
        if is_done {
            let (reference, contents) = (view.reference.clone(), view.unit.contents);
            self.health.succeeded(&reference, contents);
            if let Some(view) = self.traced.get_mut(&slot) {
                (view.tracing, view.behind, view._mark) = (None, None, None);
            }
        }
        self.reply(slot, &request, Ok(rendered));
    }

    fn reply(&self, slot: ViewSlot, request: &ViewRequest, outcome: Result<RenderedView, String>) {
        let (serial, renderer) = (request.serial, request.renderer.clone());
        let reply = ViewReply { slot, serial, renderer, outcome };
        self.events.send(RenderEvent::Reply(Box::new(reply)));
    }

    /// Stops to trace the picture of a slot.
    pub(super) fn stop_tracing(&mut self, slot: ViewSlot) {
        self.see_off_tracers();
        let Some(TracedView { tracing, reference, unit, .. }) = self.traced.remove(&slot) else {
            return;
        };
        if let Some(mut tracing) = tracing {
            let (since, contents) = (tracing.stop(), unit.contents);
            self.leaving.push(LeavingTracer { tracing, since, reference, contents });
        }
    }

    /// Forgets tracers that have stopped, and counts those that do not as failures.
    fn see_off_tracers(&mut self) {
        self.leaving.retain(|leaving| !leaving.tracing.is_over());
        let patience = self.plugins.patience().cancel;
        let is_late = |leaving: &LeavingTracer| leaving.since.elapsed() > patience;
        while let Some(late) = self.leaving.iter().position(is_late) {
            let LeavingTracer { reference, contents, .. } = self.leaving.swap_remove(late);
            self.record_failure(&reference, contents, &Fault::TimedOut(patience));
        }
    }

    /// Draws the views of tracers of a changed file again.
    pub(super) fn trace_again(&mut self, is_affected: impl Fn(&TracedView) -> bool) {
        let affected = self.traced.iter().filter(|(_, view)| is_affected(view));
        let affected: Vec<(ViewSlot, ViewRequest)> =
            affected.map(|(slot, view)| (*slot, view.request.clone())).collect();
        for (slot, request) in affected {
            self.queue.request_if_none(slot, request);
        }
    }
}

impl TracedView {
    /// The files that its parameters name.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        files_of(&self.unit, &self.request.values).collect()
    }

    fn rendered(&self, tracing: &Tracing, color: Image, is_done: bool) -> RenderedView {
        let Self { request, behind, started, .. } = self;
        let progress = tracing.progress();
        let milliseconds = started.elapsed().as_secs_f64() * 1e3;
        let stand_in = behind.as_ref().and_then(|behind| behind.traced.clone()?.stand_in);
        let levels = match request.for_measurement {
            true => Vec::new(),
            false => outputs::levels(&color, &request.display),
        };
        RenderedView {
            size: [color.width, color.height],
            levels,
            color,
            depth: behind.as_ref().and_then(|behind| behind.depth.clone()),
            samples: [0, 0],
            view: request.detail.view(request.view),
            passes: Vec::new(),
            milliseconds,
            frame_ms: milliseconds,
            own_passes_ms: None,
            n_frames: 1,
            refines: !is_done,
            detail: request.detail,
            explained: None,
            upload_stride: 1,
            traced: Some(TracedState {
                stand_in: stand_in.filter(|_| progress.samples == 0),
                fraction: progress.fraction,
                samples: progress.samples,
                of: progress.of,
            }),
        }
    }
}
