//! A picture is drawn, by the renderer of the slot or by one that is started first.

use super::beside::Beside;
use super::frames::Frames;
use super::state::{ActiveRenderer, RenderWorker};
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::RenderedView;
use crate::render_thread::view_request::{ViewRequest, ViewSlot};
use anyhow::anyhow;
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::graph::Output;
use surfelshop_api::{Camera, UnitKind, View};
use surfelshop_image::outputs;
use surfelshop_render::{Explanation, RenderError, RenderRequest, RendererView};
use surfelshop_runtime::plugins::{self, Contents, CrashMark, Hosted, LoadedUnit, Origin, UnitRef};
use surfelshop_session::antialias::shift_px;
use surfelshop_session::input::drawn::Wait;
use surfelshop_session::input::environment_map::LoadedEnvironment;
use surfelshop_session::input::pyramids::DETAIL_PX;
use surfelshop_session::session::ConvergedFrame;

/// Pictures that nodes of pyramids are read ahead for while something moves: so many steps as the last one.
const STEPS_AHEAD: f64 = 6.0;

const OUTPUTS: [Output; 2] = [Output::Color, Output::Depth];

impl RenderWorker {
    /// Draws a picture with the renderer of the slot, or with another one; `drawn` is the request
    /// itself, or a copy with subsets of large clouds.
    ///
    /// The slot's old renderer is dropped only after the new one has drawn its picture.
    pub(super) fn draw(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
        drawn: &ViewRequest,
    ) -> anyhow::Result<RenderedView> {
        let started = Instant::now();
        let present = self.active.remove(&slot);
        let (mut active, before) = match present {
            Some(active) if active.name == request.renderer => (active, None),
            before => match self.start_renderer(slot, request) {
                Ok(active) => (active, before),
                Err(error) => {
                    self.active.extend(before.map(|before| (slot, before)));
                    return Err(error);
                }
            },
        };
        active.request = request.clone();
        if let Err(refusal) = self.health.check(&active.reference) {
            self.active.extend(before.map(|before| (slot, before)));
            return Err(refusal.into());
        }
        self.watch_files(active.files().collect());
        if let Err(refusal) = self.share(slot, &mut active) {
            self.active.insert(slot, before.unwrap_or(active));
            return Err(refusal);
        }
        if request.in_motion {
            self.wish_for_nodes(slot, drawn);
            // What fails is said; the picture is drawn of what is there.
            if let Err(error) = drawn.clouds.wait(Duration::ZERO) {
                self.events.send(RenderEvent::Message(error.to_string()));
            }
        }
        let frames = Frames::of(slot, request);
        // Others wait for what is measured or exported.
        let is_left = !request.in_motion && !matches!(frames, Frames::All);
        let stop = self.queue.draws_whole(is_left.then_some(slot));
        self.session.engine.stop_when(stop);
        match self.render(&mut active.view, drawn, frames) {
            Ok((frame, explained)) => {
                active.mark = None;
                self.health.succeeded(&active.reference, active.unit.contents);
                active.beside.succeeded(&mut self.health);
                self.active.insert(slot, active);
                rendered_view(frame, frames, explained.map(Arc::new), request, started)
            }
            Err(error) => {
                let fault = self.record_fault(&active, error);
                self.active.insert(slot, before.unwrap_or(active));
                fault
            }
        }
    }

    /// Loads a renderer and creates an instance.
    fn start_renderer(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
    ) -> anyhow::Result<ActiveRenderer> {
        let name = request.renderer.clone();
        let reference = self.registry.find(UnitKind::Renderer, &name)?;
        anyhow::ensure!(
            !self.avoided.contains(&name),
            "{reference} was at work when the program crashed; the plugin list switches it on"
        );
        self.health.check(&reference)?;
        let (unit, hosted, mark) = self.start_unit(slot, &name, &reference)?;
        let view = RendererView::new(hosted, unit.scope()).needing(&unit.description.needs);
        let (request, beside) = (request.clone(), Beside::default());
        Ok(ActiveRenderer { name, reference, unit, view, mark, request, beside })
    }

    /// Loads a unit and makes an instance of it.
    pub(super) fn start_unit(
        &mut self,
        slot: ViewSlot,
        name: &str,
        reference: &UnitRef,
    ) -> anyhow::Result<(LoadedUnit, Hosted, Option<CrashMark>)> {
        self.events.send(RenderEvent::Preparing { slot, renderer: name.to_owned() });
        // Without the mark a crash is not attributed to the unit, but it can still draw.
        let mark = self.crash_guard.as_ref().and_then(|guard| guard.leave(reference).ok());
        let unit = match reference.load(&self.plugins.patience()) {
            Ok(unit) => unit,
            Err(error) => {
                if let Some(fault) = error.fault() {
                    self.record_failure(reference, Contents::of_file(&reference.path), fault);
                }
                return Err(error.into());
            }
        };
        let host = self.session.engine.gpu().host_info();
        let hosted = match unit.start(&host, &self.plugins.patience()) {
            Ok(hosted) => hosted,
            Err(fault) => {
                self.record_failure(reference, unit.contents, &fault);
                return Err(anyhow!("{reference} could not start: {fault}"));
            }
        };
        let parameters = unit.description.params.clone();
        self.events.send(RenderEvent::Declared { renderer: name.to_owned(), parameters });
        Ok((unit, hosted, mark))
    }

    /// Watches files that parameters name.
    pub(super) fn watch_files(&mut self, paths: Vec<PathBuf>) {
        for path in paths {
            if let Some(watcher) = &self.watcher
                && self.watched_files.insert(path.clone())
            {
                watcher.add(plugins::Place::new(path, Origin::CommandLine));
            }
        }
    }

    /// Renders one frame, or all until the picture is final. A final still picture is explained.
    pub(super) fn render(
        &mut self,
        view: &mut RendererView,
        request: &ViewRequest,
        frames: Frames,
    ) -> Result<(ConvergedFrame, Option<Explanation>), RenderError> {
        // A measured picture does not pay for shaders compiled ahead.
        self.session.engine.compile_beside(!request.for_measurement);
        self.session.engine.tint_backs(request.tint_backs);
        if request.for_measurement {
            // A view may have drawn the same surfels, and a measured picture pays for its own.
            self.session.engine.forget_surfaces();
        }
        let environment = self.environment_light(request);
        let seen = request.detail.view(request.view);
        // Measured and exported pictures have all that they need; others are drawn of what is in memory.
        let wait = match frames {
            Frames::All => Wait::ForAll,
            Frames::One { .. } => for_none(request),
        };
        let is_full = request.detail.is_full();
        let clouds = &request.clouds;
        let drawn = clouds.drawn(&seen, &request.scene.surface, node_detail(request), wait);
        let drawn = drawn.map_err(|error| RenderError::Cloud(error.to_string()))?;
        let views = drawn.with(clouds);
        let render_request = RenderRequest {
            clouds: views.clouds(),
            facts: &request.clouds.facts,
            scene: &request.scene,
            view: seen,
            values: &request.values,
            // The pointer reads depths of still pictures alone.
            outputs: match is_full && !request.for_measurement && frames.is_first_sample() {
                true => &OUTPUTS,
                false => &OUTPUTS[..1],
            },
            frame_index: 0,
            environment: environment.as_ref().map(LoadedEnvironment::view),
            // Nodes of pyramids are coarser instead.
            stride: if views.parts().is_some() { 1 } else { request.detail.stride },
            detail_px: 0.0,
            parts: views.parts(),
            eye_dome: request.eye_dome.map(|how| how.in_pixels_of(request.detail.coarseness)),
        };
        let mut frame = match frames {
            Frames::All => {
                self.session.settle_view_antialiased(view, &render_request, request.antialias)?
            }
            Frames::One { sample, frame } => {
                let shift_px = shift_px(sample, request.antialias);
                let of_index = RenderRequest { frame_index: frame, ..render_request };
                self.session.frame_view(view, &of_index, shift_px)?
            }
        };
        if drawn.is_provisional() {
            // Of other nodes it is another scene, which renderers begin anew.
            (frame.rendered.wants_another_frame, frame.n_frames) = (true, 0);
        }
        self.drawn = Some(Instant::now());
        self.n_drawn += match frames {
            Frames::All => u64::from(frame.n_frames),
            Frames::One { .. } => 1,
        };
        let is_still = is_full && !request.for_measurement && !frame.refines();
        let explained = (is_still && frames.is_first_sample())
            .then(|| self.session.engine.explain(view, &render_request, &frame.rendered));
        Ok((frame, explained))
    }

    /// Has nodes of pyramids read that a picture would be drawn from, and in motion those of the pictures to come.
    pub(super) fn wish_for_nodes(&mut self, slot: ViewSlot, request: &ViewRequest) {
        if request.clouds.pyramids.is_empty() {
            return;
        }
        let view = request.detail.view(request.view);
        let before = self.last_views.insert(slot, view);
        let next = before.filter(|_| request.in_motion).map(|before| ahead(&before, &view));
        let surface = &request.scene.surface;
        let (detail_px, wait) = (node_detail(request), for_none(request));
        request.clouds.wish((&view, next.as_ref()), surface, detail_px, wait);
    }

    /// The environment light; none where its map cannot be read, which is reported once.
    pub(super) fn environment_light(&mut self, request: &ViewRequest) -> Option<LoadedEnvironment> {
        let (probes, events) = (&mut self.probes, &self.events);
        probes.light_or_none(request.environment.as_ref()?, |line| {
            events.send(RenderEvent::Message(line));
        })
    }
}

/// Where a view will be some pictures from now, if it goes on as it did from the one before.
fn ahead(before: &View, now: &View) -> View {
    let (a, b) = (&before.camera, &now.camera);
    let on = |a: DVec3, b: DVec3| b + STEPS_AHEAD * (b - a);
    let camera = Camera { eye: on(a.eye, b.eye), target: on(a.target, b.target), ..*b };
    View { camera, ..*now }
}

/// How pictures are drawn that do not wait for nodes.
fn for_none(request: &ViewRequest) -> Wait {
    match request.in_motion || !request.detail.is_full() {
        true => Wait::ForNoneInMotion,
        false => Wait::ForNone,
    }
}

/// Radius in pixels of merged surfels of pyramids: in motion as much larger as fewer surfels are drawn.
fn node_detail(request: &ViewRequest) -> f32 {
    DETAIL_PX * (request.detail.stride as f32).sqrt()
}

/// The picture of a frame. Pictures of megapixels are moved: a copy takes as long as shading them.
pub(super) fn rendered_view(
    frame: ConvergedFrame,
    frames: Frames,
    explained: Option<Arc<Explanation>>,
    request: &ViewRequest,
    started: Instant,
) -> anyhow::Result<RenderedView> {
    let n_settled = frames.n_settled(&frame);
    let mut rendered = frame.rendered;
    let mut taken = |wanted: &Output| {
        let at = rendered.images.iter().position(|(output, _)| output == wanted)?;
        Some(rendered.images.swap_remove(at).1)
    };
    let (color, depth) = (taken(&Output::Color), taken(&Output::Depth));
    let color =
        color.ok_or_else(|| anyhow!("the renderer gave no output `{}`", Output::Color.name()))?;
    Ok(RenderedView {
        size: [color.width, color.height],
        levels: match request.for_measurement {
            true => Vec::new(),
            false => outputs::levels(&color, &request.display),
        },
        color,
        depth,
        view: request.detail.view(request.view),
        passes: rendered.passes,
        milliseconds: started.elapsed().as_secs_f64() * 1e3,
        frame_ms: frame.milliseconds,
        own_passes_ms: frame.own_passes_ms,
        n_frames: frame.n_frames,
        refines: n_settled < request.antialias,
        samples: [n_settled, request.antialias],
        detail: request.detail,
        explained,
        upload_stride: 1,
        traced: None,
    })
}
