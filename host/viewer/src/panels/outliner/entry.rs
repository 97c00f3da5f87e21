//! A row of the outliner: an icon or a small picture, a name, a note and an eye.

use crate::theme::{Icon, space, tokens};
use eframe::egui::epaint::RectShape;
use eframe::egui::text::CCursorRange;
use eframe::egui::{
    Align2, Color32, CursorIcon, FontId, Galley, Key, Pos2, Rect, Response, Role, Sense, TextEdit,
    TextStyle, TextureId, Ui, WidgetInfo, pos2, vec2,
};
use std::sync::Arc;

/// Height of a row, and of one with a picture.
const ROW: f32 = 24.0;
const PICTURE_ROW: f32 = 38.0;

/// Width of the eye at the right, and of the icon at the left.
const EYE: f32 = 24.0;
const ICON: f32 = 22.0;

/// What a row shows.
pub(super) struct Entry<'a> {
    pub(super) icon: Icon,
    pub(super) name: &'a str,
    /// At the right, of less importance.
    pub(super) note: &'a str,
    pub(super) about: String,
    pub(super) is_selected: bool,
    /// Whether it is shown, where that can be changed.
    pub(super) eye: Option<bool>,
    pub(super) picture: Option<TextureId>,
    /// Whether the note is a warning.
    pub(super) warns: bool,
}

impl<'a> Entry<'a> {
    pub(super) fn new(icon: Icon, name: &'a str) -> Self {
        let (note, about, is_selected, eye, picture) = ("", String::new(), false, None, None);
        Self { icon, name, note, about, is_selected, eye, picture, warns: false }
    }
}

/// What happened to a row.
pub(super) struct RowResponse {
    pub(super) row: Response,
    /// Whether the eye was clicked.
    pub(super) eye_clicked: bool,
}

/// Shows a row.
pub(super) fn show(ui: &mut Ui, entry: &Entry<'_>) -> RowResponse {
    let tokens = tokens(ui);
    let height = if entry.picture.is_some() { PICTURE_ROW } else { ROW };
    let size = vec2(ui.available_width(), height);
    let (rect, row) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let role = Role::ListItem;
    row.widget_info(|| WidgetInfo::selected(role, true, entry.is_selected, entry.name));
    let is_over = row.hovered() || row.has_focus();
    let fill = match (entry.is_selected, is_over) {
        (true, _) => tokens.accent,
        (false, true) => tokens.hovered,
        (false, false) => Color32::TRANSPARENT,
    };
    ui.painter().rect_filled(rect, f32::from(space::CORNER), fill);
    let color = |plain: Color32| if entry.is_selected { tokens.on_accent } else { plain };
    let is_hidden = entry.eye == Some(false);
    let text = color(if is_hidden { tokens.weak } else { tokens.text });
    let mut left = rect.left() + space::SMALL;
    left += picture_or_icon(ui, entry, pos2(left, rect.center().y), text);
    let right = rect.right() - if entry.eye.is_some() { EYE } else { space::SMALL };
    let small = FontId::proportional(12.0);
    // The selected row's note is the text on its colour.
    let note_color = color(match (entry.warns, is_over) {
        (true, false) => tokens.warning,
        (_, true) => tokens.text,
        (false, false) => tokens.weak,
    });
    let note = cut(ui, entry.note, small, 0.5 * (right - left), note_color);
    let note_width = note.size().x;
    let at = pos2(right - note_width, rect.center().y - 0.5 * note.size().y);
    let place = Rect::from_min_size(at, note.size());
    ui.painter().galley(at, note, note_color);
    if !entry.note.is_empty() {
        // Read after the name.
        let note = ui.interact(place, row.id.with("note"), Sense::hover());
        note.widget_info(|| WidgetInfo::labeled(Role::Label, true, entry.note));
    }
    let room = right - note_width - left - space::SMALL;
    name(ui, entry.name, pos2(left, rect.center().y), room, text);
    let eye_clicked = entry.eye.is_some_and(|shown| {
        let at = Rect::from_min_max(pos2(rect.right() - EYE, rect.top()), rect.max);
        eye(ui, &row, at, entry.name, shown, color(tokens.weak))
    });
    if row.dragged() {
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
    }
    let row = match entry.about.is_empty() {
        true => row,
        false => row.on_hover_text(&entry.about),
    };
    RowResponse { row, eye_clicked }
}

/// What stands before the name; the width that it takes.
fn picture_or_icon(ui: &Ui, entry: &Entry<'_>, at: Pos2, color: Color32) -> f32 {
    match entry.picture {
        Some(picture) => {
            let size = vec2(48.0, 30.0);
            let place = Rect::from_min_size(at - vec2(0.0, 0.5 * size.y), size);
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            let image = RectShape::filled(place, 3.0, Color32::WHITE);
            ui.painter().add(image.with_texture(picture, whole));
            size.x + space::MEDIUM
        }
        None => {
            let font = FontId::proportional(14.0);
            let middle = at + vec2(0.5 * ICON - 2.0, 0.0);
            let icon = entry.icon.unicode();
            ui.painter().text(middle, Align2::CENTER_CENTER, icon, font, color);
            ICON + 2.0
        }
    }
}

fn name(ui: &Ui, name: &str, at: Pos2, room: f32, color: Color32) {
    let font = TextStyle::Body.resolve(ui.style());
    let galley = cut(ui, name, font, room, color);
    ui.painter().galley(at - vec2(0.0, 0.5 * galley.size().y), galley, color);
}

/// A line of text, cut with an ellipsis where it is too long.
fn cut(ui: &Ui, text: &str, font: FontId, room: f32, color: Color32) -> Arc<Galley> {
    use eframe::egui::text::{LayoutJob, TextWrapping};
    let mut job = LayoutJob::simple_singleline(text.to_owned(), font, color);
    job.wrap = TextWrapping::truncate_at_width(room.max(10.0));
    ui.painter().layout_job(job)
}

fn eye(ui: &Ui, row: &Response, at: Rect, name: &str, shown: bool, color: Color32) -> bool {
    let response = ui.interact(at, row.id.with("eye"), Sense::click());
    response
        .widget_info(|| WidgetInfo::selected(Role::CheckBox, true, shown, format!("show {name}")));
    if response.has_focus() {
        let stroke = (1.0, tokens(ui).link);
        let kind = eframe::egui::StrokeKind::Inside;
        ui.painter().rect_stroke(at, f32::from(space::CORNER), stroke, kind);
    }
    let icon = if shown { Icon::Eye } else { Icon::EyeOff };
    let font = FontId::proportional(14.0);
    ui.painter().text(at.center(), Align2::CENTER_CENTER, icon.unicode(), font, color);
    let words = if shown { "hide it" } else { "show it" };
    response.on_hover_text(words).clicked()
}

/// A line to type a name into, in place of a row; the name, once it is done, or nothing where it is given up.
pub(super) fn rename(ui: &mut Ui, typed: &mut String) -> Option<Option<String>> {
    let line = TextEdit::singleline(typed).desired_width(f32::INFINITY).show(ui);
    let (response, mut state) = (line.response.response, line.state);
    if !response.has_focus() && !response.lost_focus() {
        // What is typed takes the place of the name.
        state.cursor.set_char_range(Some(CCursorRange::select_all(&line.galley)));
        state.store(ui.ctx(), response.id);
    }
    response.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "new name"));
    if ui.input(|input| input.key_pressed(Key::Escape)) {
        return Some(None);
    }
    if response.lost_focus() {
        return Some(Some(typed.clone()));
    }
    response.request_focus();
    None
}
