//! What is done with what is selected.

use super::conditions::{
    can_hide, can_remove, can_rename, has_clouds, has_duplicate, has_hidden_clouds, has_light_room,
    has_two_clouds,
};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{alt, key, shift};
use crate::theme::Icon;
use eframe::egui::Key;

pub(super) static SELECTION: [Command; 10] = [
    Command::new(
        ("zoom-selected", "Zoom to selection", Icon::ZoomIn),
        Menu::Edit,
        "Moves the camera to the selected cloud, light or remembered camera.",
        |window, _| window.zoom_to_selected(),
    )
    .keys(&[shift(Key::F)])
    .when(has_clouds)
    .group(),
    Command::new(
        ("toggle-selected", "Hide or show", Icon::EyeOff),
        Menu::Edit,
        "Hides the selected surfels; where none is, hides the selected cloud or measure or switches the light off, or back.",
        |window, _| match window.n_selected() {
            (0, _) => window.toggle_selected(),
            _ => window.hide_surfels(),
        },
    )
    .keys(&[key(Key::H)])
    .when(can_hide),
    Command::new(
        ("show-all-clouds", "Show all that is hidden", Icon::Eye),
        Menu::Edit,
        "Shows every cloud and every surfel that is hidden.",
        |window, _| {
            window.show_all_clouds();
            window.show_hidden_surfels();
        },
    )
    .keys(&[alt(Key::H)])
    .when(has_hidden_clouds),
    Command::new(
        ("rename-selected", "Rename …", Icon::Pencil),
        Menu::Edit,
        "Gives the selected cloud, view or remembered camera another name.",
        |window, _| window.rename_selected(),
    )
    .keys(&[key(Key::F2)])
    .when(can_rename),
    Command::new(
        ("duplicate-selected", "Duplicate", Icon::Copy),
        Menu::Edit,
        "Adds a light or a view like the selected one.",
        |window, _| window.duplicate_selected(),
    )
    .when(has_duplicate),
    Command::new(
        ("remove-selected", "Remove", Icon::Trash2),
        Menu::Edit,
        "Deletes the selected surfels; where none is, removes what is selected from the scene. Files stay.",
        |window, _| match window.n_selected() {
            (0, _) => window.remove_selected(),
            _ => window.delete_surfels(),
        },
    )
    .keys(&[key(Key::Delete)])
    .when(can_remove),
    Command::new(
        ("add-light", "Add a directional light", Icon::Sun),
        Menu::Edit,
        "Adds a light from one direction, as of the sun, and selects it.",
        |window, _| window.add_light(None),
    )
    .when(has_light_room)
    .group(),
    Command::new(
        ("add-point-light", "Add a point light", Icon::Lightbulb),
        Menu::Edit,
        "Adds a light at a place in the middle of the view, and selects it; its handle is dragged.",
        |window, _| window.add_placed_light(false),
    )
    .when(has_light_room),
    Command::new(
        ("add-spot-light", "Add a spotlight", Icon::LampDesk),
        Menu::Edit,
        "Adds a light within a cone, turned to the middle of the view, and selects it; its handles are dragged.",
        |window, _| window.add_placed_light(true),
    )
    .when(has_light_room),
    Command::new(
        ("compare-clouds", "Compare two clouds", Icon::FlipHorizontal),
        Menu::View,
        "Shows the selected cloud and another one left and right of a line.",
        |window, _| window.compare_clouds(),
    )
    .when(has_two_clouds),
];
