//! A value of a sweep as a card: its picture, error and time.

use crate::theme::{space, tokens};
use eframe::egui::epaint::RectShape;
use eframe::egui::{
    Align2, Color32, FontId, Pos2, Rect, Response, Role, Sense, Stroke, StrokeKind, TextureId, Ui,
    WidgetInfo, pos2, vec2,
};

/// Width and height of a card, and of its picture.
const CARD: [f32; 2] = [96.0, 152.0];
const PICTURE: [f32; 2] = [88.0, 55.0];

/// What a card shows.
pub(super) struct Card<'a> {
    pub(super) picture: Option<TextureId>,
    pub(super) title: &'a str,
    pub(super) lines: [String; 3],
    /// What it is the best in.
    pub(super) mark: String,
    /// Whether the view has this value.
    pub(super) is_chosen: bool,
}

impl Card<'_> {
    pub(super) fn show(&self, ui: &mut Ui) -> Response {
        let tokens = tokens(ui);
        let (rect, response) = ui.allocate_exact_size(CARD.into(), Sense::click());
        let is_over = response.hovered() || response.has_focus();
        let line = if is_over || self.is_chosen { tokens.link } else { tokens.border };
        let fill = if self.is_chosen { tokens.pressed } else { tokens.raised };
        let painter = ui.painter_at(rect);
        painter.rect(
            rect,
            f32::from(space::CORNER),
            fill,
            Stroke::new(1.0, line),
            StrokeKind::Inside,
        );
        let corner = rect.min + vec2(space::SMALL, space::SMALL);
        let place = Rect::from_min_size(corner, PICTURE.into());
        match self.picture {
            Some(picture) => {
                let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
                let image = RectShape::filled(place, 3.0, Color32::WHITE);
                painter.add(image.with_texture(picture, whole));
            }
            None => drop(painter.rect_filled(place, 3.0, tokens.field)),
        }
        let mut at = pos2(corner.x + 2.0, place.bottom() + space::SMALL);
        let text = |at: Pos2, text: &str, size: f32, color: Color32| {
            let font = FontId::proportional(size);
            painter.text(at, Align2::LEFT_TOP, text, font, color);
        };
        text(at, self.title, 14.0, tokens.strong);
        at.y += 19.0;
        for one in &self.lines {
            text(at, one, 12.0, tokens.text);
            at.y += 15.0;
        }
        text(at, &self.mark, 11.0, tokens.link);
        let name = format!("{}: {}", self.title, self.lines.join(", "));
        let is_chosen = self.is_chosen;
        response.widget_info(|| WidgetInfo::selected(Role::Button, true, is_chosen, &name));
        response
    }
}
