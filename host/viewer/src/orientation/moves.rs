//! The camera moves to another place within a moment, so that nobody loses the way.

use super::flight::{Flight, SECONDS, between};
use super::standard_views::StandardView;
use crate::views::initial_camera;
use crate::window::Window;
use eframe::egui::Context;
use surfelshop_api::Camera;

impl Window {
    /// Moves the camera of a pane; at once where motion is reduced.
    pub(crate) fn fly_to(&mut self, pane: u32, to: Camera) {
        let from = self.camera_of(pane);
        if self.preferences.reduced_motion || from == to {
            self.views.flight = None;
            self.set_camera(pane, to);
        } else {
            self.views.flight = Some(Flight { pane, from, to, last: from, began: None });
        }
    }

    /// Moves the camera of the focused pane to where it sees everything.
    pub(crate) fn fly_to_all(&mut self) {
        let Some(shown) = &self.document.clouds else { return };
        // Somebody who walks looks at a wall.
        let to = match self.views.walking {
            true => self.framing(&shown.extent),
            false => self.framing_from_here(&shown.extent),
        };
        self.views.walking = false;
        self.fly_to(self.views.focused, to);
    }

    /// Looks at the focused view from a side.
    pub(crate) fn look_from(&mut self, view: StandardView) {
        let former = self.camera_of(self.views.focused);
        let was_walking = std::mem::replace(&mut self.views.walking, false);
        // From inside a scan the distance says nothing.
        let former = match (&self.document.clouds, was_walking) {
            (Some(shown), true) => {
                initial_camera(&shown.extent, self.document.up, self.views.shape())
            }
            _ => former,
        };
        self.fly_to(self.views.focused, view.camera(&former, self.document.up));
    }

    /// Takes a move on.
    pub(crate) fn advance_flight(&mut self, ctx: &Context) {
        let Some(flight) = &mut self.views.flight else { return };
        let now = ctx.input(|input| input.time);
        let share = ((now - *flight.began.get_or_insert(now)) / SECONDS).clamp(0.0, 1.0);
        let (pane, last) = (flight.pane, flight.last);
        let camera = if share < 1.0 { between(&flight.from, &flight.to, share) } else { flight.to };
        flight.last = camera;
        if share >= 1.0 || self.camera_of(pane) != last {
            let is_whole = self.camera_of(pane) == last;
            self.views.flight = None;
            if !is_whole {
                return;
            }
        }
        self.set_camera(pane, camera);
        ctx.request_repaint();
    }
}
