//! The axes in a corner: a click looks along one, a drag turns.

use super::AxesInteraction;
use super::standard_views::StandardView;
use crate::theme::AXES;
use crate::views::navigation;
use crate::window::Window;
use eframe::egui::{
    Align2, Color32, CursorIcon, FontId, Painter, Pos2, Rect, Role, Sense, Stroke, Ui, Vec2,
    WidgetInfo, vec2,
};
use glam::{DVec2, DVec3};
use surfelshop_api::Camera;
use surfelshop_session::options::UpAxis;

/// Half the width of all, the length of an axis, and the radius of its end, points of the screen.
const HALF: f32 = 40.0;
const LENGTH: f32 = 28.0;
const END: f32 = 8.5;

/// An end of an axis.
struct End {
    axis: usize,
    is_positive: bool,
    /// From the middle, points of the screen.
    offset: Vec2,
    /// Towards the eye.
    nearness: f64,
}

/// The ends, the farthest first.
fn ends(camera: &Camera) -> Vec<End> {
    let view_from_world = camera.view_from_world();
    let mut ends: Vec<End> = (0..6)
        .map(|i| {
            let (axis, is_positive) = (i % 3, i < 3);
            let direction = DVec3::AXES[axis] * if is_positive { 1.0 } else { -1.0 };
            let seen = view_from_world * direction;
            let offset = vec2(seen.x as f32, -seen.y as f32) * LENGTH;
            End { axis, is_positive, offset, nearness: seen.z }
        })
        .collect();
    ends.sort_by(|a, b| a.nearness.total_cmp(&b.nearness));
    ends
}

/// The side of the scene that an end points to.
fn side_of(end: &End, up: UpAxis) -> StandardView {
    let direction = DVec3::AXES[end.axis] * if end.is_positive { 1.0 } else { -1.0 };
    let along = |view: &StandardView| view.towards_camera(up).dot(direction);
    let best = StandardView::SIDES.into_iter().max_by(|a, b| along(a).total_cmp(&along(b)));
    best.unwrap_or(StandardView::Front)
}

/// Shows the axes in the right upper corner of a picture.
pub(super) fn show(window: &mut Window, ui: &Ui, pane: u32, rect: Rect) -> AxesInteraction {
    let mut interaction = AxesInteraction::default();
    if rect.width() < 4.0 * HALF || rect.height() < 4.0 * HALF {
        return interaction;
    }
    // Below the captions.
    let middle = rect.right_top() + vec2(-HALF - 6.0, HALF + 32.0);
    let painter = ui.painter_at(rect);
    let camera = window.camera_of(pane);
    let id = ui.scope_id().with("axes");
    let whole = Rect::from_center_size(middle, Vec2::splat(2.0 * HALF));
    let turns = ui.interact(whole, id, Sense::drag());
    turns.widget_info(|| WidgetInfo::labeled(Role::Unknown, true, "axes"));
    interaction.dragged = turns.dragged();
    interaction.hovered = turns.hover_pos();
    if turns.hovered() || turns.dragged() {
        painter.circle_filled(middle, HALF, Color32::from_black_alpha(110));
        ui.ctx().set_cursor_icon(CursorIcon::Grab);
    }
    if turns.dragged() {
        let drag = turns.drag_delta() / (2.0 * HALF);
        let mut turned = camera;
        // A drag over the axes is half a turn.
        let drag = DVec2::new(f64::from(drag.x), f64::from(drag.y)) * std::f64::consts::PI;
        navigation::orbit(&mut turned, drag);
        window.views.flight = None;
        window.set_camera(pane, turned);
    }
    for end in ends(&camera) {
        let place = middle + end.offset;
        let side = side_of(&end, window.document.up);
        let hit = Rect::from_center_size(place, Vec2::splat(2.0 * END));
        let click = ui.interact(hit, id.with((end.axis, end.is_positive)), Sense::click());
        let name = format!("view from the {}", side.name()).replace("the below", "below");
        click.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        if let Some(over) = click.hover_pos() {
            interaction.hovered = Some(over);
        }
        draw(&painter, middle, place, &end, click.hovered());
        let axis = ["x", "y", "z"][end.axis];
        let sign = if end.is_positive { "" } else { "-" };
        if click.on_hover_text(format!("{name} ({sign}{axis})")).clicked() {
            window.views.focused = pane;
            window.look_from(side);
        }
    }
    interaction
}

fn draw(painter: &Painter, middle: Pos2, place: Pos2, end: &End, is_hovered: bool) {
    let color = AXES[end.axis];
    // What points away is dimmer.
    let strength = 0.55 + 0.45 * ((end.nearness as f32) * 0.5 + 0.5);
    let color = color.gamma_multiply(strength.clamp(0.0, 1.0));
    if end.is_positive {
        painter.line_segment([middle, place], Stroke::new(2.0, color));
        painter.circle_filled(place, END, color);
        let letter = ["x", "y", "z"][end.axis];
        let dark = Color32::from_gray(12);
        painter.text(place, Align2::CENTER_CENTER, letter, FontId::proportional(12.0), dark);
    } else {
        painter.circle_filled(place, END - 2.5, color.gamma_multiply(0.35));
        painter.circle_stroke(place, END - 2.5, Stroke::new(1.2, color));
    }
    if is_hovered {
        painter.circle_stroke(place, END + 1.0, Stroke::new(1.5, Color32::WHITE));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::Projection;
    use surfelshop_cloud::scene::Axis;

    #[test]
    fn the_end_that_is_clicked_is_the_one_that_comes_to_the_front() {
        let projection = Projection::Perspective { fov_y: 0.6 };
        let camera = Camera {
            eye: DVec3::new(3.0, 2.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection,
        };
        for up in Axis::ALL.map(UpAxis::from) {
            for end in ends(&camera) {
                let moved = side_of(&end, up).camera(&camera, up);
                let nearest = ends(&moved).pop().unwrap();
                assert_eq!((nearest.axis, nearest.is_positive), (end.axis, end.is_positive));
                assert!(nearest.offset.length() < 0.1, "{:?}", nearest.offset);
            }
        }
    }
}
