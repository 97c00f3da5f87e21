//! Files, and what was done.

use super::conditions::{has_document, has_last_session, has_redo, has_undo};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{ctrl, ctrl_shift};
use crate::dialogs::{DialogPurpose, files};
use crate::document::undo;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::{Context, Key, ViewportCommand};

pub(super) static FILE: [Command; 10] = [
    Command::new(
        ("open", "Open …", Icon::FolderOpen),
        Menu::File,
        "Opens point clouds, splats, a scene or a light probe.",
        |window, ctx| files::open(window, ctx, DialogPurpose::Open),
    )
    .keys(&[ctrl(Key::O)]),
    Command::new(
        ("add", "Add …", Icon::FolderPlus),
        Menu::File,
        "Opens further clouds beside those that are open; camera, lights and views stay.",
        |window, ctx| files::open(window, ctx, DialogPurpose::Add),
    )
    .keys(&[ctrl_shift(Key::O)])
    .when(has_document),
    Command::new(
        ("open-last", "Open the last session", Icon::History),
        Menu::File,
        "Opens what was shown when the program ended last, with all settings.",
        open_last,
    )
    .when(has_last_session),
    Command::new(
        ("start-page", "Start page", Icon::House),
        Menu::File,
        "Shows examples and recent files, or goes back to the pictures.",
        |window, _| window.panels.start_page = !window.panels.start_page,
    )
    .state(Window::shows_start_page),
    Command::new(
        ("save-scene", "Save scene", Icon::Save),
        Menu::File,
        "Writes what is shown, and how, as a scene file.",
        files::save_scene,
    )
    .keys(&[ctrl(Key::S)])
    .when(has_document)
    .group(),
    Command::new(
        ("save-scene-as", "Save scene as …", Icon::SaveAll),
        Menu::File,
        "Writes what is shown, and how, as a scene file of another name.",
        |window, ctx| files::open(window, ctx, DialogPurpose::SaveScene),
    )
    .keys(&[ctrl_shift(Key::S)])
    .when(has_document),
    Command::new(
        ("save-cloud", "Save cloud as …", Icon::FileDown),
        Menu::File,
        "Writes a cloud with all its columns and edits.",
        files::save_cloud,
    )
    .keys(&[ctrl_shift(Key::E)])
    .when(has_document),
    Command::new(
        ("save-pictures", "Save pictures …", Icon::Camera),
        Menu::File,
        "Writes what the renderers of the view make of it, at any size, or as a turn around it.",
        |window, _| window.panels.export_form.open = true,
    )
    .keys(&[ctrl(Key::P)])
    .when(has_document),
    Command::new(
        ("settings", "Settings …", Icon::Settings),
        Menu::File,
        "Theme, views, units, device, memory, shortcuts and trusted plugins.",
        |window, _| window.panels.settings_window = !window.panels.settings_window,
    )
    .keys(&[ctrl(Key::Comma)])
    .group(),
    Command::new(
        ("quit", "Quit", Icon::LogOut),
        Menu::File,
        "Closes the window; asks first where edits are in no file.",
        |_, ctx| ctx.send_viewport_cmd(ViewportCommand::Close),
    )
    .keys(&[ctrl(Key::Q)]),
];

fn open_last(window: &mut Window, ctx: &Context) {
    let state_folder = window.document.state_folder.as_ref();
    if let Some(last) = state_folder.and_then(|folder| folder.previous_session()) {
        window.open(ctx, vec![last]);
    }
}

pub(super) static EDIT: [Command; 3] = [
    Command::new(
        ("undo", "Undo", Icon::Undo2),
        Menu::Edit,
        "Takes back the last change of clouds or settings.",
        |window, _| undo::undo(window),
    )
    .keys(&[ctrl(Key::Z)])
    .when(has_undo),
    Command::new(
        ("redo", "Redo", Icon::Redo2),
        Menu::Edit,
        "Makes a change again that was taken back.",
        |window, _| undo::redo(window),
    )
    .keys(&[ctrl_shift(Key::Z), ctrl(Key::Y)])
    .when(has_redo),
    Command::new(
        ("all-commands", "All commands …", Icon::Search),
        Menu::Edit,
        "Finds commands, tools, renderers and recent files by words.",
        |window, _| window.panels.palette.open(),
    )
    .keys(&[ctrl_shift(Key::P)])
    .group(),
];
