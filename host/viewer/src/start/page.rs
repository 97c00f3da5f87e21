//! The start page: open, examples, and recent files.

use super::examples::Example;
use crate::commands::{self, find};
use crate::theme::{Icon, icon_text, iconed_in, space, tokens};
use crate::window::Window;
use eframe::egui::epaint::RectShape;
use eframe::egui::{
    Align, Align2, Button, Color32, FontId, Frame, Label, Layout, Pos2, Rect, Response, RichText,
    Role, ScrollArea, Sense, Stroke, StrokeKind, TextureHandle, Ui, UiBuilder, WidgetInfo, pos2,
    vec2,
};
use std::path::{Path, PathBuf};

/// Width of the page, and the height of a card and of a row.
const WIDTH: f32 = 680.0;
const CARD: f32 = 92.0;
const ROW: f32 = 46.0;

/// Width of the small picture in a row.
const PICTURE: f32 = 61.0;

/// Most recent files on the page; the menu has all.
const MOST_RECENT: usize = 6;

impl Window {
    /// Whether the start page is shown: where nothing is open, or because the user asked for it.
    pub(crate) fn shows_start_page(&self) -> bool {
        self.document.loader.is_none() && (self.panels.start_page || self.document.clouds.is_none())
    }
}

/// Shows the page in the middle of the window.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let fill = tokens(ui).panel;
    Frame::new().fill(fill).show(ui, |ui| {
        let room = ui.available_size();
        ui.set_min_size(room);
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let side = (0.5 * (room.x - WIDTH)).max(space::LARGE);
            let rows = window.document.recent.len().min(MOST_RECENT) as f32;
            let top = (0.38 * (room.y - 330.0 - rows * ROW)).max(space::LARGE);
            ui.add_space(top);
            ui.horizontal(|ui| {
                ui.add_space(side);
                ui.vertical(|ui| {
                    ui.set_width((room.x - 2.0 * side).min(WIDTH));
                    contents(window, ui);
                });
            });
            ui.add_space(space::LARGE);
        });
    });
}

fn contents(window: &mut Window, ui: &mut Ui) {
    let tokens = tokens(ui);
    ui.label(RichText::new("Surfelshop").size(30.0).color(tokens.strong));
    ui.label(
        RichText::new("Look at point clouds and splats, by the renderer you choose.")
            .color(tokens.weak),
    );
    ui.add_space(space::LARGE);
    ui.horizontal(|ui| {
        let label = iconed_in(ui, Icon::FolderOpen, "Open files …", tokens.on_accent);
        let open = Button::new(label).fill(tokens.accent);
        if ui.add(open.min_size(vec2(140.0, 34.0))).clicked()
            && let Some(command) = find("open")
        {
            commands::run(window, &ui.ctx().clone(), command);
        }
        ui.label(
            RichText::new("or drop them here: scans, splats, scenes, light probes")
                .color(tokens.weak),
        );
    });
    ui.add_space(space::LARGE);
    ui.strong("Examples");
    examples(window, ui);
    recent(window, ui);
    ui.add_space(space::LARGE);
    let shortcut = |id: &str| {
        let keys = find(id).map(|command| commands::shortcuts(window, command)).unwrap_or_default();
        keys.into_iter().next().unwrap_or_else(|| "the menu".to_owned())
    };
    ui.label(
        RichText::new(format!(
            "{} finds every command, {} lists mouse and keys.",
            shortcut("all-commands"),
            shortcut("keys")
        ))
        .color(tokens.weak),
    );
}

fn examples(window: &mut Window, ui: &mut Ui) {
    let width = (ui.available_width() - 2.0 * space::MEDIUM) / 3.0;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = space::MEDIUM;
        for example in Example::ALL {
            let (icon, name, about) = example.words();
            if card(ui, width, icon, name, about).clicked() {
                example.open(window, &ui.ctx().clone());
            }
        }
    });
}

fn card(ui: &mut Ui, width: f32, icon: Icon, name: &str, about: &str) -> Response {
    let tokens = tokens(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(width, CARD), Sense::click());
    let is_over = response.hovered() || response.has_focus();
    let line = if is_over { tokens.link } else { tokens.border };
    ui.painter().rect(rect, 8.0, tokens.raised, Stroke::new(1.0, line), StrokeKind::Inside);
    let mut inner = ui.new_child(
        UiBuilder::new().max_rect(rect.shrink(12.0)).layout(Layout::top_down(Align::Min)),
    );
    let label = |text: RichText| Label::new(text).selectable(false);
    inner.set_width(width - 24.0);
    inner.horizontal(|ui| {
        ui.add(label(icon_text(icon).size(20.0).color(tokens.link)));
        ui.add(label(RichText::new(name).size(15.0).color(tokens.strong)));
    });
    inner.add(label(RichText::new(about).color(tokens.weak)).wrap());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Example: {name}")));
    response
}

fn recent(window: &mut Window, ui: &mut Ui) {
    let files: Vec<PathBuf> = window.document.recent.iter().take(MOST_RECENT).cloned().collect();
    if files.is_empty() {
        return;
    }
    ui.add_space(space::LARGE);
    ui.strong("Recent");
    let mut chosen = None;
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 2.0;
        for file in &files {
            let folder = window.document.state_folder.as_ref();
            let picture = window.panels.thumbnails.of(ui.ctx(), folder, file);
            if row(ui, file, picture.as_ref()).clicked() {
                chosen = Some(file.clone());
            }
        }
    });
    if let Some(file) = chosen {
        window.open(&ui.ctx().clone(), vec![file]);
    }
}

fn row(ui: &mut Ui, file: &Path, picture: Option<&TextureHandle>) -> Response {
    let tokens = tokens(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let is_over = response.hovered() || response.has_focus();
    if is_over {
        ui.painter().rect_filled(rect, f32::from(space::CORNER), tokens.hovered);
    }
    let corner = rect.min + vec2(space::SMALL, space::SMALL);
    let small = Rect::from_min_size(corner, vec2(PICTURE, ROW - 2.0 * space::SMALL));
    match picture {
        Some(picture) => {
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            let image = RectShape::filled(small, 4.0, Color32::WHITE);
            ui.painter().add(image.with_texture(picture.id(), whole));
        }
        None => {
            ui.painter().rect_filled(small, 4.0, tokens.raised);
            let (icon, font) = (Icon::FileBox.unicode(), FontId::proportional(18.0));
            ui.painter().text(small.center(), Align2::CENTER_CENTER, icon, font, tokens.weak);
        }
    }
    let words = Rect::from_min_max(pos2(small.right() + space::MEDIUM, rect.top() + 6.0), rect.max);
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let folder = file.parent().map(|folder| folder.display().to_string()).unwrap_or_default();
    let label = |text: RichText| Label::new(text).selectable(false).truncate();
    let layout = Layout::top_down(Align::Min);
    let mut inner = ui.new_child(UiBuilder::new().max_rect(words).layout(layout));
    inner.spacing_mut().item_spacing.y = 1.0;
    inner.add(label(RichText::new(&name).color(tokens.text)));
    let weak = if is_over { tokens.text } else { tokens.weak };
    inner.add(label(RichText::new(folder).color(weak).small()));
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Open {name}")));
    response
}
