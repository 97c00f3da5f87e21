//! What is being measured.

use super::surveyed::Surveys;
use crate::theme::Icon;
use glam::DVec3;
use surfelshop_cloud::scene::MeasureKind;

/// What is being measured, and what is known of measures.
#[derive(Default)]
pub(crate) struct Measuring {
    /// The places that were clicked so far.
    pub(crate) places: Vec<DVec3>,
    /// Where the pointer is on the surface: what a click would add.
    pub(crate) pointer: Option<DVec3>,
    /// What is measured of surfels.
    pub(crate) surveys: Surveys,
}

/// The icon of a kind.
pub(crate) fn icon(kind: MeasureKind) -> Icon {
    match kind {
        MeasureKind::Distance => Icon::Ruler,
        MeasureKind::Angle => Icon::TriangleRight,
        MeasureKind::Height => Icon::MoveVertical,
        MeasureKind::Area => Icon::VectorSquare,
        MeasureKind::Profile => Icon::ChartArea,
        MeasureKind::Volume => Icon::Mountain,
        MeasureKind::Note => Icon::MessageSquareText,
    }
}

/// What clicks and keys do, for the status line.
pub(crate) fn hint(kind: MeasureKind) -> &'static str {
    match kind {
        MeasureKind::Distance => {
            "Click two places, with Shift more; Backspace takes the last one back, Escape ends; drags move the camera"
        }
        MeasureKind::Angle => {
            "Click a place, the corner of the angle, and another place; Backspace takes the last one back, Escape ends"
        }
        MeasureKind::Height => {
            "Click two places to measure how much higher the second is; Escape ends; drags move the camera"
        }
        MeasureKind::Area => {
            "Click around the area, then the first place again or Enter; Backspace takes the last one back, Escape ends"
        }
        MeasureKind::Profile => {
            "Click the two ends of the line to cut along; Escape ends; drags move the camera"
        }
        MeasureKind::Volume => {
            "Click around it on the ground, then the first place again or Enter; Backspace takes the last one back"
        }
        MeasureKind::Note => "Click a place and type a text; Escape ends; drags move the camera",
    }
}
