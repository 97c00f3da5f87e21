//! The command loop of the render thread.

use super::state::{ActiveRenderer, RenderWorker};
use crate::render_thread::command::{CommandQueue, RenderCommand, UploadedCloud};
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::ViewReply;
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
                RenderCommand::Avoid(renderer) => self.avoided.push(renderer),
                RenderCommand::UploadProgress(serial, fraction) => {
                    if self.upload.is_current(serial) {
                        self.events.send(RenderEvent::UploadProgress(Some(fraction)));
                    }
                }
                RenderCommand::UploadFinished(uploaded) => self.finish_upload(*uploaded),
                RenderCommand::StopRefining(slot) => self.stop_refining(slot),
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
                    if let Ok(unit) = self.registry.find(UnitKind::Renderer, &renderer) {
                        self.health.switch_on(&unit);
                    }
                    self.send_plugin_health();
                }
            }
        }
    }

    pub(super) fn draw_request(&mut self, slot: ViewSlot, request: ViewRequest) {
        self.stop_refining(slot);
        let was_running = self.upload.is_running();
        let subset =
            self.upload.substitute(&request, &self.session.engine).unwrap_or_else(|error| {
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
        let drawn = subset.as_ref().map_or(&request, |(subset, _)| subset);
        let outcome = self.draw(slot, &request, drawn).map(|mut rendered| {
            rendered.upload_stride = subset.as_ref().map_or(1, |(_, stride)| *stride);
            rendered
        });
        match subset {
            Some(_) => drop(self.unfinished.insert(slot, request)),
            None => {
                self.unfinished.remove(&slot);
                if let Ok(rendered) = &outcome {
                    self.start_refining(slot, &request, rendered);
                }
            }
        }
        let outcome = outcome.map_err(|error| format!("{error:#}"));
        self.events.send(RenderEvent::Counters(self.session.engine.counters()));
        self.events.send(RenderEvent::Reply(Box::new(ViewReply {
            slot,
            serial,
            renderer,
            outcome,
        })));
        // After the first picture, which would otherwise share the CPU with the upload.
        self.continue_upload();
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
        let uses_file = |active: &ActiveRenderer| active.files().any(|file| file == path);
        let affected = self.active.iter().filter(|(_, active)| uses_file(active));
        let affected: Vec<(ViewSlot, ViewRequest)> =
            affected.map(|(slot, active)| (*slot, active.request.clone())).collect();
        for (slot, request) in affected {
            self.draw_request(slot, request);
        }
    }
}
