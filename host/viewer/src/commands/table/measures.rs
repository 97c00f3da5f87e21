//! What is measured by clicks.

use super::conditions::{has_document, has_measures, is_measure, is_profile};
use crate::commands::command::{Command, Menu};
use crate::commands::shortcut::{key, shift};
use crate::theme::Icon;
use crate::views::hands::HandMode;
use eframe::egui::Key;
use surfelshop_cloud::scene::MeasureKind;

/// A command that lets clicks measure something.
macro_rules! measures {
    ($id:literal, $name:literal, $icon:ident, $about:literal, $kind:ident, $keys:expr) => {
        Command::new(($id, $name, Icon::$icon), Menu::Measure, $about, |window, _| {
            window.toggle_measuring(MeasureKind::$kind)
        })
        .keys($keys)
        .when(has_document)
        .state(|window| window.views.hands.mode == HandMode::Measure(MeasureKind::$kind))
    };
}

pub(super) static MEASURES: [Command; 11] = [
    measures!(
        "measure-distance",
        "Distance",
        Ruler,
        "Measures from place to place by clicks; again: clicks select the view.",
        Distance,
        &[key(Key::K)]
    ),
    measures!(
        "measure-angle",
        "Angle",
        TriangleRight,
        "Measures the angle of three places, at the second one that is clicked.",
        Angle,
        &[shift(Key::K)]
    ),
    measures!(
        "measure-height",
        "Height",
        MoveVertical,
        "Measures how much higher the second of two clicked places is.",
        Height,
        &[]
    ),
    measures!(
        "measure-area",
        "Area",
        VectorSquare,
        "Measures the area within three clicked places or more.",
        Area,
        &[]
    ),
    measures!(
        "measure-profile",
        "Profile",
        ChartArea,
        "Shows the surfels near the vertical plane through two clicked places as a plot.",
        Profile,
        &[]
    ),
    measures!(
        "measure-volume",
        "Volume",
        Mountain,
        "Measures what lies between the surfels and the plane through clicked places around them.",
        Volume,
        &[]
    ),
    measures!(
        "measure-note",
        "Note",
        MessageSquareText,
        "Puts a text at a clicked place.",
        Note,
        &[]
    ),
    Command::new(
        ("toggle-measures", "Hide or show all measures", Icon::EyeOff),
        Menu::Measure,
        "Hides all measures, or shows them again; each has an eye of its own in the list.",
        |window, _| window.toggle_measures(),
    )
    .when(has_measures)
    .group(),
    Command::new(
        ("copy-measure", "Copy the number", Icon::Copy),
        Menu::Measure,
        "Copies the first number of the selected measure, with all digits.",
        |window, ctx| window.copy_measure(ctx),
    )
    .when(is_measure),
    Command::new(
        ("save-measures", "Save the numbers", Icon::FileText),
        Menu::Measure,
        "Writes the numbers of all measures beside the scene, with commas between (CSV).",
        |window, _| window.save_measures(),
    )
    .when(has_measures),
    Command::new(
        ("save-profile", "Save the profile", Icon::FileText),
        Menu::Measure,
        "Writes how far along and how high each surfel of the selected profile is (CSV).",
        |window, _| window.save_profile(),
    )
    .when(is_profile),
];
