//! A pane's pictures are painted, with captions, the line of a wipe and the scale of the heat map.

use crate::document::{Mode, PaneSettings};
use crate::theme::{ON_OVERLAY, OVERLAY};
use crate::views::pane::Pane;
use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, Stroke, TextureId, Ui, pos2, vec2};
use surfelshop_render::PassState;

const WHOLE: Rect = Rect { min: Pos2::ZERO, max: pos2(1.0, 1.0) };

/// Paints the pictures of a pane, with captions in their corners.
pub(crate) fn show(
    ui: &Ui,
    painter: &egui::Painter,
    pane: &mut Pane,
    settings: &PaneSettings,
    rects: &[Rect],
) {
    let texture = |pane: &Pane, side: usize| -> Option<TextureId> {
        pane.sides[side].shown.as_ref().map(|shown| shown.texture.id())
    };
    let image = |id: Option<TextureId>, rect: Rect, part: Rect| {
        if let Some(id) = id {
            let at = |share: Pos2| rect.min + rect.size() * share.to_vec2();
            let place = Rect::from_min_max(at(part.min), at(part.max));
            painter.image(id, place, part, Color32::WHITE);
        }
    };
    let mut captions = vec![(rects[0], 0)];
    match settings.mode {
        Mode::Single => image(texture(pane, 0), rects[0], WHOLE),
        Mode::SideBySide => {
            for (side, rect) in rects.iter().enumerate() {
                image(texture(pane, side), *rect, WHOLE);
            }
            captions = rects.iter().copied().enumerate().map(|(side, rect)| (rect, side)).collect();
        }
        Mode::Wipe => {
            let cut = settings.wipe;
            image(texture(pane, 0), rects[0], Rect::from_min_max(Pos2::ZERO, pos2(cut, 1.0)));
            image(texture(pane, 1), rects[0], Rect::from_min_max(pos2(cut, 0.0), WHOLE.max));
            let x = rects[0].left() + cut * rects[0].width();
            painter.vline(x, rects[0].y_range(), Stroke::new(2.0, Color32::WHITE));
            caption(painter, rects[0].right_top(), Align2::RIGHT_TOP, &label(pane, settings, 1));
        }
        Mode::Flicker => {
            let side = usize::from(pane.flicker);
            image(texture(pane, side), rects[0], WHOLE);
            captions = vec![(rects[0], side)];
        }
        Mode::Difference => {
            let heat = pane.heat(ui.ctx()).map(|texture| texture.id());
            image(heat, rects[0], WHOLE);
            scale(painter, rects[0], pane.heat_full);
            caption(painter, rects[0].right_top(), Align2::RIGHT_TOP, &label(pane, settings, 1));
        }
    }
    for (rect, side) in captions {
        caption(painter, rect.left_top(), Align2::LEFT_TOP, &label(pane, settings, side));
    }
    if settings.mode.sides() == 2
        && let Some(difference) = pane.difference()
    {
        let text = difference.describe();
        caption(painter, rects[0].left_bottom(), Align2::LEFT_BOTTOM, &text);
    }
    let waiting = pane.sides.iter().any(|side| side.preparing.is_some());
    if waiting {
        let preparing = pane.sides.iter().find_map(|side| side.preparing.as_deref());
        let text = format!("preparing {} …", preparing.unwrap_or_default());
        caption(painter, rects[0].center(), Align2::CENTER_CENTER, &text);
    }
}

/// The caption of a side: renderer, time and state.
fn label(pane: &Pane, settings: &PaneSettings, side: usize) -> String {
    let state = &pane.sides[side];
    let Some(shown) = &state.shown else {
        return settings.renderers[side].clone();
    };
    let detail = if shown.rendered.is_full() {
        String::new()
    } else {
        format!(", {}", shown.rendered.describe_detail())
    };
    // The time does not contain passes that were kept from another view or renderer.
    let n_reused =
        shown.rendered.passes.iter().filter(|pass| pass.state == PassState::Reused).count();
    let reused = match n_reused {
        0 => String::new(),
        1 => ", 1 pass reused".to_owned(),
        n => format!(", {n} passes reused"),
    };
    let (n_frames, milliseconds) = (shown.rendered.n_frames, shown.rendered.milliseconds);
    let frame = match (shown.rendered.samples, shown.rendered.refines && state.works()) {
        ([0, _], true) if n_frames > 1 => format!(", frame {n_frames}"),
        ([0, _], _) => String::new(),
        ([n, wanted], true) => format!(", {n} of {wanted} samples"),
        ([n, _], false) if n > 1 => format!(", {n} samples"),
        _ => String::new(),
    };
    let traced = shown.rendered.traced.as_ref().map(|traced| format!(", {}", traced.describe()));
    let traced = traced.unwrap_or_default();
    format!("{}  {milliseconds:.0} ms{reused}{detail}{frame}{traced}", shown.renderer)
}

fn caption(painter: &egui::Painter, at: Pos2, align: Align2, text: &str) {
    let away = vec2(8.0 * -align.x().to_sign(), 6.0 * -align.y().to_sign());
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = align.anchor_size(at + away, galley.size());
    painter.rect_filled(rect.expand2(vec2(6.0, 3.0)), 4.0, OVERLAY);
    painter.galley(rect.min, galley, ON_OVERLAY);
}

/// The scale of the heat map, along the right edge.
fn scale(painter: &egui::Painter, rect: Rect, full: f32) {
    let bar = Rect::from_min_size(
        pos2(rect.right() - 30.0, rect.top() + 30.0),
        vec2(14.0, (rect.height() - 60.0).clamp(20.0, 200.0)),
    );
    let steps = 64;
    for i in 0..steps {
        let share = 1.0 - (i as f32 + 0.5) / steps as f32;
        let height = bar.height() / steps as f32;
        let min = pos2(bar.left(), bar.top() + i as f32 * height);
        let part = Rect::from_min_size(min, vec2(bar.width(), height + 0.5));
        painter.rect_filled(part, 0.0, crate::views::compare::heat(share));
    }
    painter.rect_stroke(bar, 0.0, Stroke::new(1.0, Color32::GRAY), egui::StrokeKind::Outside);
    let levels = format!("{:.0} levels of 255", full * 255.0);
    caption(painter, bar.left_top(), Align2::RIGHT_TOP, &levels);
    caption(painter, bar.left_bottom(), Align2::RIGHT_BOTTOM, "0");
}
