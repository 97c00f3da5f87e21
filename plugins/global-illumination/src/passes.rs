//! The passes of a frame, in the order in which they run.

use crate::frame::Passes;
use crate::settings::Show;
use surfelshop_api::prelude::*;

impl Passes<'_> {
    /// Describes all passes.
    pub(crate) fn all(mut self) {
        let cameras = self.light_views.cameras(self.graph);
        self.see_from(&cameras);
        let direct = self.direct();
        let color = if self.n_bounces == 0 {
            match self.frame.params.show {
                Show::Indirect => self.dark(),
                Show::All | Show::Direct => direct,
            }
        } else {
            let maps = self.bounces();
            let [diffuse, specular] = self.shade(&maps);
            self.debug(&maps);
            let missing = self.compensate(direct, diffuse);
            self.merge(direct, diffuse, specular, missing)
        };
        self.graph.output(Output::Color, color);
        let frames = self.frame.params.frames;
        if self.n_bounces > 0 && self.frame.frame_index.saturating_add(1) < frames {
            self.graph.request_another_frame();
        }
    }
}
