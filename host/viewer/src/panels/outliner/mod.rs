//! What the scene consists of: clouds, lights, the light around it, cameras and views, and the renderers that can be
//! dragged onto a view.

mod entry;
mod lists;
mod pictures;

pub(crate) use pictures::BookmarkPictures;

use super::Selection;
use crate::commands::{self, find};
use crate::theme::{Icon, icon_text, tokens};
use crate::window::Window;
use eframe::egui::containers::menu::MenuButton;
use eframe::egui::{
    Align, Button, CollapsingHeader, Layout, Response, RichText, Role, Stroke, Ui, WidgetInfo,
};
use entry::Entry;

/// What is dragged out of the outliner.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Dragged {
    /// A renderer, by its name: onto a view.
    Renderer(String),
    /// A light, by its index: to another place of the list.
    Light(usize),
    /// A remembered camera, by its index: to another place of the list, or onto a view.
    Bookmark(usize),
}

/// Shows the lists.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    ui.spacing_mut().item_spacing.y = 1.0;
    let adds = if window.document.clouds.is_some() { "add" } else { "open" };
    group(window, ui, "Clouds", &[adds], lists::clouds);
    group(window, ui, "Lights", &ADDS_LIGHTS, lists::lights);
    group(window, ui, "Cameras", &["remember-camera"], lists::cameras);
    group(window, ui, "Measures", &["measure-distance"], lists::measures);
    group(window, ui, "Views", &["split"], lists::views);
    group(window, ui, "Renderers", &[], lists::renderers);
}

/// The commands that add lights.
const ADDS_LIGHTS: [&str; 3] = ["add-light", "add-point-light", "add-spot-light"];

/// A list with its title, and the commands that add to it: behind a menu where there are several.
fn group(
    window: &mut Window,
    ui: &mut Ui,
    title: &str,
    adds: &[&str],
    contents: impl FnOnce(&mut Window, &mut Ui),
) {
    let top = ui.cursor().top();
    let text = RichText::new(title).strong();
    let header = CollapsingHeader::new(text).id_salt(("outliner", title)).default_open(true);
    header.show_unindented(ui, |ui| {
        contents(window, ui);
        ui.add_space(6.0);
    });
    let Some(command) = adds.first().and_then(|id| find(id)) else { return };
    // At the right end of the title.
    let right = ui.max_rect().right();
    let place = eframe::egui::Rect::from_min_size(
        eframe::egui::pos2(right - 26.0, top),
        eframe::egui::vec2(24.0, 22.0),
    );
    let mut over = ui.new_child(
        eframe::egui::UiBuilder::new()
            .max_rect(place)
            .layout(Layout::right_to_left(Align::Center))
            .id_salt(("adds", title)),
    );
    if adds.len() > 1 {
        let button = Button::new(icon_text(Icon::Plus)).frame_when_inactive(false);
        let (response, _shown) = MenuButton::from_button(button).ui(&mut over, |ui| {
            for command in adds.iter().filter_map(|id| find(id)) {
                commands::menus::entry(window, ui, command);
            }
        });
        let name = format!("add to {}", title.to_lowercase());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        response.on_hover_text("Adds one of several kinds.");
        return;
    }
    let refused = commands::why_not(window, command);
    let button = Button::new(icon_text(command.icon)).frame_when_inactive(false);
    let response = over.add_enabled(refused.is_none(), button);
    let enabled = refused.is_none();
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, command.name));
    let about = match refused {
        None => command.about.to_owned(),
        Some(reason) => format!("{}\nNot now: {reason}.", command.name),
    };
    if response.on_hover_text(&about).on_disabled_hover_text(&about).clicked() {
        commands::run(window, &ui.ctx().clone(), command);
    }
}

/// Shows the row of a part: a click selects it, a double click does `activate`, and the other button of the mouse opens a
/// menu of commands. A row that is being renamed is a line of text.
fn part(
    window: &mut Window,
    ui: &mut Ui,
    selection: Selection,
    entry: &Entry<'_>,
    menu: &[&str],
) -> Option<PartResponse> {
    if window.panels.renaming.as_ref().is_some_and(|(renamed, _)| *renamed == selection) {
        rename(window, ui, selection);
        return None;
    }
    let shown = entry::show(ui, entry);
    if shown.row.clicked() || shown.row.secondary_clicked() || shown.row.drag_started() {
        window.select(selection);
    }
    shown.row.context_menu(|ui| {
        for id in menu {
            match find(id) {
                Some(command) => commands::menus::entry(window, ui, command),
                None => drop(ui.separator()),
            }
        }
    });
    Some(PartResponse { is_activated: shown.row.double_clicked(), ..shown.into() })
}

/// What happened to the row of a part.
struct PartResponse {
    row: Response,
    eye_clicked: bool,
    is_activated: bool,
}

impl From<entry::RowResponse> for PartResponse {
    fn from(shown: entry::RowResponse) -> Self {
        Self { row: shown.row, eye_clicked: shown.eye_clicked, is_activated: false }
    }
}

fn rename(window: &mut Window, ui: &mut Ui, selection: Selection) {
    let Some((_, typed)) = &mut window.panels.renaming else { return };
    if let Some(done) = entry::rename(ui, typed) {
        window.panels.renaming = None;
        if let Some(name) = done {
            window.rename(selection, &name);
        }
    }
}

/// Where a dragged row would go: a line above this one. Returns what was let go here.
fn drop_line(
    ui: &Ui,
    row: &Response,
    is_wanted: impl Fn(&Dragged) -> bool,
) -> Option<std::sync::Arc<Dragged>> {
    let hovering = row.dnd_hover_payload::<Dragged>().filter(|dragged| is_wanted(dragged));
    if hovering.is_some() {
        let stroke = Stroke::new(2.0, tokens(ui).link);
        ui.painter().hline(row.rect.x_range(), row.rect.top(), stroke);
    }
    row.dnd_release_payload::<Dragged>().filter(|dragged| is_wanted(dragged))
}
