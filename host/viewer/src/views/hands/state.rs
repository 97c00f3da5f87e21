//! What a hand does, and what is selected.

use super::handles::Handles;
use super::pairs::Pairing;
use super::place::Picture;
use super::stroke_run::StrokeRun;
use crate::views::measuring;
use eframe::egui::Pos2;
use std::sync::Arc;
use surfelshop_api::columns::POSITION;
use surfelshop_api::{Dabs, StrokeSample};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::scene::MeasureKind;
use surfelshop_cloud::selection::{Combine, RegionSelection, Selection};
use surfelshop_session::input::displayed::{Selected, SelectedShare};

/// Most selections of clouds that were there before: undo brings these and what was selected of them back.
const MOST: usize = 32;

/// What a drag with the first button does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum HandMode {
    /// It moves the camera.
    #[default]
    Camera,
    /// It selects what is in a rectangle.
    Rectangle,
    /// It selects what is within a line.
    Lasso,
    /// It selects what it goes over.
    Brush,
    /// It moves the camera, or handles of a box, which selects what is in it.
    Box,
    /// The same of a plane, which selects what lies before it.
    Plane,
    /// It leads a tool, by its name in the registry.
    Tool(String),
    /// It moves the camera, and clicks measure.
    Measure(MeasureKind),
    /// It moves the camera, and clicks add places to pairs.
    Pairs,
}

impl HandMode {
    /// Whether surfels are selected.
    pub(crate) fn selects(&self) -> bool {
        matches!(self, Self::Rectangle | Self::Lasso | Self::Brush)
    }

    /// Whether the pointer has a sphere.
    pub(super) fn has_radius(&self) -> bool {
        matches!(self, Self::Brush | Self::Tool(_))
    }
}

/// What mouse and keys do, for the status line; none where they move the camera.
pub(crate) fn hint(mode: &HandMode) -> Option<&'static str> {
    Some(match mode {
        HandMode::Camera => return None,
        HandMode::Measure(kind) => measuring::hint(*kind),
        HandMode::Pairs => {
            "Click places that belong together; Backspace takes the last one back, Escape ends; drags move the camera"
        }
        HandMode::Box => {
            "Drag the dots to change the box, which selects what is in it; other drags move the camera, Escape ends"
        }
        HandMode::Plane => {
            "Drag the dots to move and tilt the plane, or click the cloud; other drags move the camera, Escape ends"
        }
        HandMode::Rectangle => {
            "Drag a rectangle to select, Shift adds, Ctrl removes; middle drag to turn, Escape ends"
        }
        HandMode::Lasso => {
            "Draw around what to select, Shift adds, Ctrl removes; middle drag to turn, Escape ends"
        }
        HandMode::Brush => {
            "Brush over what to select, Shift adds, Ctrl removes; middle drag to turn, Escape ends"
        }
        HandMode::Tool(_) => {
            "Drag over the cloud to lead the tool, [ and ] change its radius; middle drag to turn, Escape ends"
        }
    })
}

/// A gesture that is being made.
pub(super) struct Gesture {
    pub(super) pane: u32,
    /// Where it was, in points of the window.
    pub(super) line: Vec<Pos2>,
    /// The picture that it is made over, as it was when it began.
    pub(super) picture: Picture,
    /// Where it was on the surface.
    pub(super) samples: Vec<StrokeSample>,
    /// Radius of its dabs, scene units.
    pub(super) radius: f64,
    /// When it began, seconds.
    pub(super) began: f64,
    pub(super) how: Combine,
    /// What was selected before it, of each visible cloud.
    pub(super) before: Vec<Option<Selected>>,
}

/// What hands do.
pub(crate) struct Hands {
    pub(crate) mode: HandMode,
    /// The tool that was led last.
    pub(crate) tool: Option<String>,
    /// Radius of brushes, share of the picture's height.
    pub(crate) radius: f32,
    /// Whether what lies behind is selected, too.
    pub(crate) through: bool,
    /// What a tool's strokes are made of; as the tool says until the user chooses.
    pub(crate) dabs: Option<Dabs>,
    /// What is written into a column of what is selected: its name, and a number.
    pub(crate) value: (String, f64),
    pub(super) gesture: Option<Gesture>,
    pub(super) stroke: Option<StrokeRun>,
    /// The pairs that are clicked.
    pub(crate) pairing: Option<Pairing>,
    /// The box and the plane that select.
    pub(super) handles: Handles,
    /// What was done last, in a few words.
    pub(crate) said: String,
    /// What is selected of clouds, by the generation of their places; the last ones.
    selections: Vec<(u64, Selected)>,
}

impl Default for Hands {
    fn default() -> Self {
        Self {
            mode: HandMode::Camera,
            tool: None,
            radius: 0.05,
            through: false,
            dabs: None,
            value: ("class".to_owned(), 1.0),
            gesture: None,
            stroke: None,
            pairing: None,
            handles: Handles::default(),
            said: String::new(),
            selections: Vec::new(),
        }
    }
}

pub(super) fn key(cloud: &Cloud) -> Option<u64> {
    cloud.column(POSITION).map(|column| column.generation())
}

impl Hands {
    /// What is selected of a cloud; none where nothing is.
    pub(crate) fn selection_of(&self, cloud: &Cloud) -> Option<Arc<Selection>> {
        match self.selected_of(cloud)? {
            Selected::Surfels(selection) => Some(selection),
            Selected::Regions(..) => None,
        }
    }

    /// What is selected of a pyramid, by the cloud that stands for it; none where nothing is.
    pub(crate) fn regions_of(&self, cloud: &Cloud) -> Option<Arc<RegionSelection>> {
        match self.selected_of(cloud)? {
            Selected::Surfels(_) => None,
            Selected::Regions(regions, _) => Some(regions),
        }
    }

    /// What is selected of a cloud or a pyramid; none where nothing is.
    pub(crate) fn selected_of(&self, cloud: &Cloud) -> Option<Selected> {
        let key = key(cloud)?;
        let found = self.selections.iter().rev().find(|(own, _)| *own == key);
        let fits = |selected: &Selected| match selected {
            Selected::Surfels(selection) => selection.len() == cloud.len(),
            Selected::Regions(..) => true,
        };
        found.map(|(_, selected)| selected.clone()).filter(fits)
    }

    /// Selects surfels of a cloud, and no others of it.
    pub(crate) fn set_selection(&mut self, cloud: &Cloud, selection: Option<Arc<Selection>>) {
        self.set_selected(cloud, selection.map(Selected::Surfels));
    }

    /// Selects surfels of a cloud or a pyramid, and no others of it.
    pub(crate) fn set_selected(&mut self, cloud: &Cloud, selection: Option<Selected>) {
        let Some(key) = key(cloud) else { return };
        self.selections.retain(|(own, _)| *own != key);
        let selection = selection.filter(|selection| !selection.is_empty());
        self.selections.extend(selection.map(|selection| (key, selection)));
        if self.selections.len() > MOST {
            self.selections.remove(0);
        }
    }

    /// About which share of a pyramid is selected; nothing where none is.
    pub(super) fn share_of(&self, cloud: &Cloud) -> Option<f64> {
        match self.selected_of(cloud)? {
            Selected::Surfels(_) => None,
            Selected::Regions(_, SelectedShare(share)) => Some(share),
        }
    }

    /// Whether a hand is changing what is seen.
    pub(crate) fn is_led(&self) -> bool {
        self.gesture.is_some()
    }

    /// Whether a gesture or a stroke is under way.
    pub(crate) fn is_at_work(&self) -> bool {
        self.gesture.is_some() || self.stroke.is_some()
    }
}
