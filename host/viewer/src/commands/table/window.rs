//! The window itself.

use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{ctrl, ctrl_shift, key};
use crate::preferences::ThemeChoice;
use crate::theme::Icon;
use crate::window::Window;
use eframe::egui::{Context, Key, ViewportCommand};

/// A command that chooses a theme.
macro_rules! theme {
    ($id:literal, $name:literal, $icon:ident, $about:literal, $theme:ident) => {
        Command::new(($id, $name, Icon::$icon), Menu::Window, $about, |window, _| {
            window.preferences.theme = ThemeChoice::$theme
        })
        .state(|window| window.preferences.theme == ThemeChoice::$theme)
    };
}

pub(super) static WINDOW: [Command; 12] = [
    Command::new(
        ("panels", "Outliner at the left", Icon::PanelLeft),
        Menu::Window,
        "Shows or hides the list of clouds, lights, cameras and views.",
        |window, _| window.preferences.panels = !window.preferences.panels,
    )
    .keys(&[ctrl(Key::B)])
    .state(|window| window.preferences.panels),
    Command::new(
        ("properties", "Properties at the right", Icon::PanelRight),
        Menu::Window,
        "Shows or hides the properties of what is selected.",
        |window, _| window.preferences.properties = !window.preferences.properties,
    )
    .keys(&[ctrl_shift(Key::B)])
    .state(|window| window.preferences.properties),
    Command::new(
        ("toolbar", "Toolbar", Icon::Grip),
        Menu::Window,
        "Shows or hides the row of icons.",
        |window, _| window.preferences.toolbar = !window.preferences.toolbar,
    )
    .state(|window| window.preferences.toolbar),
    Command::new(
        ("full-screen", "Full screen", Icon::Expand),
        Menu::Window,
        "Fills the screen, or goes back.",
        full_screen,
    )
    .keys(&[key(Key::F11)]),
    Command::new(
        ("menus", "Go to the menus", Icon::Menu),
        Menu::Window,
        "Leads the keyboard to the first menu: the arrows go on, Enter opens.",
        |window, _| window.panels.goes_to_menus = true,
    )
    .keys(&[key(Key::F10)]),
    theme!(
        "theme-system",
        "Theme of the desktop",
        Monitor,
        "Is dark or light as the desktop.",
        System
    )
    .group(),
    theme!("theme-dark", "Dark theme", Moon, "Light text on dark panels.", Dark),
    theme!("theme-light", "Light theme", Sun, "Dark text on light panels.", Light),
    Command::new(
        ("larger", "Everything larger", Icon::ZoomIn),
        Menu::Window,
        "Enlarges text and controls by a step.",
        |window, _| window.preferences.ui_scale = window.preferences.scaled(true),
    )
    .keys(&[ctrl(Key::Plus), ctrl(Key::Equals)])
    .group(),
    Command::new(
        ("smaller", "Everything smaller", Icon::ZoomOut),
        Menu::Window,
        "Shrinks text and controls by a step.",
        |window, _| window.preferences.ui_scale = window.preferences.scaled(false),
    )
    .keys(&[ctrl(Key::Minus)]),
    Command::new(
        ("usual-size", "Everything at its usual size", Icon::RotateCcw),
        Menu::Window,
        "Text and controls as large as the screen asks for.",
        |window, _| window.preferences.ui_scale = 1.0,
    )
    .keys(&[ctrl(Key::Num0)]),
    Command::new(
        ("reduced-motion", "Reduced motion", Icon::Accessibility),
        Menu::Window,
        "Cameras jump to where they go, and nothing fades.",
        |window, _| window.preferences.reduced_motion = !window.preferences.reduced_motion,
    )
    .state(|window| window.preferences.reduced_motion),
];

fn full_screen(_window: &mut Window, ctx: &Context) {
    let is_full = ctx.input(|input| input.viewport().fullscreen.unwrap_or(false));
    ctx.send_viewport_cmd(ViewportCommand::Fullscreen(!is_full));
}
