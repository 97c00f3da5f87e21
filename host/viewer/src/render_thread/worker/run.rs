//! The command loop of the render thread.

use super::state::{ActiveRenderer, RenderWorker, is_stopped};
use crate::render_thread::command::{CommandQueue, RenderCommand, UploadedCloud};
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::{RenderedView, ViewReply};
use crate::render_thread::view_request::{EXPORT_SLOT, ViewRequest, ViewSlot};
use std::path::Path;
use std::time::Instant;
use surfelshop_api::UnitKind;

impl RenderWorker {
    /// Runs commands until the window is closed.
    pub(in crate::render_thread) fn run(&mut self, queue: &CommandQueue) {
        while let Some(command) = queue.next(self.refine_due(), self.release_due()) {
            match command {
                RenderCommand::Draw(slot, request) => self.draw_request(slot, *request),
                RenderCommand::Refine => self.refine(),
                RenderCommand::ReleaseUnused => self.release_unused(),
                RenderCommand::FileChanged(changed)
                    if self.watched_files.contains(&changed.path) =>
                {
                    self.redraw_file(&changed.path);
                }
                RenderCommand::FileChanged(changed) => self.reload_changed(&changed),
                RenderCommand::Trust(once) => {
                    self.plugins.trusted_once.extend(once);
                    self.rescan_plugins();
                }
                RenderCommand::AddPlugins(files) => {
                    self.plugins.plugin.extend(files);
                    self.rescan_plugins();
                }
                RenderCommand::Avoid(renderer) => self.avoided.push(renderer),
                RenderCommand::UploadProgress(serial, fraction) => {
                    if self.upload.is_current(serial) {
                        self.events.send(RenderEvent::UploadProgress(Some(fraction)));
                    }
                }
                RenderCommand::UploadFinished(uploaded) => self.finish_upload(*uploaded),
                RenderCommand::StopRefining(slot) => self.stop_refining(slot),
                RenderCommand::TraceProgress(slot, serial) => self.show_traced(slot, serial),
                RenderCommand::Release(slot) => {
                    self.active.remove(&slot);
                    self.drawn = Some(Instant::now());
                    self.unfinished.remove(&slot);
                    self.stop_refining(slot);
                }
                #[cfg(test)]
                RenderCommand::LoseDevice => self.session.engine.gpu().device.destroy(),
                RenderCommand::SwitchOn(renderer) => {
                    self.avoided.retain(|other| *other != renderer);
                    for kind in [UnitKind::Renderer, UnitKind::Tracer] {
                        if let Ok(unit) = self.registry.find(kind, &renderer) {
                            self.health.switch_on(&unit);
                        }
                    }
                    self.send_plugin_health();
                }
            }
        }
    }

    pub(super) fn draw_request(&mut self, slot: ViewSlot, request: ViewRequest) {
        self.stop_refining(slot);
        let tracer = self.tracer_of(&request.renderer);
        if let Some(tracer) = &tracer
            && Self::is_sent_whole(slot, &request)
        {
            return self.trace_whole(slot, request, tracer.clone());
        }
        let was_running = self.upload.is_running();
        let subset =
            self.upload.substitute(&request, &mut self.session.engine).unwrap_or_else(|error| {
                self.events.send(RenderEvent::Message(error.to_string()));
                None
            });
        if was_running && !self.upload.is_running() {
            self.events.send(RenderEvent::UploadProgress(None));
        }
        if subset.is_some() && (request.for_measurement || slot == EXPORT_SLOT) {
            // Measured and exported pictures wait for all surfels.
            self.unfinished.insert(slot, request);
            return self.continue_upload();
        }
        let (serial, renderer) = (request.serial, request.renderer.clone());
        let stride = subset.as_ref().map_or(1, |(_, stride)| *stride);
        let drawn = subset.map(|(subset, _)| subset);
        let is_whole = drawn.is_none();
        let outcome = self.draw_by(slot, &request, drawn, tracer.is_some()).map(|mut rendered| {
            rendered.upload_stride = stride;
            rendered
        });
        if outcome.as_ref().is_err_and(is_stopped) {
            self.events.send(RenderEvent::Counters(self.session.engine.counters()));
            // The next request of the view is there already.
            return self.continue_upload();
        }
        let outcome = match (is_whole, tracer) {
            (false, _) => {
                self.unfinished.insert(slot, request);
                Some(outcome)
            }
            (true, tracer) => {
                self.unfinished.remove(&slot);
                if tracer.is_none()
                    && let Ok(rendered) = &outcome
                {
                    self.start_refining(slot, &request, rendered);
                }
                match tracer {
                    Some(tracer) => self.start_tracing(slot, &request, tracer, outcome),
                    None => Some(outcome),
                }
            }
        };
        self.events.send(RenderEvent::Counters(self.session.engine.counters()));
        if let Some(outcome) = outcome {
            let outcome = outcome.map_err(|error| format!("{error:#}"));
            let reply = ViewReply { slot, serial, renderer, outcome };
            self.events.send(RenderEvent::Reply(Box::new(reply)));
        }
        // After the first picture, which would otherwise share the CPU with the upload.
        self.continue_upload();
    }

    /// Draws a request, or a copy of it with subsets of large clouds; of a tracer by the renderer that stands in.
    fn draw_by(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
        drawn: Option<ViewRequest>,
        by_stand_in: bool,
    ) -> anyhow::Result<RenderedView> {
        let drawn = drawn.as_ref();
        if !by_stand_in {
            return self.draw(slot, request, drawn.unwrap_or(request));
        }
        let stand_in = self.stand_in(slot, request);
        let drawn = drawn.map(|drawn| ViewRequest {
            renderer: stand_in.renderer.clone(),
            values: stand_in.values.clone(),
            ..drawn.clone()
        });
        self.draw(slot, &stand_in, drawn.as_ref().unwrap_or(&stand_in))
    }

    /// Starts the next upload, where a cloud is missing.
    fn continue_upload(&mut self) {
        let was_running = self.upload.is_running();
        if let Err(error) = self.upload.advance(&self.session.engine, &self.queue) {
            self.events.send(RenderEvent::Message(format!("{error:#}")));
            self.repeat_unfinished();
        }
        if self.upload.is_running() && !was_running {
            self.events.send(RenderEvent::UploadProgress(Some(0.0)));
        }
    }

    /// Draws the pictures again that showed a subset of an uploaded cloud.
    fn finish_upload(&mut self, uploaded: UploadedCloud) {
        let was_running = self.upload.is_running();
        if let Some(prepared) = self.upload.take(uploaded) {
            self.session.engine.take(prepared);
        }
        if was_running && !self.upload.is_running() {
            self.events.send(RenderEvent::UploadProgress(None));
            self.repeat_unfinished();
        }
    }

    fn repeat_unfinished(&mut self) {
        let unfinished: Vec<(ViewSlot, ViewRequest)> = self.unfinished.drain().collect();
        for (slot, request) in unfinished {
            self.queue.request_if_none(slot, request);
        }
    }

    /// Draws the pictures again that depend on a file.
    fn redraw_file(&mut self, path: &Path) {
        self.trace_again(|view| view.files().iter().any(|file| file == path));
        let uses_file = |active: &ActiveRenderer| active.files().any(|file| file == path);
        let traced = &self.traced;
        let affected = self
            .active
            .iter()
            .filter(|(slot, active)| uses_file(active) && !traced.contains_key(slot));
        let affected: Vec<(ViewSlot, ViewRequest)> =
            affected.map(|(slot, active)| (*slot, active.request.clone())).collect();
        for (slot, request) in affected {
            self.draw_request(slot, request);
        }
    }
}
