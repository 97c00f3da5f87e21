//! A rebuilt renderer replaces the old one after its first picture.

use super::beside::Beside;
use super::draw::rendered_view;
use super::frames::Frames;
use super::state::{ActiveRenderer, RenderWorker};
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::{RenderedView, ViewReply};
use crate::render_thread::view_request::{ViewRequest, ViewSlot};
use std::sync::Arc;
use std::time::Instant;
use surfelshop_api::FrameRequest;
use surfelshop_render::RendererView;
use surfelshop_runtime::plugins::{Changed, Registry};

impl RenderWorker {
    /// Scans the plugins again and reloads the renderers of a changed file.
    pub(super) fn reload_changed(&mut self, changed: &Changed) {
        self.rescan_plugins();
        if !changed.exists {
            return;
        }
        self.trace_again(|view| view.reference.path == changed.path);
        let same_file = |active: &ActiveRenderer| {
            active.reference.path == changed.path || active.beside.is_of(&changed.path)
        };
        let slots: Vec<ViewSlot> = self
            .active
            .iter()
            // A stand-in of a tracer is made anew with the next picture that it stands in for.
            .filter(|(slot, active)| same_file(active) && !self.traced.contains_key(slot))
            .map(|(slot, _)| *slot)
            .collect();
        for slot in slots {
            let Some(old) = self.active.remove(&slot) else { continue };
            if !old.beside.is_empty() {
                // All that draw the picture are started anew.
                self.draw_request(slot, old.request.clone());
                continue;
            }
            match self.reload(slot, &old, changed) {
                Ok((new, rendered, report)) => {
                    self.stop_refining(slot);
                    self.start_refining(slot, &new.request, &rendered);
                    let (serial, renderer) = (new.request.serial, new.name.clone());
                    self.active.insert(slot, new);
                    let reply = ViewReply { slot, serial, renderer, outcome: Ok(rendered) };
                    self.events.send(RenderEvent::Reply(Box::new(reply)));
                    // After the picture, so that the report never precedes it.
                    self.events.send(RenderEvent::Reloaded(report));
                }
                Err(error) => {
                    let name = &old.name;
                    let line = format!("rebuilt {name} is not used, the old one is: {error:#}");
                    self.events.send(RenderEvent::Message(line));
                    self.active.insert(slot, old);
                }
            }
        }
    }

    /// Scans the plugins again: files or the trust list may have changed.
    pub(super) fn rescan_plugins(&mut self) {
        match self.plugins.search() {
            // The scan lists an invalid file of the command line and does not fail.
            Ok(search) => {
                self.registry = Registry::scan(&search);
                self.tracers.clear();
                self.events.send(RenderEvent::Plugins(self.registry.clone()));
            }
            Err(error) => self.events.send(RenderEvent::Message(format!("{error:#}"))),
        }
    }

    /// Starts a rebuilt renderer: it, its picture of the old one's last request, and a report of the
    /// times.
    fn reload(
        &mut self,
        slot: ViewSlot,
        old: &ActiveRenderer,
        changed: &Changed,
    ) -> anyhow::Result<(ActiveRenderer, RenderedView, String)> {
        let request = &old.request;
        let frame_request = FrameRequest {
            view: request.view,
            scene: request.scene.clone(),
            cloud: request.clouds.facts.clone(),
            frame_index: 0,
            values: request.values.clone(),
            environment: self
                .environment_light(request)
                .map(|light| light.view().environment.clone()),
        };
        // From the new scan: a link may lead to another file now, which nobody has trusted.
        let reference = self.registry.at(&changed.path, &old.reference);
        let reference = reference.unwrap_or_else(|| old.reference.clone());
        let mark = self.crash_guard.as_ref().and_then(|guard| guard.leave(&reference).ok());
        let host = self.session.engine.gpu().host_info();
        let timeouts = self.plugins.patience();
        let reloaded = reference.reload(&host, &frame_request, &timeouts)?;
        let (unit, carried) = (reloaded.unit, reloaded.kept);
        let request = ViewRequest { values: carried.values.clone(), ..request.clone() };
        let mut view =
            RendererView::new(reloaded.hosted, unit.scope()).needing(&unit.description.needs);
        let started = Instant::now();
        let frames = Frames::of(slot, &request);
        let (frame, explained) = self.render(&mut view, &request, frames)?;
        let rendered = rendered_view(frame, frames, explained.map(Arc::new), &request, started)?;
        let ms = |duration: std::time::Duration| duration.as_secs_f64() * 1e3;
        let report = format!(
            "{} was rebuilt: load and first graph {:.1} ms, compiling and drawing {:.0} ms, after \
             {:.0} ms to be sure the file is whole{}",
            old.name,
            ms(reloaded.took.total()),
            rendered.milliseconds,
            ms(changed.debounce()),
            carried.notes.iter().map(|note| format!("; {note}")).collect::<String>()
        );
        let parameters = unit.description.params.clone();
        let renderer = old.name.clone();
        self.events.send(RenderEvent::Declared { renderer, parameters });
        self.health.succeeded(&reference, unit.contents);
        drop(mark);
        let name = old.name.clone();
        let beside = Beside::default();
        let new = ActiveRenderer { name, reference, unit, view, mark: None, request, beside };
        Ok((new, rendered, report))
    }
}
