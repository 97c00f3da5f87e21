//! Device memory of picture sizes that are no longer shown is freed while the queue is empty. Without
//! this the engine would hold the memory of the largest window of the session.

use super::state::RenderWorker;
use crate::render_thread::event::RenderEvent;
use std::time::{Duration, Instant};

/// Time after the last picture: while the window's edge is dragged, or something moves, sizes change
/// with every picture.
const RELEASE_DELAY: Duration = Duration::from_secs(1);

impl RenderWorker {
    /// From when on unused memory may be freed, if there is any.
    pub(super) fn release_due(&self) -> Option<Instant> {
        self.drawn.map(|drawn| drawn + RELEASE_DELAY)
    }

    /// Frees the memory of picture sizes that no slot has.
    pub(super) fn release_unused(&mut self) {
        self.drawn = None;
        let sizes: Vec<[u32; 2]> =
            self.active.values().map(|active| active.request.view.size_px).collect();
        self.session.engine.keep_sizes(&sizes);
        self.events.send(RenderEvent::Counters(self.session.engine.counters()));
    }
}
