//! A pane's pictures are painted, with captions, the line of a wipe and the scale of the heat map.

use crate::document::{Mode, PaneSettings};
use crate::theme::{ON_OVERLAY, OVERLAY};
use crate::views::pane::Pane;
use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, Stroke, TextureId, Ui, pos2, vec2};
use surfelshop_render::PassState;

/// Width of a view whose captions are names alone.
const NARROW: f32 = 420.0;

const WHOLE: Rect = Rect { min: Pos2::ZERO, max: pos2(1.0, 1.0) };

/// Paints the pictures of a pane, with captions in their corners. Returns where the numbers of their difference stand, and
/// these.
pub(crate) fn show(
    ui: &Ui,
    painter: &egui::Painter,
    pane: &mut Pane,
    settings: &PaneSettings,
    rects: &[Rect],
) -> Option<(Rect, String)> {
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
    let mut second = None;
    // Two captions with all numbers would lie over each other.
    let narrow = if settings.mode.sides() == 2 { NARROW } else { 0.62 * NARROW };
    let is_narrow = rects[0].width() < narrow;
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
            second = Some(label(pane, settings, 1, is_narrow));
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
            second = Some(label(pane, settings, 1, is_narrow));
        }
    }
    let mut first = Rect::NOTHING;
    for (rect, side) in captions {
        let text = label(pane, settings, side, is_narrow);
        first = caption(painter, rect.left_top(), Align2::LEFT_TOP, &text);
    }
    if let Some(text) = second {
        second_caption(painter, rects[0], first, &text);
    }
    let difference = pane.difference().filter(|_| settings.mode.sides() == 2);
    let described = difference.map(|difference| {
        let text = difference.describe();
        (caption(painter, rects[0].left_bottom(), Align2::LEFT_BOTTOM, &text), text)
    });
    let waiting = pane.sides.iter().any(|side| side.preparing.is_some());
    if waiting {
        let preparing = pane.sides.iter().find_map(|side| side.preparing.as_deref());
        let text = format!("preparing {} …", preparing.unwrap_or_default());
        caption(painter, rects[0].center(), Align2::CENTER_CENTER, &text);
    }
    described
}

/// The caption of the second picture, at the right; below the first one where both do not fit beside each other.
fn second_caption(painter: &egui::Painter, rect: Rect, first: Rect, text: &str) {
    let font = FontId::proportional(13.0);
    let width = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE).size().x;
    let is_beside = first.right() + width + 32.0 < rect.right();
    let down = if is_beside { 0.0 } else { first.height() + 4.0 };
    caption(painter, rect.right_top() + vec2(0.0, down), Align2::RIGHT_TOP, text);
}

/// The caption of a side: renderer, time and state.
fn label(pane: &Pane, settings: &PaneSettings, side: usize, is_narrow: bool) -> String {
    let state = &pane.sides[side];
    let of = settings.clouds[side].as_ref().map(|cloud| format!(": {cloud}")).unwrap_or_default();
    let shown = state.shown.as_ref().filter(|_| !is_narrow);
    let Some(shown) = shown else { return format!("{}{of}", settings.renderers[side]) };
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
    format!("{}{of}  {milliseconds:.0} ms{reused}{detail}{frame}{traced}", shown.renderer)
}

/// Words over a picture, on a dark ground; the place of that.
pub(crate) fn caption(painter: &egui::Painter, at: Pos2, align: Align2, text: &str) -> Rect {
    let away = vec2(8.0 * -align.x().to_sign(), 6.0 * -align.y().to_sign());
    let font = FontId::proportional(13.0);
    let galley = painter.layout_no_wrap(text.to_owned(), font, Color32::WHITE);
    let rect = align.anchor_size(at + away, galley.size());
    let ground = rect.expand2(vec2(6.0, 3.0));
    painter.rect_filled(ground, 4.0, OVERLAY);
    painter.galley(rect.min, galley, ON_OVERLAY);
    ground
}

/// The scale of the heat map, along the right edge.
fn scale(painter: &egui::Painter, rect: Rect, full: f32) {
    // Below the axes.
    let top = if rect.height() > 400.0 { 130.0 } else { 30.0 };
    let bar = Rect::from_min_size(
        pos2(rect.right() - 30.0, rect.top() + top),
        vec2(14.0, (rect.height() - top - 30.0).clamp(20.0, 200.0)),
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
