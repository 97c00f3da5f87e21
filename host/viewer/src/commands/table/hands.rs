//! What hands do over pictures, and what is done with selected surfels.

use super::conditions::{has_document, has_hand_tools, has_surfels};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{ctrl, ctrl_shift, key, shift};
use crate::theme::Icon;
use crate::views::hands::HandMode;
use eframe::egui::Key;

/// A command that lets a drag do something.
macro_rules! mode {
    ($id:literal, $name:literal, $icon:ident, $about:literal, $mode:ident, $key:expr) => {
        Command::new(($id, $name, Icon::$icon), Menu::Select, $about, |window, _| {
            window.toggle_hand(HandMode::$mode)
        })
        .keys(&[$key])
        .when(has_document)
        .state(|window| window.views.hands.mode == HandMode::$mode)
    };
}

pub(super) static HANDS: [Command; 20] = [
    mode!(
        "select-rectangle",
        "Select by a rectangle",
        SquareDashedMousePointer,
        "Selects the surfels in a rectangle that is dragged; again: drags move the camera.",
        Rectangle,
        key(Key::T)
    ),
    mode!(
        "select-lasso",
        "Select by a lasso",
        LassoSelect,
        "Selects the surfels within a line that is drawn; again: drags move the camera.",
        Lasso,
        key(Key::L)
    ),
    mode!(
        "select-brush",
        "Select by a brush",
        CircleDotDashed,
        "Selects the surfels that a sphere goes over; again: drags move the camera.",
        Brush,
        key(Key::C)
    ),
    mode!(
        "select-box",
        "Select by a box",
        Box,
        "Selects the surfels in a box, whose sides are dragged; again: hides the box.",
        Box,
        shift(Key::T)
    ),
    mode!(
        "select-plane",
        "Select by a plane",
        SquareSplitVertical,
        "Selects the surfels on one side of a plane; again: hides the plane.",
        Plane,
        shift(Key::L)
    ),
    Command::new(
        ("lead-tool", "Lead a tool by hand", Icon::Brush),
        Menu::Select,
        "Paints, erases or sculpts where it is dragged over the cloud; again: drags move the camera.",
        |window, _| window.toggle_tool(),
    )
    .keys(&[key(Key::P)])
    .when(has_hand_tools)
    .state(|window| matches!(window.views.hands.mode, HandMode::Tool(_))),
    Command::new(
        ("brush-larger", "Larger brush", Icon::Plus),
        Menu::Select,
        "Makes brushes larger by a step.",
        |window, _| window.scale_brush(1.25),
    )
    .keys(&[key(Key::CloseBracket)]),
    Command::new(
        ("brush-smaller", "Smaller brush", Icon::Minus),
        Menu::Select,
        "Makes brushes smaller by a step.",
        |window, _| window.scale_brush(0.8),
    )
    .keys(&[key(Key::OpenBracket)]),
    Command::new(
        ("select-all", "Select all surfels", Icon::CheckCheck),
        Menu::Select,
        "Selects every surfel that is shown.",
        |window, _| window.select_all_surfels(),
    )
    .keys(&[ctrl(Key::A)])
    .when(has_document)
    .group(),
    Command::new(
        ("select-none", "Select no surfels", Icon::SquareDashed),
        Menu::Select,
        "Selects nothing.",
        |window, _| window.select_no_surfels(),
    )
    .keys(&[ctrl_shift(Key::A)])
    .when(has_surfels),
    Command::new(
        ("select-invert", "Invert the selection", Icon::Contrast),
        Menu::Select,
        "Selects the surfels that are not selected.",
        |window, _| window.invert_surfels(),
    )
    .keys(&[ctrl(Key::I)])
    .when(has_document),
    Command::new(
        ("select-grow", "Grow the selection", Icon::Maximize2),
        Menu::Select,
        "Selects the neighbours of what is selected, too.",
        |window, _| window.grow_surfels(),
    )
    .when(has_surfels),
    Command::new(
        ("select-shrink", "Shrink the selection", Icon::Minimize2),
        Menu::Select,
        "Selects no more what has a neighbour that is not selected.",
        |window, _| window.shrink_surfels(),
    )
    .when(has_surfels),
    Command::new(
        ("select-connected", "Select what hangs together", Icon::Waypoints),
        Menu::Select,
        "Selects all that is connected with what is selected, neighbour by neighbour.",
        |window, _| window.select_connected(),
    )
    .when(has_surfels),
    Command::new(
        ("surfels-delete", "Delete", Icon::Eraser),
        Menu::Select,
        "Deletes the selected surfels; files stay as they are.",
        |window, _| window.delete_surfels(),
    )
    .when(has_surfels)
    .group(),
    Command::new(
        ("surfels-crop", "Crop", Icon::Crop),
        Menu::Select,
        "Deletes all surfels that are not selected.",
        |window, _| window.crop_to_surfels(),
    )
    .when(has_surfels),
    Command::new(
        ("surfels-split", "Split off", Icon::Split),
        Menu::Select,
        "Makes the selected surfels a cloud of their own, beside the rest.",
        |window, _| window.split_surfels(),
    )
    .when(has_surfels),
    Command::new(
        ("surfels-hide", "Hide", Icon::EyeOff),
        Menu::Select,
        "Hides the selected surfels; clouds and files stay as they are.",
        |window, _| window.hide_surfels(),
    )
    .when(has_surfels)
    .group(),
    Command::new(
        ("surfels-hide-others", "Hide all others", Icon::EyeClosed),
        Menu::Select,
        "Hides all surfels that are not selected.",
        |window, _| window.hide_other_surfels(),
    )
    .keys(&[shift(Key::H)])
    .when(has_surfels),
    Command::new(
        ("save-strokes", "Save the strokes", Icon::FileJson),
        Menu::Select,
        "Writes what tools were led over by hand beside the cloud, for `surfelshop bake --strokes`.",
        |window, _| window.save_strokes(),
    )
    .when(has_document)
    .group(),
];
