//! Letting go of what pictures needed that are not shown any more, once nothing else is to be done: of
//! other sizes above all, which would otherwise hold the memory of the largest window there was.

use super::Worker;
use crate::viewer::darkroom::News;
use std::time::{Duration, Instant};

/// Time after the last picture: while the window's edge is dragged every picture has another size, and
/// what moves is drawn in several.
const REST: Duration = Duration::from_secs(1);

impl Worker {
    /// From when on there is something to tidy up, if nothing happens before.
    pub(super) fn tidies_from(&self) -> Option<Instant> {
        self.drawn.map(|drawn| drawn + REST)
    }

    /// Lets go of what pictures of other sizes needed than those on show.
    pub(super) fn tidy_up(&mut self) {
        self.drawn = None;
        let sizes: Vec<[u32; 2]> =
            self.in_use.values().map(|in_use| in_use.order.view.size_px).collect();
        self.studio.engine.keep_sizes(&sizes);
        self.teller.tell(News::Counters(self.studio.engine.counters()));
    }
}
