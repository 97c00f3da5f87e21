//! What the window asks of hands: what they do, and what is selected.

use super::pairs::Pairing;
use super::state::HandMode;
use crate::window::Window;
use surfelshop_api::{Dabs, Handling, UnitKind};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::Tint;
use surfelshop_session::input::displayed::Selected;

impl Window {
    /// The visible clouds that are in memory, by their index among the open ones, and their place among the visible.
    pub(super) fn hand_clouds(&self) -> Vec<(usize, usize, Cloud)> {
        let Some(shown) = &self.document.clouds else { return Vec::new() };
        let open = &shown.open_clouds;
        let visible = open.all().iter().enumerate().filter(|(_, cloud)| cloud.visible);
        let placed = visible.enumerate().map(|(place, (i, open_cloud))| (i, place, open_cloud));
        let in_memory = placed.filter(|(.., open_cloud)| open_cloud.pyramid().is_none());
        in_memory.map(|(i, place, open)| (i, place, open.loaded.cloud.clone())).collect()
    }

    /// What is selected of each visible cloud, for pictures.
    pub(crate) fn visible_selections(&self) -> Vec<Option<Selected>> {
        let Some(shown) = &self.document.clouds else { return Vec::new() };
        let visible = shown.open_clouds.all().iter().filter(|open_cloud| open_cloud.visible);
        visible.map(|open| self.views.hands.selected_of(&open.loaded.cloud)).collect()
    }

    /// How strongly what is selected is tinted: what a tool paints there has to be seen.
    pub(crate) fn tint(&self) -> Tint {
        match self.views.hands.mode {
            HandMode::Tool(_) => Tint::Faint,
            _ => Tint::Full,
        }
    }

    /// How many surfels are selected, and of how many; of pyramids about.
    pub(crate) fn n_selected(&self) -> (usize, usize) {
        let clouds = self.hand_clouds();
        let selected = clouds.iter().filter_map(|(.., cloud)| self.views.hands.selection_of(cloud));
        let n: usize = selected.map(|selection| selection.count()).sum();
        let of: usize = clouds.iter().map(|(.., cloud)| cloud.len()).sum();
        let (of_pyramids, all_of_pyramids) = self.n_selected_of_pyramids();
        (n + of_pyramids, of + all_of_pyramids)
    }

    /// Lets a drag do something else; the camera again where it does that already.
    pub(crate) fn toggle_hand(&mut self, mode: HandMode) {
        let hands = &mut self.views.hands;
        (hands.gesture, hands.pairing) = (None, None);
        hands.mode = if hands.mode == mode { HandMode::Camera } else { mode };
        self.begin_handles();
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
        (hands.gesture, hands.pairing) = (None, None);
        hands.mode = HandMode::Tool(name);
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
            None => self.messages.warn("no interactive tool is installed"),
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

    /// Ends what a hand does: a measure, a gesture, else what is selected, else that drags do not move the camera; whether there
    /// was something.
    pub(crate) fn let_go(&mut self) -> bool {
        if !self.views.measuring.places.is_empty() {
            self.views.measuring.places.clear();
            return true;
        }
        let pairing = &mut self.views.hands.pairing;
        if self.views.hands.mode == HandMode::Pairs {
            if !pairing.as_mut().is_some_and(Pairing::forget_place) {
                (*pairing, self.views.hands.mode) = (None, HandMode::Camera);
            }
            return true;
        }
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

    fn restore_selections(&mut self, before: &[Option<Selected>]) {
        let pyramids = self.hand_pyramids().into_iter();
        let pyramids = pyramids.map(|hand| (hand.index, hand.place, hand.cloud));
        for (_, place, cloud) in self.hand_clouds().into_iter().chain(pyramids) {
            if let Some(before) = before.get(place) {
                self.views.hands.set_selected(&cloud, before.clone());
            }
        }
    }
}
