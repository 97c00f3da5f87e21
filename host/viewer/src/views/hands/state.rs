//! What a hand does, and what is selected.

use super::place::Picture;
use super::stroke::StrokeRun;
use crate::window::Window;
use eframe::egui::Pos2;
use std::sync::Arc;
use surfelshop_api::columns::POSITION;
use surfelshop_api::{Dabs, Handling, StrokeSample, UnitKind};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::{Combine, Selection};

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
    /// It leads a tool, by its name in the registry.
    Tool(String),
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
        HandMode::Rectangle => {
            "Drag a rectangle to select, Shift adds, Ctrl takes away; middle drag to turn, Escape ends"
        }
        HandMode::Lasso => {
            "Draw around what to select, Shift adds, Ctrl takes away; middle drag to turn, Escape ends"
        }
        HandMode::Brush => {
            "Brush over what to select, Shift adds, Ctrl takes away; middle drag to turn, Escape ends"
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
    pub(super) before: Vec<Option<Arc<Selection>>>,
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
    /// What was done last, in a few words.
    pub(crate) said: String,
    /// What is selected of clouds, by the generation of their places; the last ones.
    selections: Vec<(u64, Arc<Selection>)>,
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
            said: String::new(),
            selections: Vec::new(),
        }
    }
}

fn key(cloud: &Cloud) -> Option<u64> {
    cloud.column(POSITION).map(|column| column.generation())
}

impl Hands {
    /// What is selected of a cloud; none where nothing is.
    pub(crate) fn selection_of(&self, cloud: &Cloud) -> Option<Arc<Selection>> {
        let key = key(cloud)?;
        let found = self.selections.iter().rev().find(|(own, _)| *own == key);
        found.map(|(_, selection)| selection.clone()).filter(|s| s.len() == cloud.len())
    }

    /// Selects surfels of a cloud, and no others of it.
    pub(crate) fn set_selection(&mut self, cloud: &Cloud, selection: Option<Arc<Selection>>) {
        let Some(key) = key(cloud) else { return };
        self.selections.retain(|(own, _)| *own != key);
        let selection = selection.filter(|selection| !selection.is_empty());
        self.selections.extend(selection.map(|selection| (key, selection)));
        if self.selections.len() > MOST {
            self.selections.remove(0);
        }
    }

    /// Whether a gesture or a stroke is under way.
    pub(crate) fn is_at_work(&self) -> bool {
        self.gesture.is_some() || self.stroke.is_some()
    }
}

impl Window {
    /// The visible clouds that are in memory, by their index among the open ones, and their place among the visible.
    pub(super) fn hand_clouds(&self) -> Vec<(usize, usize, Cloud)> {
        let Some(shown) = &self.document.clouds else { return Vec::new() };
        let open = &shown.open_clouds;
        let visible = open.all().iter().enumerate().filter(|(_, cloud)| cloud.visible);
        let placed = visible
            .enumerate()
            .map(|(place, (i, open_cloud))| (i, place, &open_cloud.loaded.cloud));
        let in_memory = placed.filter(|(.., cloud)| open.clouds.pyramid_of(cloud).is_none());
        in_memory.map(|(i, place, cloud)| (i, place, cloud.clone())).collect()
    }

    /// What is selected of each visible cloud, for pictures.
    pub(crate) fn visible_selections(&self) -> Vec<Option<Arc<Selection>>> {
        let Some(shown) = &self.document.clouds else { return Vec::new() };
        let visible = shown.open_clouds.all().iter().filter(|open_cloud| open_cloud.visible);
        visible.map(|open| self.views.hands.selection_of(&open.loaded.cloud)).collect()
    }

    /// How many surfels are selected, and of how many.
    pub(crate) fn n_selected(&self) -> (usize, usize) {
        let clouds = self.hand_clouds();
        let selected = clouds.iter().filter_map(|(.., cloud)| self.views.hands.selection_of(cloud));
        let n = selected.map(|selection| selection.count()).sum();
        (n, clouds.iter().map(|(.., cloud)| cloud.len()).sum())
    }

    /// Lets a drag do something else; the camera again where it does that already.
    pub(crate) fn toggle_hand(&mut self, mode: HandMode) {
        let hands = &mut self.views.hands;
        hands.gesture = None;
        hands.mode = if hands.mode == mode { HandMode::Camera } else { mode };
    }

    /// The tools that are led by hand, by their names in the registry.
    pub(crate) fn hand_tools(&self) -> Vec<String> {
        let registry = &self.plugins.registry;
        let names = registry.names(UnitKind::Tool).into_iter();
        names.filter(|name| self.is_led_by_hand(name)).collect()
    }

    /// Whether a tool is led by hand.
    pub(crate) fn is_led_by_hand(&self, name: &str) -> bool {
        let Ok(reference) = self.plugins.registry.find(UnitKind::Tool, name) else { return false };
        let mut units = self.plugins.registry.units(UnitKind::Tool);
        units.any(|(_, manifest, unit)| {
            manifest.id == reference.package && unit.id == reference.id && !unit.handling.is_empty()
        })
    }

    /// Leads a tool by hand.
    pub(crate) fn take_tool(&mut self, name: String) {
        let hands = &mut self.views.hands;
        if hands.tool.as_ref() != Some(&name) {
            (hands.dabs, hands.said) = (None, String::new());
        }
        hands.tool = Some(name.clone());
        (hands.gesture, hands.mode) = (None, HandMode::Tool(name));
    }

    /// Leads the tool that was led last, or lets the hand move the camera again.
    pub(crate) fn toggle_tool(&mut self) {
        if matches!(self.views.hands.mode, HandMode::Tool(_)) {
            self.views.hands.mode = HandMode::Camera;
            return;
        }
        let tools = self.hand_tools();
        let usual = || tools.iter().find(|name| *name == "brush").or(tools.first());
        let last = self.views.hands.tool.as_ref().filter(|last| tools.contains(last));
        match last.or_else(usual).cloned() {
            Some(name) => self.take_tool(name),
            None => self.messages.warn("no tool that is led by hand is installed"),
        }
    }

    /// How a tool's strokes are made: as the user chose, else as the tool says.
    pub(super) fn dabs_of(&self, handling: Handling) -> Dabs {
        self.views.hands.dabs.unwrap_or_else(|| handling.dabs())
    }

    /// Makes brushes larger or smaller.
    pub(crate) fn scale_brush(&mut self, factor: f32) {
        let radius = &mut self.views.hands.radius;
        *radius = (*radius * factor).clamp(0.002, 0.4);
    }

    /// Ends what a hand does: a gesture, else what is selected, else that drags do not move the camera; whether there
    /// was something.
    pub(crate) fn let_go(&mut self) -> bool {
        if let Some(gesture) = self.views.hands.gesture.take() {
            self.restore_selections(&gesture.before);
            self.cancel_stroke();
            return true;
        }
        if self.n_selected().0 > 0 {
            self.select_no_surfels();
            return true;
        }
        let was = std::mem::take(&mut self.views.hands.mode);
        was != HandMode::Camera
    }

    fn restore_selections(&mut self, before: &[Option<Arc<Selection>>]) {
        for (_, place, cloud) in self.hand_clouds() {
            if let Some(before) = before.get(place) {
                self.views.hands.set_selection(&cloud, before.clone());
            }
        }
    }
}
