//! What the window does with pairs.

use super::picture::PictureLoad;
use super::state::Pairing;
use super::text::{rows, text_of};
use crate::views::hands::HandMode;
use crate::window::Window;
use eframe::egui::Context;
use surfelshop_api::params::{PICTURE_PAIRS, PLACE_PAIRS, ParamDecl, ParamKind, Value};

/// Whether pairs for a parameter can be clicked.
pub(crate) fn can_be_picked(parameter: &ParamDecl) -> bool {
    parameter.kind == ParamKind::Text && [PLACE_PAIRS, PICTURE_PAIRS].contains(&&*parameter.unit)
}

impl Window {
    /// Has the user click pairs for a parameter of a tool, all of whose parameters are these.
    pub(crate) fn pick_pairs(
        &mut self,
        ctx: &Context,
        tool: &str,
        id: &str,
        declared: &[ParamDecl],
    ) {
        if self.document.complete_clouds().is_none() {
            self.messages.report("open a cloud first, then pick places on it");
            return;
        }
        let Some(parameter) = declared.iter().find(|parameter| parameter.id == id) else { return };
        let values = self.plugins.tools.values.entry(tool.to_owned()).or_default();
        let picture = match parameter.unit == PICTURE_PAIRS {
            true => {
                let is_file = |p: &&ParamDecl| matches!(p.kind, ParamKind::File { .. });
                let file = declared.iter().find(is_file).and_then(|file| values.get(&file.id));
                let Some(Value::Text(path)) =
                    file.filter(|value| **value != Value::Text(String::new()))
                else {
                    self.messages.report("choose the picture first, then click where it lies");
                    return;
                };
                Some(PictureLoad::new(path.into(), ctx))
            }
            false => None,
        };
        // A tool that has a choice of this name does something else with another one.
        let has_it = |choice: &&ParamDecl| match &choice.kind {
            ParamKind::Choice(ids) => ids.iter().any(|choice| choice == id),
            _ => false,
        };
        let choice = declared.iter().find(has_it).map(|choice| choice.id.clone());
        let (tool, parameter) = (tool.to_owned(), id.to_owned());
        let hands = &mut self.views.hands;
        hands.pairing =
            Some(Pairing { tool, parameter, choice, picture, place: None, share: None });
        (hands.gesture, hands.mode) = (None, HandMode::Pairs);
        self.views.measuring.places.clear();
    }

    /// Whether pairs are clicked for a tool.
    pub(crate) fn picks_pairs_for(&self, tool: &str) -> bool {
        let hands = &self.views.hands;
        let pairing = hands.pairing.as_ref().filter(|_| hands.mode == HandMode::Pairs);
        pairing.is_some_and(|pairing| pairing.tool == tool)
    }

    /// The pairs so far; `None` where something else was typed.
    pub(super) fn pairs(&self) -> Option<Vec<Vec<f64>>> {
        let pairing = self.views.hands.pairing.as_ref()?;
        let values = self.plugins.tools.values.get(&pairing.tool);
        match values.and_then(|values| values.get(&pairing.parameter)) {
            Some(Value::Text(text)) => rows(text, pairing.n_numbers()),
            _ => Some(Vec::new()),
        }
    }

    pub(super) fn set_pairs(&mut self, pairs: &[Vec<f64>]) {
        let Some(pairing) = &self.views.hands.pairing else { return };
        let values = self.plugins.tools.values.entry(pairing.tool.clone()).or_default();
        match pairs.is_empty() {
            true => drop(values.remove(&pairing.parameter)),
            false => drop(values.insert(pairing.parameter.clone(), Value::Text(text_of(pairs)))),
        }
        let Some(choice) = &pairing.choice else { return };
        match pairs.is_empty() {
            true => drop(values.remove(choice)),
            false => drop(values.insert(choice.clone(), Value::Text(pairing.parameter.clone()))),
        }
    }

    /// Adds a pair; what was typed before and is none is left out.
    pub(super) fn add_pair(&mut self, pair: Vec<f64>) {
        let mut pairs = self.pairs().unwrap_or_default();
        pairs.push(pair);
        self.set_pairs(&pairs);
    }
}
