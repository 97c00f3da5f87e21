//! The list of what the mouse does, and of every shortcut.

use super::command::{Menu, shortcuts};
use super::table::COMMANDS;
use crate::theme::space;
use crate::window::Window;
use eframe::egui::{self, Align2, Context, Grid, Response, RichText, ScrollArea, Ui, vec2};

/// What the mouse does over pictures, and keys that are held.
pub(crate) const MOUSE: [(&str, &str); 11] = [
    ("drag", "turn; while walking, look around"),
    ("right or middle drag, Shift drag", "pan"),
    ("Ctrl drag", "look around; while walking, turn"),
    ("wheel", "zoom to the pointer"),
    ("double click", "centre what is under the pointer, and orbit about it"),
    ("click on an axis, drag the axes", "look along it; turn"),
    ("drag a light; Shift or Alt drag", "move the light across; nearer or farther"),
    ("drag the line of a wipe", "show more of one renderer"),
    ("drag a renderer onto a view", "draw it by that, or compare by a line"),
    ("right click in a list", "what can be done with it"),
    ("W A S D, E Q", "fly: forward, left, back, right, up, down"),
];

/// Shows the window if it is open.
pub(crate) fn show(window: &mut Window, ctx: &Context) {
    let mut open = window.panels.key_list;
    let screen = ctx.content_rect();
    egui::Window::new("Mouse and keys")
        .open(&mut open)
        .pivot(Align2::CENTER_CENTER)
        .default_pos(screen.center())
        .default_width(520.0)
        .show(ctx, |ui| {
            let height = (screen.height() - 160.0).clamp(120.0, 560.0);
            ScrollArea::vertical().max_height(height).show(ui, |ui| lists(window, ui));
        });
    window.panels.key_list = open;
}

fn lists(window: &Window, ui: &mut Ui) {
    ui.strong("Over a picture");
    grid(ui, "mouse", |ui| {
        for (keys, what) in MOUSE {
            words(ui, "", keys, what);
            ui.end_row();
        }
    });
    for menu in Menu::ALL {
        let of_menu = || COMMANDS.iter().filter(|command| command.menu == menu);
        let has_keys = of_menu().any(|command| !shortcuts(window, command).is_empty());
        if !has_keys {
            continue;
        }
        ui.add_space(space::MEDIUM);
        ui.strong(menu.name());
        grid(ui, menu.name(), |ui| {
            for command in of_menu() {
                let keys = shortcuts(window, command);
                if keys.is_empty() {
                    continue;
                }
                let icon = command.icon.unicode().to_string();
                let name = words(ui, &icon, &keys.join(", "), command.name);
                name.on_hover_text(command.about);
                ui.end_row();
            }
        });
    }
    ui.add_space(space::MEDIUM);
    ui.weak(
        "Everything else is found by words: \"All commands\". Shortcuts are changed in File > \
         Settings > Shortcuts.",
    );
}

/// A row; the columns are as wide in all lists.
fn words(ui: &mut Ui, icon: &str, keys: &str, what: &str) -> Response {
    let cell = |ui: &mut Ui, width: f32, text: RichText| {
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        ui.allocate_ui_with_layout(vec2(width, 18.0), layout, |ui| {
            ui.set_min_width(width);
            ui.label(text)
        })
        .inner
    };
    cell(ui, 16.0, RichText::new(icon));
    cell(ui, 190.0, RichText::new(keys).strong());
    cell(ui, 270.0, RichText::new(what))
}

fn grid(ui: &mut Ui, id: &str, rows: impl FnOnce(&mut Ui)) {
    Grid::new(id).num_columns(3).striped(true).show(ui, rows);
}
