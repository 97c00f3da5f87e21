//! Surfels that are hidden: each time a step of undo. Clouds and their files stay as they are, and a scene has what is hidden.

use crate::window::Window;
use std::sync::Arc;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::display::hidden;
use surfelshop_cloud::in_groups;
use surfelshop_cloud::selection::{
    Combine, EditLayer, LayerChange, RegionSelection, RegionStep, Selection, SelectionError,
};

impl Window {
    /// Hides what is selected.
    pub(crate) fn hide_surfels(&mut self) {
        let hide =
            |before: &Selection, selected: &Selection| before.combined(selected, Combine::Add);
        self.hide(hide, |layer, chosen| Ok(layer.with(chosen, LayerChange::Hide)));
    }

    /// Hides what is not selected, and clouds of which nothing is.
    pub(crate) fn hide_other_surfels(&mut self) {
        let pyramids = self.hand_pyramids().into_iter().map(|hand| (hand.index, hand.cloud));
        let clouds = self.hand_clouds().into_iter().map(|(index, _, cloud)| (index, cloud));
        let others: Vec<usize> = clouds
            .chain(pyramids)
            .filter(|(_, cloud)| self.views.hands.selected_of(cloud).is_none())
            .map(|(index, _)| index)
            .collect();
        let hide = |before: &Selection, selected: &Selection| {
            before.combined(&selected.inverted(), Combine::Add)
        };
        self.hide(hide, |layer, chosen| {
            Ok(layer.with(chosen.with(RegionStep::Invert), LayerChange::Hide))
        });
        for index in others {
            let Some(shown) = &self.document.clouds else { return };
            let without = shown.open_clouds.showing(index, false);
            self.show_clouds(without);
        }
    }

    /// Hides surfels of the clouds of which something is selected.
    fn hide(
        &mut self,
        combine: impl Fn(&Selection, &Selection) -> Result<Selection, SelectionError>,
        of_pyramids: impl Fn(&EditLayer, RegionSelection) -> Result<EditLayer, String>,
    ) {
        // Earlier changes are a step of their own.
        self.document.history.record(&self.snapshot());
        let of_pyramid = match self.edit_layers(&of_pyramids) {
            Ok(of_pyramid) => of_pyramid,
            Err(line) => return self.messages.warn(line),
        };
        let mut n = 0;
        for (index, _, cloud) in self.hand_clouds() {
            let Some(selected) = self.views.hands.selection_of(&cloud) else { continue };
            let Some(shown) = &self.document.clouds else { return };
            let combined = hidden_of(&cloud).and_then(|before| {
                let after = combine(&before, &selected)?;
                Ok((after.count() - before.count(), shown.open_clouds.hiding(index, &after)?))
            });
            match combined {
                Ok((more, changed)) => {
                    n += more;
                    self.views.hands.set_selection(&cloud, None);
                    self.show_clouds(changed);
                }
                Err(error) => return self.messages.warn(error.to_string()),
            }
        }
        if of_pyramid {
            return self.messages.report("hidden; Alt+H shows it again");
        }
        let plural = if n == 1 { "" } else { "s" };
        self.messages
            .report(format!("hid {} surfel{plural}; Alt+H shows them", in_groups(n as u64)));
    }

    /// Shows all hidden surfels of the visible clouds.
    pub(crate) fn show_hidden_surfels(&mut self) {
        self.document.history.record(&self.snapshot());
        for (index, _, cloud) in self.hand_clouds() {
            let Some(shown) = &self.document.clouds else { return };
            let whole = Selection::none(cloud.len());
            match whole.and_then(|none| shown.open_clouds.hiding(index, &none)) {
                Ok(changed) => self.show_clouds(changed),
                Err(error) => return self.messages.warn(error.to_string()),
            }
        }
        self.show_hidden_of_pyramids();
    }

    /// The surfels that a tool is led over: those that are selected, else those that are not hidden; `None` for all.
    pub(super) fn led_over(&self, cloud: &Cloud) -> Option<Arc<Selection>> {
        let shown = || Some(Arc::new(hidden(cloud).ok()??.inverted()));
        self.views.hands.selection_of(cloud).or_else(shown)
    }

    /// Whether surfels of a visible cloud are hidden.
    pub(crate) fn has_hidden_surfels(&self) -> bool {
        let has = |cloud: &Cloud| cloud.column(surfelshop_cloud::display::HIDDEN).is_some();
        self.hides_of_pyramids() || self.hand_clouds().iter().any(|(.., cloud)| has(cloud))
    }
}

/// Which surfels of a cloud are hidden.
fn hidden_of(cloud: &Cloud) -> Result<Selection, SelectionError> {
    match hidden(cloud)? {
        Some(hidden) => Ok(hidden),
        None => Selection::none(cloud.len()),
    }
}
