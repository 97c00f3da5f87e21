//! Requests for the pictures that the views lack.

use super::pane::ViewInputs;
use crate::render_thread::{RenderCommand, ViewSlot};
use crate::window::Window;
use eframe::egui::Context;
use surfelshop_session::eye_dome;
use surfelshop_session::options::camera;

impl Window {
    /// Requests missing pictures, and releases those of hidden sides.
    pub(crate) fn send_requests(&mut self, ctx: &Context) {
        let Some(shown) = &self.document.clouds else { return };
        // Clouds that are about to be coloured and filtered are not drawn as they are before.
        if shown.displayed_of.is_none() {
            return;
        }
        // After a crash no plugin runs until the user has decided.
        if self.render.no_device || self.plugins.crash.is_some() {
            return;
        }
        let darkened = eye_dome::shown(&self.settings.eye_dome, &shown.clouds);
        for settings in &self.settings.panes {
            let camera = self.camera_of(settings.id);
            let Some(pane) = self.views.panes.get_mut(&settings.id) else { continue };
            if pane.size_px[0] == 0 || pane.size_px[1] == 0 {
                continue;
            }
            if settings.mode.sides() < 2 {
                pane.clear_comparison();
            }
            let (shown_sides, hidden) = pane.sides.split_at_mut(settings.mode.sides());
            if let [side] = hidden {
                let slot = ViewSlot { pane: settings.id, side: 1 };
                if side.stops_refining() {
                    self.render.thread.add(RenderCommand::StopRefining(slot));
                }
                if side.release_larger(pane.size_px) {
                    self.render.thread.release(slot);
                }
            }
            for (side, side_state) in shown_sides.iter_mut().enumerate() {
                let of = shown.displayed_of.as_ref();
                let open_clouds = of.map_or(&shown.open_clouds, |of| &of.open_clouds);
                let whole = (&shown.clouds, shown.revision);
                let part =
                    self.views.alone.part(whole, open_clouds, settings.clouds[side].as_ref());
                let inputs = ViewInputs {
                    renderer: settings.renderers[side].clone(),
                    values: settings.values_of(side),
                    scene: self.settings.scene.clone(),
                    environment: self.settings.environment.clone(),
                    display: self.settings.display_transform(),
                    view: camera::framed_view(camera, &shown.extent, pane.size_px),
                    antialias: self.settings.antialias,
                    tint_backs: self.settings.splats.tint_backs,
                    eye_dome: darkened,
                    revision: shown.revision,
                    named: part.named,
                    alone: part.index,
                };
                let clouds = &part.clouds;
                // Nodes that an edit reaches are waited for: without them the next picture would be of coarse ones.
                let is_led = self.views.hands.is_led() && clouds.pyramids.is_empty();
                let motion = (self.views.adaptive, is_led);
                let serial = &mut self.render.serial;
                let (request, again) = side_state.next_request(&inputs, clouds, motion, serial);
                if let Some(request) = request {
                    self.render.thread.request(ViewSlot { pane: settings.id, side }, request);
                }
                if let Some(again) = again {
                    ctx.request_repaint_after(again);
                }
            }
        }
    }
}
