//! What is dragged out of the outliner and let go over a view: a renderer, or a remembered camera.

use crate::document::Mode;
use crate::panels::{Dragged, Selection};
use crate::views::caption;
use crate::window::Window;
use eframe::egui::{Align2, Color32, Painter, Pos2, Rect, Response, Stroke, StrokeKind, Ui, pos2};

/// Share of a view's width in which a renderer is let go to be drawn alone; right of it, to be compared.
const ALONE: f32 = 0.5;

/// Shows where what is dragged would go, and takes it.
pub(super) fn show(
    window: &mut Window,
    ui: &Ui,
    response: &Response,
    painter: &Painter,
    pane: u32,
) {
    let rect = response.rect;
    if let Some(dragged) = response.dnd_hover_payload::<Dragged>()
        && let Some(at) = ui.ctx().pointer_interact_pos()
        && let Some((place, words)) = target(&dragged, rect, at)
    {
        let fill = Color32::from_rgba_unmultiplied(60, 130, 220, 70);
        painter.rect_filled(place, 0.0, fill);
        let stroke = Stroke::new(2.0, Color32::WHITE);
        painter.rect_stroke(place.shrink(1.0), 0.0, stroke, StrokeKind::Inside);
        caption(painter, place.center(), Align2::CENTER_CENTER, words);
    }
    let Some(dragged) = response.dnd_release_payload::<Dragged>() else { return };
    let Some(at) = ui.ctx().pointer_interact_pos() else { return };
    match &*dragged {
        Dragged::Renderer(name) => {
            let compares = compares(rect, at);
            draw_by(window, pane, name, compares);
        }
        Dragged::Bookmark(index) => {
            window.views.focused = pane;
            window.go_to_bookmark(*index);
        }
        Dragged::Light(_) => {}
    }
}

fn compares(rect: Rect, at: Pos2) -> bool {
    at.x > rect.left() + ALONE * rect.width()
}

/// The part of a view where something would go, and what would be done.
fn target(dragged: &Dragged, rect: Rect, at: Pos2) -> Option<(Rect, &'static str)> {
    let middle = rect.left() + ALONE * rect.width();
    match dragged {
        Dragged::Renderer(_) if compares(rect, at) => {
            let place = Rect::from_min_max(pos2(middle, rect.top()), rect.max);
            Some((place, "compare, with a wipe line"))
        }
        Dragged::Renderer(_) => {
            let place = Rect::from_min_max(rect.min, pos2(middle, rect.bottom()));
            Some((place, "draw the view by it"))
        }
        Dragged::Bookmark(_) => Some((rect, "look from there")),
        Dragged::Light(_) => None,
    }
}

/// Draws a view by a renderer, or puts it right of a line.
fn draw_by(window: &mut Window, pane: u32, name: &str, compares: bool) {
    let Some(settings) = window.settings.pane_mut(pane) else { return };
    let side = usize::from(compares);
    name.clone_into(&mut settings.renderers[side]);
    if compares && settings.mode == Mode::Single {
        settings.mode = Mode::Wipe;
    }
    window.views.focused = pane;
    window.select(Selection::View);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_left_half_draws_and_the_right_half_compares() {
        let rect = Rect::from_min_max(pos2(100.0, 0.0), pos2(300.0, 100.0));
        let renderer = Dragged::Renderer("flat".to_owned());
        for (x, expected) in [(120.0, [100.0, 200.0]), (280.0, [200.0, 300.0])] {
            let (place, _) = target(&renderer, rect, pos2(x, 50.0)).unwrap();
            assert_eq!([place.left(), place.right()], expected);
        }
        assert_eq!(target(&Dragged::Light(0), rect, rect.center()), None);
    }
}
