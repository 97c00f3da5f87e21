//! Pictures are refined frame by frame while the queue is empty, several of them in turn.

use super::draw::rendered_view;
use super::refining_view::{FrameUse, RefiningView};
use super::state::{RenderWorker, is_stopped};
use crate::render_thread::cloud_upload::LARGE;
use crate::render_thread::event::RenderEvent;
use crate::render_thread::rendered_view::{RenderedView, ViewReply};
use crate::render_thread::view_request::{ViewRequest, ViewSlot};
use anyhow::anyhow;
use std::time::{Duration, Instant};
use surfelshop_render::RenderError;

/// Time between two frames of a picture that are sent: showing one takes time, too.
const SEND_INTERVAL: Duration = Duration::from_millis(50);

/// Frames of other pictures after which a picture is refined from its first frame: the engine drops
/// what a graph left on the device after 64.
const MOST_OTHER_FRAMES: u64 = 60;

/// Time for which nodes of a pyramid are waited for before it is asked again what else there is to do.
const LOADING: Duration = Duration::from_millis(80);

/// Time after a picture in motion during which the device stays free for the next one.
const MOTION_PAUSE: Duration = Duration::from_millis(150);

impl RenderWorker {
    /// Adds a new picture to those being refined, if another frame would change it.
    pub(super) fn start_refining(
        &mut self,
        slot: ViewSlot,
        request: &ViewRequest,
        rendered: &RenderedView,
    ) {
        if request.in_motion {
            self.moved = Some(Instant::now());
            return;
        }
        if rendered.refines {
            self.refining.push_back(RefiningView::new(slot, rendered, self.n_drawn));
        }
        if !request.for_measurement {
            self.unprepared = Some(slot);
        }
    }

    /// Stops refining the picture of a slot, or tracing it.
    pub(super) fn stop_refining(&mut self, slot: ViewSlot) {
        self.stop_tracing(slot);
        self.refining.retain(|refining| refining.slot != slot);
    }

    /// From when on a picture may be refined, or its motion prepared, if there is one.
    pub(super) fn refine_due(&self) -> Option<Instant> {
        let now = Instant::now();
        (self.unprepared.is_some() || !self.refining.is_empty())
            .then(|| self.moved.map_or(now, |moved| moved + MOTION_PAUSE))
    }

    /// Prepares motion, or draws the next frame of the picture that has waited longest.
    pub(super) fn refine(&mut self) {
        if let Some(slot) = self.unprepared.take() {
            return self.prepare_motion(slot);
        }
        let Some(mut refining) = self.refining.pop_front() else { return };
        let slot = refining.slot;
        let Some(active) = self.active.get(&slot) else { return };
        let (serial, renderer) = (active.request.serial, active.name.clone());
        if self.n_drawn - refining.n_drawn > MOST_OTHER_FRAMES {
            refining.n_frames = 0;
        }
        let outcome = match self.next_frame(&mut refining) {
            Ok((refines, rendered)) => {
                if refines {
                    if rendered.is_some() {
                        refining.sent = Instant::now();
                    }
                    refining.n_drawn = self.n_drawn;
                    self.refining.push_back(refining);
                }
                let Some(rendered) = rendered else { return };
                Ok(rendered)
            }
            // The view has moved on.
            Err(error) if is_stopped(&error) => return,
            Err(error) => Err(format!("{error:#}")),
        };
        self.events.send(RenderEvent::Counters(self.session.engine.counters()));
        self.events.send(RenderEvent::Reply(Box::new(ViewReply {
            slot,
            serial,
            renderer,
            outcome,
        })));
    }

    /// Makes what the first picture in motion would wait for, while nothing else is asked for. Pyramids have nodes of
    /// their own, and large clouds are prepared as a whole beside the thread.
    fn prepare_motion(&mut self, slot: ViewSlot) {
        let Self { active, session, .. } = self;
        let Some(clouds) = active.get(&slot).map(|active| &active.request.clouds) else { return };
        let is_in_memory = clouds.pyramids.is_empty()
            && clouds.loaded.iter().all(|loaded| loaded.cloud.len() < LARGE);
        let prepared = match is_in_memory {
            true => session.engine.prepare_strides(&clouds.views()),
            false => Ok(()),
        };
        if let Err(error) = prepared {
            // The pictures say so themselves.
            tracing::debug!("nothing is prepared for motion: {error}");
        }
    }

    /// Draws the next frame. Returns whether another one would change the picture, and the picture where it is to be
    /// shown.
    fn next_frame(
        &mut self,
        refining: &mut RefiningView,
    ) -> anyhow::Result<(bool, Option<RenderedView>)> {
        let present = self.active.remove(&refining.slot);
        let mut active = present.ok_or_else(|| anyhow!("nothing is drawn there any more"))?;
        if let Err(refusal) = self.health.check(&active.reference) {
            self.active.insert(refining.slot, active);
            return Err(refusal.into());
        }
        let request = active.request.clone();
        self.wish_for_nodes(refining.slot, &request);
        let arrived = request.clouds.wait(LOADING);
        let arrived = arrived.map_err(|error| RenderError::Cloud(error.to_string()));
        if matches!(arrived, Ok(false)) && request.clouds.is_waited_for() {
            // The picture would be the same.
            self.active.insert(refining.slot, active);
            return Ok((true, None));
        }
        let started = Instant::now();
        let stop = self.queue.draws_whole(Some(refining.slot));
        self.session.engine.stop_when(stop);
        let frames = refining.next_frames();
        let drawn = arrived.and_then(|_| self.render(&mut active.view, &request, frames));
        let taken = drawn.and_then(|(mut frame, explained)| {
            let taken = refining.take(&mut frame, explained, request.antialias)?;
            Ok((frame, taken))
        });
        let result = match taken {
            Ok((frame, FrameUse { refines, may_be_shown, explained })) => {
                // The rate of frames sent in all does not grow with the number of pictures.
                let others = u32::try_from(self.refining.len()).unwrap_or(u32::MAX);
                let interval = SEND_INTERVAL.saturating_mul(others.saturating_add(1));
                let is_sent = !refines || may_be_shown && refining.sent.elapsed() >= interval;
                let rendered = is_sent.then(|| {
                    let shown = refining.shown(frame);
                    rendered_view(shown, frames, explained, &request, started)
                });
                rendered.transpose().map(|rendered| (refines, rendered))
            }
            Err(error) => self.record_fault(&active, error),
        };
        self.active.insert(refining.slot, active);
        result
    }
}
