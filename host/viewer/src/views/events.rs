//! Events of the render thread are taken in.

use super::pane::PaneImage;
use crate::export;
use crate::measure;
use crate::render_thread::{EXPORT_SLOT, MEASURE_PANE, RenderEvent, UnitHealth, ViewReply};
use crate::window::Window;
use eframe::egui::Context;

impl Window {
    /// Takes in the events since the last frame.
    pub(crate) fn take_events(&mut self, ctx: &Context) {
        for event in self.render.thread.events() {
            match event {
                RenderEvent::DeviceOpened { adapter, software } => {
                    self.render.adapter = adapter;
                    self.render.software = software;
                }
                // The first reason counts: the thread ends after it.
                RenderEvent::NoDevice(_) if self.render.no_device => {}
                RenderEvent::NoDevice(reason) => {
                    self.render.no_device = true;
                    self.messages.warn(reason);
                }
                RenderEvent::Declared { renderer, parameters } => {
                    let known = self.plugins.declared.insert(renderer.clone(), parameters);
                    if known != self.plugins.declared.get(&renderer).cloned() {
                        self.fit_values(&renderer);
                    }
                }
                RenderEvent::Preparing { slot, renderer } => {
                    if let Some(pane) = self.views.panes.get_mut(&slot.pane) {
                        pane.sides[slot.side].preparing = Some(renderer);
                    }
                }
                RenderEvent::UploadProgress(fraction) => self.render.upload_progress = fraction,
                RenderEvent::Reply(reply) => self.take_reply(ctx, *reply),
                RenderEvent::Counters(counters) => self.render.counters = counters,
                RenderEvent::Plugins(registry) => {
                    self.plugins.registry = registry;
                    self.plugins.previews.forget();
                    self.plugins.tools.units.unload_all();
                    self.measure.units.unload_all();
                    self.measure.n_redrawn += 1;
                    self.retry_failed();
                }
                RenderEvent::Reloaded(report) => self.messages.report(report),
                RenderEvent::PluginHealth(failures) => {
                    let off = |all: &[UnitHealth]| all.iter().filter(|unit| unit.off).count();
                    let fewer = off(&failures) < off(&self.plugins.unit_health);
                    self.plugins.unit_health = failures;
                    if fewer {
                        self.retry_failed();
                    }
                }
                RenderEvent::Message(line) => self.messages.warn(line),
            }
        }
    }

    /// Requests failed pictures again: the cause may be gone.
    fn retry_failed(&mut self) {
        for side in self.views.panes.values_mut().flat_map(|pane| &mut pane.sides) {
            side.retry_failed();
        }
    }

    /// Shows a picture. A renderer that failed is replaced by the one whose picture is shown.
    fn take_reply(&mut self, ctx: &Context, reply: ViewReply) {
        let ViewReply { slot, serial, renderer, outcome } = reply;
        if slot == EXPORT_SLOT {
            export::take_reply(self, serial, outcome);
            return;
        }
        if slot.pane == MEASURE_PANE {
            measure::take_reply(self, serial, outcome);
            return;
        }
        let Some(pane) = self.views.panes.get_mut(&slot.pane) else { return };
        if let Ok(rendered) = &outcome {
            let detail = rendered.describe_detail();
            let passes: Vec<String> = (rendered.passes.iter())
                .filter_map(|pass| Some(format!("{} {:.1}", pass.name, pass.gpu_ms?)))
                .collect();
            let (ms, passes) = (rendered.milliseconds, passes.join(", "));
            tracing::debug!(pane = slot.pane, renderer, ms, detail, passes, "picture");
        }
        let failed = outcome.as_ref().err().cloned();
        let side = &mut pane.sides[slot.side];
        let same = |shown: &PaneImage| shown.serial == serial && shown.rendered.is_final();
        if side.shown.as_ref().is_some_and(same) {
            // The same request again: its plugin, or a file of its parameters, has changed.
            self.measure.n_redrawn += 1;
        }
        side.take_reply(ctx, slot, renderer.clone(), serial, outcome);
        let Some(reason) = failed else { return };
        let before = side.shown.as_ref().map(|shown| shown.renderer.clone());
        self.messages.warn(format!("{renderer}: {reason}"));
        if let Some(before) = before
            && before != renderer
            && let Some(pane) = self.settings.pane_mut(slot.pane)
            && pane.renderers[slot.side] == renderer
        {
            pane.renderers[slot.side] = before;
        }
    }
}
