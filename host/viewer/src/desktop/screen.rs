//! The window stays within its screen, with the frame that the desktop puts around it.

use eframe::egui::{Context, Id, Pos2, Vec2, ViewportCommand, vec2};

/// Shrinks a new window that is larger than its screen.
pub(crate) fn fit(ctx: &Context) {
    let id = Id::unique("the window was fitted");
    if ctx.data(|data| data.get_temp(id)).unwrap_or(false) {
        return;
    }
    let (monitor, outer, inner) = ctx.input(|input| {
        let viewport = input.viewport();
        (viewport.monitor_size, viewport.outer_rect, viewport.inner_rect)
    });
    // The desktop tells them after some frames.
    let (Some(monitor), Some(outer), Some(inner)) = (monitor, outer, inner) else { return };
    if outer.size() == inner.size() && outer.width() <= monitor.x && ctx.cumulative_frame_nr() < 8 {
        // Its frame may still come.
        ctx.request_repaint();
        return;
    }
    ctx.data_mut(|data| data.insert_temp(id, true));
    if let Some(size) = fitted(monitor, outer.size(), inner.size()) {
        ctx.send_viewport_cmd(ViewportCommand::InnerSize(size));
        ctx.send_viewport_cmd(ViewportCommand::OuterPosition(Pos2::ZERO));
    }
}

/// The inner size by which a window with its frame fits into a screen; `None` where it does.
fn fitted(monitor: Vec2, outer: Vec2, inner: Vec2) -> Option<Vec2> {
    let over = vec2((outer.x - monitor.x).max(0.0), (outer.y - monitor.y).max(0.0));
    (over != Vec2::ZERO && monitor.min_elem() > 0.0).then(|| (inner - over).max(vec2(320.0, 240.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_shrunk_by_what_does_not_fit() {
        let (monitor, frame) = (vec2(1280.0, 720.0), vec2(2.0, 24.0));
        let inner = vec2(1280.0, 800.0);
        let size = fitted(monitor, inner + frame, inner).unwrap();
        assert_eq!(size + frame, monitor);
        assert_eq!(fitted(monitor, size + frame, size), None);
        assert_eq!(fitted(Vec2::ZERO, inner, inner), None);
    }
}
