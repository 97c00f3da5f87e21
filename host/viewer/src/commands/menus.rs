//! The menu bar.

use super::button::item;
use super::command::{Command, Menu};
use super::table::COMMANDS;
use crate::dialogs::{DialogPurpose, files};
use crate::plugins::tool_window;
use crate::theme::iconed;
use crate::window::Window;
use eframe::egui::{self, EventFilter, Key, Popup, Response, Ui};

/// Shows the menu bar.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    egui::MenuBar::new().ui(ui, |ui| {
        for menu in Menu::ALL {
            if menu == Menu::Window {
                let shown = ui.menu_button("Tools", |ui| tool_window::menu(window, ui));
                opens_by_arrow(ui, &shown.response);
            }
            let shown = ui.menu_button(menu.name(), |ui| entries(window, ui, menu));
            opens_by_arrow(ui, &shown.response);
            // From there the arrows lead on, and Enter opens.
            if menu == Menu::ALL[0] && std::mem::take(&mut window.panels.goes_to_menus) {
                shown.response.request_focus();
            }
        }
    });
}

/// Opens the menu of a button that has the keyboard when the arrow down is pressed.
fn opens_by_arrow(ui: &Ui, button: &Response) {
    let id = Popup::default_response_id(button);
    if !button.has_focus() || Popup::is_id_open(ui.ctx(), id) {
        return;
    }
    let filter = EventFilter { vertical_arrows: true, ..EventFilter::default() };
    ui.memory_mut(|memory| memory.set_focus_lock_filter(button.id, filter));
    if ui.input(|input| input.key_pressed(Key::ArrowDown)) {
        Popup::open_id(ui.ctx(), id);
    }
}

/// The entries of a menu.
pub(crate) fn entries(window: &mut Window, ui: &mut Ui, menu: Menu) {
    let of_menu = COMMANDS.iter().filter(|command| command.menu == menu);
    for (i, command) in of_menu.enumerate() {
        if command.begins_group && i > 0 {
            ui.separator();
        }
        match command.id {
            // With a choice where there are several.
            "save-cloud" => save_cloud(window, ui, command),
            _ => item(window, ui, command),
        }
        if command.id == "open" {
            recent(window, ui);
        }
    }
}

/// An entry of a menu that is not in the bar.
pub(crate) fn entry(window: &mut Window, ui: &mut Ui, command: &'static Command) {
    item(window, ui, command);
}

/// The menu of recent files.
fn recent(window: &mut Window, ui: &mut Ui) {
    let mut chosen = None;
    let has_some = !window.document.recent.is_empty();
    ui.add_enabled_ui(has_some, |ui| {
        ui.menu_button("Open recent", |ui| {
            for path in &window.document.recent {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                    chosen = Some(path.clone());
                    ui.close();
                }
            }
        });
    });
    if let Some(path) = chosen {
        window.open(&ui.ctx().clone(), vec![path]);
    }
}

/// The menu entry that saves a cloud, with a choice where there are several.
fn save_cloud(window: &mut Window, ui: &mut Ui, command: &'static Command) {
    let all = window.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
    let names: Vec<String> = all.map(|open_cloud| open_cloud.name()).collect();
    if names.len() < 2 {
        item(window, ui, command);
        return;
    }
    let mut chosen = None;
    ui.menu_button(iconed(ui, command.icon, "Save a cloud as …"), |ui| {
        for (i, name) in names.iter().enumerate() {
            if ui.button(name).clicked() {
                chosen = Some(i);
            }
        }
    });
    if let Some(index) = chosen {
        ui.close();
        files::open(window, &ui.ctx().clone(), DialogPurpose::SaveCloud(index));
    }
}
