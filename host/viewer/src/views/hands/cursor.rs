//! What is shown under the pointer: a rectangle, a line, or the circle of a brush.

use super::state::HandMode;
use crate::window::Window;
use eframe::egui::{Color32, Painter, Pos2, Rect, Shape, Stroke, StrokeKind};

/// Draws lines that are seen on light and on dark.
fn strokes() -> [Stroke; 2] {
    [Stroke::new(3.0, Color32::from_black_alpha(140)), Stroke::new(1.0, Color32::WHITE)]
}

/// Shows it.
pub(super) fn show(
    window: &Window,
    painter: &Painter,
    pane: u32,
    rects: &[Rect],
    pointer: Option<Pos2>,
) {
    let hands = &window.views.hands;
    let gesture = hands.gesture.as_ref().filter(|gesture| gesture.pane == pane);
    match (&hands.mode, gesture) {
        (HandMode::Rectangle, Some(gesture)) => {
            let [Some(a), Some(b)] = [gesture.line.first(), gesture.line.get(1)] else { return };
            let rect = Rect::from_two_pos(*a, *b);
            painter.rect_filled(rect, 0.0, Color32::from_white_alpha(24));
            for stroke in strokes() {
                painter.rect_stroke(rect, 0.0, stroke, StrokeKind::Middle);
            }
        }
        (HandMode::Lasso, Some(gesture)) => {
            for stroke in strokes() {
                painter.add(Shape::closed_line(gesture.line.clone(), stroke));
            }
        }
        (HandMode::Brush | HandMode::Tool(_), _) => {
            let Some(at) = pointer else { return };
            let Some(rect) = rects.iter().find(|rect| rect.contains(at)) else { return };
            let on_surface = gesture.is_some() || window.views.pointer_position.is_some();
            let radius = hands.radius * rect.height();
            for stroke in strokes() {
                // Beside the cloud it is faint: nothing would be painted there.
                let color =
                    if on_surface { stroke.color } else { stroke.color.gamma_multiply(0.4) };
                painter.circle_stroke(at, radius, Stroke { color, ..stroke });
            }
        }
        _ => {}
    }
}
