//! Clicks on the pictures add places.

use crate::panels::Selection;
use crate::views::hands::HandMode;
use crate::window::Window;
use eframe::egui::{CursorIcon, Key, Modifiers, Rect, Response, Ui, Vec2};
use surfelshop_cloud::scene::{MOST_MEASURES, MOST_PLACES, Measure, MeasureKind};

/// A click so near to the first place closes what goes around an area, points of the screen.
const CLOSES: f32 = 9.0;

/// Takes clicks and keys in, where something is measured.
pub(in crate::views) fn over_picture(
    window: &mut Window,
    ui: &Ui,
    response: &Response,
    pane: u32,
    rects: &[Rect],
) {
    let HandMode::Measure(kind) = window.views.hands.mode else { return };
    if window.document.complete_clouds().is_none() {
        return;
    }
    if response.contains_pointer() {
        ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    }
    let is_typed = ui.ctx().egui_wants_keyboard_input();
    let pressed =
        |key: Key| !is_typed && ui.ctx().input_mut(|input| input.consume_key(Modifiers::NONE, key));
    if pressed(Key::Backspace) {
        window.views.measuring.places.pop();
    }
    if pressed(Key::Enter) {
        window.finish_measure(kind);
    }
    if !response.clicked() {
        return;
    }
    if response.double_clicked() && window.views.measuring.places.len() > 1 {
        // The first click of the two has added the place.
        window.finish_measure(kind);
        return;
    }
    if kind.is_closed() && closes(window, response, pane, rects) {
        window.finish_measure(kind);
        return;
    }
    let Some(place) = window.views.measuring.pointer else {
        window.messages.report("click on the surface: there is no surfel here");
        return;
    };
    let places = &mut window.views.measuring.places;
    places.push(place);
    let goes_on = ui.ctx().input(|input| input.modifiers.shift) || kind.is_closed();
    let n = places.len();
    let is_whole = n == *kind.n_places().end() || (n >= *kind.n_places().start() && !goes_on);
    if is_whole || n >= MOST_PLACES {
        window.finish_measure(kind);
    }
}

/// Whether a click is on the first place.
fn closes(window: &Window, response: &Response, pane: u32, rects: &[Rect]) -> bool {
    let places = &window.views.measuring.places;
    let (Some(first), true) = (places.first(), places.len() > 2) else { return false };
    let Some(at) = response.interact_pointer_pos().or(response.hover_pos()) else { return false };
    let Some(rect) = rects.iter().find(|rect| rect.contains(at)) else { return false };
    let seen = crate::views::picking::project(&window.camera_of(pane), *first);
    seen.is_some_and(|seen| {
        let offset = Vec2::from(seen.position.as_vec2().to_array()) * rect.height();
        (rect.center() + offset).distance(at) <= CLOSES
    })
}

impl Window {
    /// Makes a measure of the places that were clicked, where they are enough.
    fn finish_measure(&mut self, kind: MeasureKind) {
        let places = &mut self.views.measuring.places;
        // A double click may have hit one place twice.
        places.dedup();
        if !kind.n_places().contains(&places.len()) {
            return;
        }
        let places = std::mem::take(places);
        if self.settings.measures.len() >= MOST_MEASURES {
            let line = format!("there are {MOST_MEASURES} measures, as many as there can be");
            return self.messages.warn(line);
        }
        self.settings.measures.push(Measure::new(kind, places));
        self.select(Selection::Measure(self.settings.measures.len() - 1));
        if kind == MeasureKind::Note {
            self.rename_selected();
        }
    }
}
