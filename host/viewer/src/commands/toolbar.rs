//! The row of icons below the menu bar.

use super::button::{icon_button, item};
use super::command::{Menu, shortcuts};
use super::table::{COMMANDS, find};
use crate::theme::{Icon, iconed, space, tokens};
use crate::window::Window;
use eframe::egui::containers::menu::MenuButton;
use eframe::egui::{Align, Button, Layout, Role, Ui, WidgetInfo, vec2};

/// The commands, in groups.
const GROUPS: [&[&str]; 6] = [
    &["open", "save-scene", "save-pictures"],
    &["undo", "redo"],
    &["frame-all", "orthographic"],
    &["select-rectangle", "select-lasso", "select-brush", "lead-tool"],
    &["axes", "grid", "scale-bar"],
    &["split", "measure"],
];

/// Width from which all of them fit, and how many groups do below it; menus have the others.
const WIDE: f32 = 880.0;
const N_NARROW: usize = 4;

/// Shows the toolbar.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.set_min_height(30.0);
        ui.spacing_mut().item_spacing.x = 2.0;
        icon_button(window, ui, "panels");
        let n_groups = if ui.max_rect().width() < WIDE { N_NARROW } else { GROUPS.len() };
        for group in &GROUPS[..n_groups] {
            ui.add_space(space::SMALL);
            ui.separator();
            ui.add_space(space::SMALL);
            for id in *group {
                icon_button(window, ui, id);
            }
        }
        ui.add_space(space::MEDIUM);
        looks(window, ui);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            icon_button(window, ui, "properties");
            icon_button(window, ui, "keys");
            icon_button(
                window,
                ui,
                if ui.visuals().dark_mode { "theme-light" } else { "theme-dark" },
            );
            search(window, ui);
        });
    });
}

/// The menu of looks.
fn looks(window: &mut Window, ui: &mut Ui) {
    let label = iconed(ui, Icon::Palette, "Look");
    let button = MenuButton::from_button(Button::new(label).min_size(vec2(0.0, 26.0)));
    let (response, _) = button.ui(ui, |ui| {
        for command in COMMANDS.iter().filter(|command| command.menu == Menu::Look) {
            item(window, ui, command);
        }
    });
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Choose a look"));
    response.on_hover_text(
        "Renderer, light and environment in one click; undo brings the former back.",
    );
}

/// What opens the palette.
fn search(window: &mut Window, ui: &mut Ui) {
    let Some(command) = find("all-commands") else { return };
    let shortcut = shortcuts(window, command).into_iter().next().unwrap_or_default();
    let width = 230.0f32.min(ui.available_width() - space::MEDIUM);
    if width < 90.0 {
        return;
    }
    let label = iconed(ui, Icon::Search, "Search commands");
    let mut button = Button::new(label).fill(tokens(ui).field).min_size(vec2(width, 26.0));
    if width > 220.0 {
        button = button.shortcut_text(shortcut);
    }
    let response = ui.add(button);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, command.name));
    if response.on_hover_text(command.about).clicked() {
        window.panels.palette.open();
    }
}
