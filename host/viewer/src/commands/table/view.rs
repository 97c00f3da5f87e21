//! The camera, what is shown over pictures, and the views.

use super::conditions::{
    flickers, has_clouds, has_inside, has_legend, has_numbers, has_placed_lights,
    has_room_for_views, has_two_views,
};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{alt, ctrl, key, shift};
use crate::document::Mode;
use crate::orientation::StandardView;
use crate::theme::Icon;
use crate::views::{layout, navigation};
use crate::window::Window;
use eframe::egui::{Context, Key, KeyboardShortcut};
use surfelshop_api::Projection;
use surfelshop_cloud::scene::Axis;
use surfelshop_session::options::UpAxis;

/// A command that looks from one side.
const fn side(
    words: (&'static str, &'static str, Icon),
    about: &'static str,
    run: fn(&mut Window, &Context),
    keys: &'static [KeyboardShortcut],
) -> Command {
    Command::new(words, Menu::Camera, about, run).keys(keys).when(has_clouds)
}

pub(super) static CAMERA: [Command; 13] = [
    Command::new(
        ("frame-all", "See everything", Icon::Scan),
        Menu::Camera,
        "Moves the camera back to where it sees all of what is open, from the same side.",
        |window, _| window.fly_to_all(),
    )
    .keys(&[key(Key::F)])
    .when(has_clouds),
    side(
        ("view-front", "View from the front", Icon::Square),
        "Looks at the front, at the same distance.",
        |window, _| window.look_from(StandardView::Front),
        &[key(Key::Num1)],
    )
    .group(),
    side(
        ("view-back", "View from the back", Icon::Square),
        "Looks at the back, at the same distance.",
        |window, _| window.look_from(StandardView::Back),
        &[ctrl(Key::Num1)],
    ),
    side(
        ("view-right", "View from the right", Icon::Square),
        "Looks at the right side, at the same distance.",
        |window, _| window.look_from(StandardView::Right),
        &[key(Key::Num3)],
    ),
    side(
        ("view-left", "View from the left", Icon::Square),
        "Looks at the left side, at the same distance.",
        |window, _| window.look_from(StandardView::Left),
        &[ctrl(Key::Num3)],
    ),
    side(
        ("view-top", "View from the top", Icon::Square),
        "Looks down from above, at the same distance.",
        |window, _| window.look_from(StandardView::Top),
        &[key(Key::Num7)],
    ),
    side(
        ("view-bottom", "View from below", Icon::Square),
        "Looks up from below, at the same distance.",
        |window, _| window.look_from(StandardView::Bottom),
        &[ctrl(Key::Num7)],
    ),
    side(
        ("view-three-quarter", "Three-quarter view", Icon::Box),
        "Looks from the front, the right and above, at the same distance.",
        |window, _| window.look_from(StandardView::ThreeQuarter),
        &[key(Key::Num0)],
    ),
    side(
        ("inside", "Stand inside the scan", Icon::DoorOpen),
        "Stands where the scan was taken, or in its largest room; W, A, S and D walk.",
        |window, _| window.stand_inside(),
        &[key(Key::I)],
    )
    .when(has_inside),
    side(
        ("orthographic", "Orthographic", Icon::Cuboid),
        "Changes between perspective and orthographic projection.",
        toggle_projection,
        &[key(Key::Num5), key(Key::O)],
    )
    .state(is_orthographic)
    .group(),
    side(
        ("up-y", "y points up", Icon::ArrowUp),
        "Turns the views so that y points up, and remembers that for files of this kind.",
        |window, _| window.set_up(UpAxis::Y),
        &[],
    )
    .state(|window| window.document.up.axis() == Axis::PlusY)
    .group(),
    side(
        ("up-z", "z points up", Icon::ArrowUp),
        "Turns the views so that z points up, and remembers that for files of this kind.",
        |window, _| window.set_up(UpAxis::Z),
        &[],
    )
    .state(|window| window.document.up == UpAxis::Z),
    side(
        ("up-down", "Turn upside down", Icon::ArrowDown),
        "Turns the views so that what pointed down points up, and remembers that for files of this kind.",
        |window, _| window.turn_upside_down(),
        &[],
    ),
];

fn is_orthographic(window: &Window) -> bool {
    let camera = window.camera_of(window.views.focused);
    matches!(camera.projection, Projection::Orthographic { .. })
}

fn toggle_projection(window: &mut Window, _ctx: &Context) {
    let mut camera = window.camera_of(window.views.focused);
    navigation::toggle_projection(&mut camera, navigation::USUAL_FIELD_OF_VIEW);
    window.set_camera(window.views.focused, camera);
}

pub(super) static OVER_PICTURES: [Command; 5] = [
    Command::new(
        ("axes", "Axes", Icon::Axis3d),
        Menu::View,
        "Shows the axes in a corner of each view; a click looks along one, a drag turns.",
        |window, _| window.preferences.axes = !window.preferences.axes,
    )
    .keys(&[shift(Key::G)])
    .state(|window| window.preferences.axes)
    .group(),
    Command::new(
        ("grid", "Ground grid", Icon::Grid3x3),
        Menu::View,
        "Shows a grid on the ground below what is open.",
        |window, _| window.preferences.grid = !window.preferences.grid,
    )
    .keys(&[key(Key::G)])
    .state(|window| window.preferences.grid),
    Command::new(
        ("scale-bar", "Scale bar", Icon::Ruler),
        Menu::View,
        "Shows how long something is at the distance of what the camera orbits about.",
        |window, _| window.preferences.scale_bar = !window.preferences.scale_bar,
    )
    .keys(&[key(Key::B)])
    .state(|window| window.preferences.scale_bar),
    Command::new(
        ("legend", "Legend of colours", Icon::Tag),
        Menu::View,
        "Shows what the colours mean where they are numbers.",
        |window, _| window.settings.shows_legend = !window.settings.shows_legend,
    )
    .when(has_legend)
    .state(|window| window.settings.shows_legend),
    Command::new(
        ("light-handles", "Handles of lights", Icon::Lightbulb),
        Menu::View,
        "Shows lights that have a place over the picture, to be dragged.",
        |window, _| window.settings.shows_light_handles = !window.settings.shows_light_handles,
    )
    .when(has_placed_lights)
    .state(|window| window.settings.shows_light_handles),
];

pub(super) static VIEWS: [Command; 10] = [
    Command::new(
        ("split", "Split the view", Icon::SquareSplitHorizontal),
        Menu::View,
        "Puts a second view beside the focused one, or below it where that is higher than wide.",
        |window, _| layout::split_focused(window, false),
    )
    .keys(&[key(Key::N)])
    .when(has_room_for_views)
    .group(),
    Command::new(
        ("split-below", "Split the view below", Icon::SquareSplitVertical),
        Menu::View,
        "Puts a second view below the focused one.",
        |window, _| layout::split_focused(window, true),
    )
    .keys(&[shift(Key::N)])
    .when(has_room_for_views),
    Command::new(
        ("close-view", "Close the view", Icon::X),
        Menu::View,
        "Closes the focused view.",
        |window, _| layout::close_focused(window),
    )
    .keys(&[ctrl(Key::W)])
    .when(has_two_views),
    Command::new(
        ("link-view", "Link the view", Icon::Link),
        Menu::View,
        "Moves the camera of the focused view together with the other linked views.",
        link,
    )
    .when(has_two_views)
    .state(|window| window.settings.pane(window.views.focused).is_some_and(|pane| pane.linked)),
    Command::new(
        ("next-renderer", "Next renderer", Icon::SkipForward),
        Menu::View,
        "Draws the focused view by the next renderer of the list.",
        |window, _| window.step_renderer(true),
    )
    .keys(&[key(Key::R)]),
    Command::new(
        ("previous-renderer", "Previous renderer", Icon::SkipBack),
        Menu::View,
        "Draws the focused view by the renderer before in the list.",
        |window, _| window.step_renderer(false),
    )
    .keys(&[shift(Key::R)]),
    Command::new(
        ("measure", "Compare quality", Icon::Gauge),
        Menu::View,
        "Measures the error of what is shown, and error against time.",
        |window, _| window.measure.form.open = !window.measure.form.open,
    )
    .keys(&[key(Key::M)])
    .state(|window| window.measure.form.open),
    Command::new(
        ("copy-numbers", "Copy the numbers", Icon::ClipboardCopy),
        Menu::View,
        "Copies what was measured as a table, for a spreadsheet.",
        crate::measure::copy_numbers,
    )
    .when(has_numbers),
    Command::new(
        ("adaptive", "Draw less while something moves", Icon::Zap),
        Menu::View,
        "Draws fewer surfels and pixels in motion, so that pictures come quickly.",
        |window, _| window.views.adaptive = !window.views.adaptive,
    )
    .state(|window| window.views.adaptive),
    Command::new(
        ("flicker", "Flip the pictures", Icon::ArrowRightLeft),
        Menu::View,
        "Shows the other of two pictures that are shown in turn.",
        flip,
    )
    .keys(&[key(Key::Space)])
    .when(flickers),
];

fn link(window: &mut Window, _ctx: &Context) {
    if let Some(pane) = window.settings.pane_mut(window.views.focused) {
        pane.linked = !pane.linked;
    }
}

fn flip(window: &mut Window, _ctx: &Context) {
    if let Some(pane) = window.views.panes.get_mut(&window.views.focused) {
        pane.flicker = !pane.flicker;
    }
}

/// A command that shows one or two renderers in some way.
macro_rules! mode {
    ($id:literal, $name:literal, $icon:ident, $about:literal, $mode:ident, $key:ident) => {
        Command::new(($id, $name, Icon::$icon), Menu::View, $about, |window, _| {
            set_mode(window, Mode::$mode)
        })
        .keys(&[alt(Key::$key)])
        .state(|window| has_mode(window, Mode::$mode))
    };
}

pub(super) static MODES: [Command; 5] = [
    mode!(
        "one-renderer",
        "One renderer",
        Image,
        "Shows the picture of one renderer.",
        Single,
        Num1
    )
    .group(),
    mode!(
        "side-by-side",
        "Two renderers side by side",
        Columns2,
        "Shows the pictures of two renderers beside each other.",
        SideBySide,
        Num2
    ),
    mode!(
        "wipe",
        "Two renderers with a wipe line",
        FlipHorizontal2,
        "Shows one renderer left and another one right of a line that is dragged.",
        Wipe,
        Num3
    ),
    mode!(
        "in-turn",
        "Two renderers in turn",
        Layers,
        "Shows one of two pictures; the space bar shows the other one.",
        Flicker,
        Num4
    ),
    mode!(
        "difference",
        "Difference of two renderers",
        Contrast,
        "Shows how far two pictures are apart, as a heat map.",
        Difference,
        Num5
    ),
];

fn set_mode(window: &mut Window, mode: Mode) {
    if let Some(pane) = window.settings.pane_mut(window.views.focused) {
        pane.mode = mode;
        // Of two clouds the same renderer shows what differs, and of one nothing.
        if mode.sides() == 2 && pane.clouds == [None, None] {
            pane.tell_renderers_apart();
        }
    }
}

fn has_mode(window: &Window, mode: Mode) -> bool {
    window.settings.pane(window.views.focused).is_some_and(|pane| pane.mode == mode)
}
