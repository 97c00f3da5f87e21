//! The line between two pictures, with a handle to drag.

use crate::document::{Mode, PaneSettings};
use crate::theme::{Icon, ON_OVERLAY, tokens};
use crate::window::Window;
use eframe::egui::{
    Align2, Color32, CursorIcon, FontId, Key, Painter, Rect, Sense, Stroke, Ui, WidgetInfo, pos2,
    vec2,
};

/// Half the width of what the pointer hits, and the radius of the handle.
const REACH: f32 = 8.0;
const HANDLE: f32 = 15.0;

/// A press of an arrow key, share of the width.
const STEP: f32 = 0.02;

/// Shows the line of a view's wipe; returns whether it is dragged.
pub(super) fn show(
    window: &mut Window,
    ui: &Ui,
    painter: &Painter,
    rect: Rect,
    settings: &PaneSettings,
) -> bool {
    if settings.mode != Mode::Wipe || rect.width() < 1.0 {
        return false;
    }
    let line = |wipe: f32| rect.left() + wipe * rect.width();
    let x = line(settings.wipe);
    let place = Rect::from_x_y_ranges(x - REACH..=x + REACH, rect.y_range());
    // The handle is as wide as it looks.
    let knob = Rect::from_center_size(pos2(x, rect.center().y), vec2(2.0 * HANDLE, 2.0 * HANDLE));
    let id = ui.scope_id().with("wipe line");
    let bar = ui.interact(place, id, Sense::DRAG);
    let handle = ui.interact(knob, id.with("handle"), Sense::click_and_drag());
    let percent = f64::from(100.0 * settings.wipe).round();
    handle.widget_info(|| WidgetInfo::slider(true, percent, "line between the two pictures"));
    let touches = bar.hovered() || bar.dragged() || handle.hovered() || handle.dragged();
    if touches {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let is_dragged = bar.dragged() || handle.dragged();
    let at = bar.interact_pointer_pos().or(handle.interact_pointer_pos()).filter(|_| is_dragged);
    let mut wipe = at.map_or(settings.wipe, |at| (at.x - rect.left()) / rect.width());
    if handle.has_focus() {
        // The arrows move the line and not the focus.
        ui.memory_mut(|memory| {
            let filter = eframe::egui::EventFilter {
                horizontal_arrows: true,
                ..eframe::egui::EventFilter::default()
            };
            memory.set_focus_lock_filter(handle.id, filter);
        });
        let steps = ui.input(|input| {
            input.num_presses(Key::ArrowRight) as f32 - input.num_presses(Key::ArrowLeft) as f32
        });
        wipe += STEP * steps;
    }
    if handle.double_clicked() {
        wipe = 0.5;
    }
    let wipe = wipe.clamp(0.0, 1.0);
    if let Some(pane) = window.settings.pane_mut(settings.id) {
        pane.wipe = wipe;
    }
    draw(ui, painter, line(wipe), rect, touches || handle.has_focus());
    handle.on_hover_text("Drag the line; a double click puts it into the middle.");
    is_dragged
}

fn draw(ui: &Ui, painter: &Painter, x: f32, rect: Rect, touches: bool) {
    for (width, color) in [(4.0, Color32::from_black_alpha(130)), (2.0, Color32::WHITE)] {
        painter.vline(x, rect.y_range(), Stroke::new(width, color));
    }
    let middle = pos2(x, rect.center().y);
    let fill = if touches { tokens(ui).accent } else { Color32::from_black_alpha(190) };
    painter.circle(middle, HANDLE, fill, Stroke::new(2.0, Color32::WHITE));
    let icon = Icon::MoveHorizontal.unicode();
    let font = FontId::proportional(16.0);
    painter.text(middle, Align2::CENTER_CENTER, icon, font, ON_OVERLAY);
}
