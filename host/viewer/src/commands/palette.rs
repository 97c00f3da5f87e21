//! The command palette: commands, tools, renderers, what colours surfels, and recent files are found by words.

use super::command::{Command, Menu, run, shortcuts, why_not};
use super::search::score;
use super::table::COMMANDS;
use crate::dialogs::{DialogPurpose, files};
use crate::panels::{Selection, color_choices};
use crate::plugins::tool_window;
use crate::theme::{Icon, icon_text, space, tokens};
use crate::window::Window;
use eframe::egui::{
    self, Align, Align2, Context, Id, Key, Layout, Modal, Modifiers, Response, RichText,
    ScrollArea, Sense, TextEdit, Ui, WidgetInfo, vec2,
};
use std::path::PathBuf;
use surfelshop_api::UnitKind;
use surfelshop_cloud::display::{ColorBy, ColorSource};

const WIDTH: f32 = 560.0;
const ROW: f32 = 28.0;

/// What a row does.
#[derive(Clone)]
pub(crate) enum Action {
    Command(&'static Command),
    Tool(String),
    Renderer(String),
    Color(ColorBy),
    SaveCloud(usize),
    OpenFile(PathBuf),
}

/// A row.
#[derive(Clone)]
pub(crate) struct Entry {
    icon: Icon,
    pub(crate) name: String,
    about: String,
    /// What stands at the right: the shortcut, or the kind.
    note: String,
    /// Why it cannot be used now.
    pub(crate) reason: Option<&'static str>,
    action: Action,
}

/// Everything that can be found, commands first.
pub(crate) fn entries(window: &Window) -> Vec<Entry> {
    let commands = COMMANDS.iter().filter(|command| !stands_for_rows(window, command));
    let commands = commands.map(|command| Entry {
        icon: command.icon,
        name: name_alone(command),
        about: command.about.to_owned(),
        note: shortcuts(window, command).into_iter().next().unwrap_or_default(),
        reason: why_not(window, command),
        action: Action::Command(command),
    });
    let entry = |icon, name, about: String, note: &str, action| Entry {
        icon,
        name,
        about,
        note: note.to_owned(),
        reason: None,
        action,
    };
    let tools = window.plugins.registry.names(UnitKind::Tool).into_iter().filter_map(|name| {
        let (title, summary) = tool_window::title_and_summary(window, &name)?;
        let kind = if window.is_led_by_hand(&name) { "led by hand" } else { "tool" };
        Some(entry(Icon::Hammer, format!("{title} …"), summary, kind, Action::Tool(name)))
    });
    let renderers = window.drawers().into_iter().map(|name| {
        let about = "Draws the focused view by this renderer.".to_owned();
        entry(Icon::Layers, format!("Renderer {name}"), about, "renderer", Action::Renderer(name))
    });
    let open = window.document.clouds.iter();
    let colors = open.clone().flat_map(|shown| color_choices(&shown.open_clouds.clouds));
    let colors = colors.map(|(name, by)| {
        let about = "Colours the surfels of all clouds.".to_owned();
        entry(Icon::Palette, format!("Colour by {name}"), about, "colour", Action::Color(by))
    });
    let clouds = open.flat_map(|shown| shown.open_clouds.all());
    let clouds = clouds.enumerate().map(|(i, cloud)| {
        let name = format!("Save cloud {} as …", cloud.name());
        entry(Icon::FileDown, name, String::new(), "cloud", Action::SaveCloud(i))
    });
    let recent = window.document.recent.iter().map(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let about = path.display().to_string();
        entry(Icon::FileBox, format!("Open {name}"), about, "file", Action::OpenFile(path.clone()))
    });
    commands.chain(tools).chain(renderers).chain(colors).chain(clouds).chain(recent).collect()
}

/// Whether a command only opens the palette, for each cloud has a row there.
fn stands_for_rows(window: &Window, command: &Command) -> bool {
    let n_clouds = window.document.clouds.as_ref().map_or(0, |shown| shown.open_clouds.all().len());
    command.id == "save-cloud" && n_clouds > 1 && !matches!(window.selection(), Selection::Cloud(_))
}

/// What a command is called outside its menu.
pub(crate) fn name_alone(command: &Command) -> String {
    match command.menu {
        Menu::Look => format!("Look: {}", command.name),
        _ => command.name.to_owned(),
    }
}

/// The rows for some words, the best first.
fn found(window: &Window, typed: &str) -> Vec<Entry> {
    let scored = entries(window)
        .into_iter()
        .filter_map(|entry| Some((score(typed, &entry.name, &entry.about)?, entry)));
    let mut scored: Vec<(u32, Entry)> = scored.collect();
    // What cannot be used now stands behind what is found as well.
    scored.sort_by_key(|(score, entry)| std::cmp::Reverse((*score, entry.reason.is_none())));
    scored.into_iter().map(|(_, entry)| entry).collect()
}

/// Shows the palette if it is open.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    if !window.panels.palette.open {
        return;
    }
    let [up, down, enter] = [Key::ArrowUp, Key::ArrowDown, Key::Enter]
        .map(|key| ctx.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key)));
    let mut palette = std::mem::take(&mut window.panels.palette);
    let id = Id::unique("palette");
    let area = Modal::default_area(id).anchor(Align2::CENTER_TOP, vec2(0.0, 72.0));
    let mut chosen = None;
    let shown = Modal::new(id).area(area).show(ctx, |ui| {
        ui.set_width(WIDTH.min(ui.ctx().content_rect().width() - 48.0));
        let field = TextEdit::singleline(&mut palette.typed).hint_text("Type what you want to do");
        let field = ui.add(field.desired_width(f32::INFINITY));
        field.widget_info(|| WidgetInfo::labeled(egui::Role::TextInput, true, "Search commands"));
        field.request_focus();
        if field.changed() {
            palette.row = 0;
        }
        let rows = found(window, &palette.typed);
        palette.row = (palette.row + down).saturating_sub(up).min(rows.len().saturating_sub(1));
        if enter > 0 {
            chosen = rows.get(palette.row).cloned();
        }
        if rows.is_empty() {
            ui.add_space(space::SMALL);
            ui.weak("Nothing is called that.");
        }
        let moved = up + down > 0 || field.changed();
        if let Some(row) = list(ui, &rows, palette.row, moved) {
            chosen = rows.get(row).cloned();
        }
    });
    let runs = chosen.as_ref().is_some_and(|entry| entry.reason.is_none());
    palette.open = !(shown.should_close() || runs);
    // Where it does not apply, the row says why.
    if let Some(entry) = chosen.filter(|_| runs) {
        act(window, ctx, entry.action);
    }
    // What was run may have opened it anew.
    if !window.panels.palette.open {
        window.panels.palette = palette;
    }
}

/// The rows; the one that was clicked.
fn list(ui: &mut Ui, rows: &[Entry], chosen: usize, scrolls: bool) -> Option<usize> {
    let mut clicked = None;
    let height = (ui.ctx().content_rect().height() - 220.0).clamp(3.0 * ROW, 12.0 * ROW);
    // The window around it has the height of the frame before, which may have had no rows.
    let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height);
    area.auto_shrink([false, true]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 0.0;
        for (i, entry) in rows.iter().enumerate() {
            let response = row(ui, entry, i == chosen);
            if response.clicked() {
                clicked = Some(i);
            }
            if i == chosen && scrolls {
                response.scroll_to_me(None);
            }
        }
    });
    clicked
}

fn row(ui: &mut Ui, entry: &Entry, is_chosen: bool) -> Response {
    let tokens = tokens(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let applies = entry.reason.is_none();
    let (fill, text, weak) = match (is_chosen, response.hovered()) {
        (true, _) => (tokens.accent, tokens.on_accent, tokens.on_accent),
        (false, true) => (tokens.hovered, tokens.strong, tokens.text),
        (false, false) => (tokens.raised, tokens.text, tokens.weak),
    };
    ui.painter().rect_filled(rect, f32::from(space::CORNER), fill);
    let text = if applies { text } else { weak };
    let mut inner = ui.new_child(
        egui::UiBuilder::new()
            .max_rect(rect.shrink2(vec2(space::MEDIUM, 0.0)))
            .layout(Layout::right_to_left(Align::Center)),
    );
    let note = match entry.reason {
        Some(reason) => format!("not now: {reason}"),
        None => entry.note.clone(),
    };
    let label = |text: RichText| egui::Label::new(text).selectable(false).truncate();
    let name_width = (rect.width() * if applies { 0.7 } else { 0.4 }).max(120.0);
    let room = rect.width() - name_width - 2.0 * space::MEDIUM;
    inner.scope(|ui| {
        ui.set_max_width(room);
        ui.add(label(RichText::new(note).color(weak).small()));
    });
    inner.with_layout(Layout::left_to_right(Align::Center), |ui| {
        ui.add(label(icon_text(entry.icon).color(text)));
        ui.add(label(RichText::new(&entry.name).color(text)));
    });
    response.widget_info(|| WidgetInfo::labeled(egui::Role::ListItem, applies, &entry.name));
    response.on_hover_text(&entry.about)
}

fn act(window: &mut Window, ctx: &Context, action: Action) {
    match action {
        Action::Command(command) => run(window, ctx, command),
        Action::Tool(name) => tool_window::choose(window, &name),
        Action::Renderer(name) => {
            if let Some(pane) = window.settings.pane_mut(window.views.focused) {
                pane.renderers[0] = name;
            }
        }
        Action::Color(by) => window.settings.color = ColorSource::new(by),
        Action::SaveCloud(index) => files::open(window, ctx, DialogPurpose::SaveCloud(index)),
        Action::OpenFile(path) => window.open(ctx, vec![path]),
    }
}
