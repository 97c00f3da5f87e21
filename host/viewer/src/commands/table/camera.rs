//! Remembered cameras, and how the mouse moves the camera.

use super::conditions::{has_bookmarks, has_clouds};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{key, shift};
use crate::theme::Icon;
use crate::views::CameraMode;
use eframe::egui::Key;

/// A command that chooses how the mouse moves the camera.
macro_rules! mode {
    ($id:literal, $name:literal, $icon:ident, $about:literal, $mode:ident) => {
        Command::new(($id, $name, Icon::$icon), Menu::Camera, $about, |window, _| {
            window.set_camera_mode(CameraMode::$mode)
        })
        .state(|window| window.camera_mode() == CameraMode::$mode)
    };
}

pub(super) static CAMERAS: [Command; 6] = [
    Command::new(
        ("remember-camera", "Remember this camera", Icon::BookmarkPlus),
        Menu::Camera,
        "Adds the camera of the focused view to the list, with a small picture; scenes keep it.",
        |window, _| window.remember_camera(),
    )
    .keys(&[shift(Key::C)])
    .when(has_clouds)
    .group(),
    Command::new(
        ("next-camera", "Next remembered camera", Icon::ChevronRight),
        Menu::Camera,
        "Moves the focused view to the next remembered camera.",
        |window, _| window.step_bookmark(true),
    )
    .keys(&[key(Key::PageDown)])
    .when(has_bookmarks),
    Command::new(
        ("previous-camera", "Previous remembered camera", Icon::ChevronLeft),
        Menu::Camera,
        "Moves the focused view to the remembered camera before.",
        |window, _| window.step_bookmark(false),
    )
    .keys(&[key(Key::PageUp)])
    .when(has_bookmarks),
    mode!(
        "turntable",
        "Turntable",
        Rotate3d,
        "A drag turns about what is in the middle, and up stays up.",
        Turntable
    )
    .group(),
    mode!(
        "trackball",
        "Trackball",
        Orbit,
        "A drag turns about what is in the middle, over the poles, too.",
        Trackball
    ),
    mode!(
        "walk",
        "Walk and fly",
        Footprints,
        "A drag looks around; W, A, S, D, E and Q move.",
        Walk
    ),
];
