//! The menu bar.

use super::actions::{next_renderer, toggle_measure, toggle_projection};
use super::shortcuts::{
    FRAME, INSIDE, MEASURE, NEXT_RENDERER, OPEN, PICTURE, PROJECTION, QUIT, REDO, SAVE, SAVE_AS,
    SPLIT, UNDO,
};
use crate::dialogs::{DialogPurpose, files};
use crate::document::undo;
use crate::plugins::tool_window;
use crate::views::layout;
use crate::window::Window;
use eframe::egui::{self, Context, KeyboardShortcut, Ui};

/// Shows the menu bar.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let ctx = ui.ctx().clone();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file(window, ui, &ctx));
        ui.menu_button("Edit", |ui| edit(window, ui));
        ui.menu_button("Tools", |ui| tool_window::menu(window, ui));
        ui.menu_button("View", |ui| view(window, ui));
        ui.menu_button("Help", |ui| {
            ui.checkbox(&mut window.panels.manual.open, "Manual");
            ui.checkbox(&mut window.panels.plugin_list, "Plugins");
            ui.checkbox(&mut window.messages.open, "Messages");
            ui.checkbox(&mut window.panels.key_list, "Mouse and keys");
        });
    });
}

fn file(window: &mut Window, ui: &mut Ui, ctx: &Context) {
    if item(ui, "Open …", &OPEN) {
        files::open(window, ctx, DialogPurpose::Open);
    }
    recent(window, ui, ctx);
    if item(ui, "Save scene", &SAVE) {
        files::save_scene(window, ctx);
    }
    if item(ui, "Save scene as …", &SAVE_AS) {
        files::open(window, ctx, DialogPurpose::SaveScene);
    }
    files::save_cloud_menu(window, ui, ctx);
    if item(ui, "Save pictures …", &PICTURE) {
        window.panels.export_form.open = true;
    }
    ui.separator();
    if item(ui, "Quit", &QUIT) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }
}

fn edit(window: &mut Window, ui: &mut Ui) {
    let now = window.snapshot();
    let history = &window.document.history;
    let (can_undo, can_redo) = (history.has_undo(&now), history.has_redo(&now));
    ui.add_enabled_ui(can_undo, |ui| {
        if item(ui, "Undo", &UNDO) {
            undo::undo(window);
        }
    });
    ui.add_enabled_ui(can_redo, |ui| {
        if item(ui, "Redo", &REDO) {
            undo::redo(window);
        }
    });
}

fn view(window: &mut Window, ui: &mut Ui) {
    if item(ui, "See everything", &FRAME) {
        window.frame_all();
    }
    let can_stand = window.can_stand_inside();
    ui.add_enabled_ui(can_stand, |ui| {
        if item(ui, "Stand inside the scan", &INSIDE) {
            window.stand_inside();
        }
    });
    if item(ui, "Perspective or parallel", &PROJECTION) {
        toggle_projection(window);
    }
    if item(ui, "Next renderer", &NEXT_RENDERER) {
        next_renderer(window);
    }
    if item(ui, "Split", &SPLIT) {
        layout::split_focused(window);
    }
    if item(ui, "Measure", &MEASURE) {
        toggle_measure(window);
    }
    ui.separator();
    ui.checkbox(&mut window.views.adaptive, "Draw less while something moves");
}

/// The menu of recent files, with the last session.
fn recent(window: &mut Window, ui: &mut Ui, ctx: &Context) {
    let mut chosen = None;
    ui.menu_button("Open recent", |ui| {
        for path in &window.document.recent {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                chosen = Some(path.clone());
                ui.close();
            }
        }
        let last = window
            .document
            .state_folder
            .as_ref()
            .and_then(|state_folder| state_folder.previous_session());
        if let Some(last) = last
            && ui.button("the last session").clicked()
        {
            chosen = Some(last);
            ui.close();
        }
    });
    if let Some(path) = chosen {
        window.open(ctx, vec![path]);
    }
}

fn item(ui: &mut Ui, text: &str, shortcut: &KeyboardShortcut) -> bool {
    let shortcut = ui.ctx().format_shortcut(shortcut);
    let clicked = ui.add(egui::Button::new(text).shortcut_text(shortcut)).clicked();
    if clicked {
        ui.close();
    }
    clicked
}
