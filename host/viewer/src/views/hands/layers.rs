//! Hands over pyramids: what is selected is known by regions, and edits go into a layer that is kept beside the file.

use crate::window::Window;
use glam::DVec3;
use std::sync::Arc;
use surfelshop_api::{SurfaceSettings, View};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::display::{Attribute, FilterAction};
use surfelshop_cloud::selection::{
    Combine, EditLayer, LayerChange, Region, RegionSelection, RegionStep,
};
use surfelshop_session::input::displayed::{Selected, SelectedShare};
use surfelshop_session::input::pyramids::{DETAIL_PX, OpenPyramid};

/// A visible pyramid.
pub(super) struct HandPyramid {
    /// Its index among the open clouds.
    pub(super) index: usize,
    /// Its place among the visible ones.
    pub(super) place: usize,
    /// The cloud that stands for it.
    pub(super) cloud: Cloud,
    pyramid: Arc<OpenPyramid>,
}

/// Merged surfels that a selection by what is seen reckons with at most, pixels: coarser ones are replaced within a
/// moment, and what they stand for behind a wall is not selected with the wall.
const COARSEST: f64 = 8.0;

/// What edits do with a layer: the layer with the edit, or a line why there is none.
type Edit<'a> = &'a dyn Fn(&EditLayer, RegionSelection) -> Result<EditLayer, String>;

impl HandPyramid {
    /// A selection of nothing.
    pub(super) fn nothing(&self) -> RegionSelection {
        RegionSelection { placed: *self.pyramid.transform(), steps: Vec::new() }
    }

    /// The nodes that `reaches` says yes of, by balls around them in the world, of at most so many surfels.
    pub(super) fn nodes_within(
        &self,
        reaches: impl Fn(DVec3, f64) -> bool,
        most: u64,
    ) -> Result<Vec<Arc<Cloud>>, String> {
        self.pyramid.within(reaches, most).map_err(|error| error.to_string())
    }

    fn name(&self) -> String {
        self.pyramid.pyramid().path().display().to_string()
    }
}

impl Window {
    /// The visible pyramids.
    pub(super) fn hand_pyramids(&self) -> Vec<HandPyramid> {
        let Some(shown) = &self.document.clouds else { return Vec::new() };
        let all = shown.open_clouds.all().iter().enumerate();
        let visible = all.filter(|(_, open_cloud)| open_cloud.visible).enumerate();
        let pyramids = visible.filter_map(|(place, (index, open_cloud))| {
            let pyramid = Arc::clone(open_cloud.pyramid()?);
            Some(HandPyramid { index, place, cloud: open_cloud.loaded.cloud.clone(), pyramid })
        });
        pyramids.collect()
    }

    /// About how many surfels of pyramids are selected, and of how many; at least one of each of which something is.
    pub(super) fn n_selected_of_pyramids(&self) -> (usize, usize) {
        let (mut n, mut of) = (0, 0);
        for HandPyramid { cloud, pyramid, .. } in self.hand_pyramids() {
            let all = usize::try_from(pyramid.n_about()).unwrap_or(usize::MAX);
            let all = if pyramid.layer().is_empty() { all } else { rounded(all) };
            of += all;
            let share = self.views.hands.share_of(&cloud);
            n += share.map_or(0, |share| rounded((share * all as f64) as usize).max(1));
        }
        (n, of)
    }

    /// What stands before the number of what is selected.
    pub(super) fn about_selected(&self) -> &'static str {
        if self.has_regions() { "about " } else { "" }
    }

    /// Whether something of a pyramid is selected.
    pub(super) fn has_regions(&self) -> bool {
        let all = self.hand_pyramids();
        all.iter().any(|hand| self.views.hands.regions_of(&hand.cloud).is_some())
    }

    /// Selects regions of pyramids, from what `before` says was selected of each.
    pub(super) fn select_regions(
        &mut self,
        before: impl Fn(&Self, &HandPyramid) -> Option<Arc<RegionSelection>>,
        step: impl Fn(&Self, &HandPyramid) -> RegionStep,
    ) {
        for hand in self.hand_pyramids() {
            let step = step(self, &hand);
            let before = before(self, &hand);
            let before = before.map_or_else(|| hand.nothing(), |before| (*before).clone());
            self.set_regions(&hand, Arc::new(before.with(step)));
        }
    }

    /// Selects regions of a pyramid, and nothing else of it; nothing where they do not come near it.
    pub(super) fn set_regions(&mut self, hand: &HandPyramid, regions: Arc<RegionSelection>) {
        let share = hand.pyramid.selected_share(&self.shown_of(hand, &regions), &hand.cloud);
        let selected = match share {
            Ok(share) => share.map(|share| Selected::Regions(regions, SelectedShare(share))),
            Err(error) => return self.messages.warn(format!("{}: {error:#}", hand.name())),
        };
        self.views.hands.set_selected(&hand.cloud, selected);
    }

    /// Changes what is selected of each visible pyramid.
    pub(super) fn change_regions(&mut self, step: &RegionStep) {
        self.select_regions(
            |window, hand| window.views.hands.regions_of(&hand.cloud),
            |_, _| step.clone(),
        );
    }

    /// Radius in pixels of the merged surfels that are seen of a pyramid.
    pub(super) fn merged_px(&self, hand: &HandPyramid, view: &View) -> f32 {
        let shown = self.document.clouds.as_ref();
        let shown = shown.and_then(|shown| {
            let displayed = shown.clouds.loaded.get(hand.place)?;
            shown.clouds.pyramid_of(&displayed.cloud)
        });
        let pyramid = shown.unwrap_or(&hand.pyramid);
        let has = |node| pyramid.nodes().has(node);
        let cut = pyramid.cut((view, &SurfaceSettings::default()), DETAIL_PX, has);
        cut.coarsest_px.clamp(f64::from(DETAIL_PX), COARSEST) as f32
    }

    /// Changes the layers of the pyramids of which something is selected; whether there are some.
    ///
    /// # Errors
    /// A line; nothing has changed.
    pub(super) fn edit_layers(&mut self, edit: Edit<'_>) -> Result<bool, String> {
        let Some(shown) = &self.document.clouds else { return Ok(false) };
        let mut changed = shown.open_clouds.clone();
        let mut kept = Vec::new();
        for hand in self.hand_pyramids() {
            let Some(regions) = self.views.hands.regions_of(&hand.cloud) else { continue };
            let layer = edit(hand.pyramid.layer(), self.shown_of(&hand, &regions))?;
            kept.push((hand.index, layer.sets_values().then_some(regions)));
            changed = changed
                .layered(hand.index, layer)
                .map_err(|error| format!("{}: {error:#}", hand.name()))?;
        }
        if kept.is_empty() {
            return Ok(false);
        }
        self.show_clouds(changed);
        // Surfels that stay where they are stay selected.
        for (index, regions) in kept {
            let now = self.hand_pyramids().into_iter().find(|now| now.index == index);
            if let Some((now, regions)) = now.zip(regions) {
                self.set_regions(&now, regions);
            }
        }
        Ok(true)
    }

    /// Shows what is hidden of visible pyramids.
    pub(super) fn show_hidden_of_pyramids(&mut self) {
        for hand in self.hand_pyramids().into_iter().filter(|hand| hand.pyramid.layer().hides()) {
            let Some(shown) = &self.document.clouds else { return };
            let layer = hand.pyramid.layer().showing_all();
            match shown.open_clouds.layered(hand.index, layer) {
                Ok(changed) => self.show_clouds(changed),
                Err(error) => return self.messages.warn(format!("{}: {error:#}", hand.name())),
            }
        }
    }

    /// Whether something is hidden of a visible pyramid.
    pub(super) fn hides_of_pyramids(&self) -> bool {
        self.hand_pyramids().iter().any(|hand| hand.pyramid.layer().hides())
    }

    /// Of what is selected of a pyramid what filters show. A filter by an attribute that it lacks shows all of it.
    pub(super) fn shown_of(
        &self,
        hand: &HandPyramid,
        regions: &RegionSelection,
    ) -> RegionSelection {
        let settings = self.display_settings();
        let filters = settings.filters.iter().filter(|filter| match &filter.attribute {
            Attribute::Height => true,
            Attribute::Column { name, .. } => hand.cloud.column(name).is_some(),
        });
        filters.fold(regions.clone(), |regions, filter| {
            let how = match filter.action {
                FilterAction::Keep => Combine::Intersect,
                FilterAction::Hide => Combine::Subtract,
            };
            let (attribute, test) = (filter.attribute.clone(), filter.test.clone());
            let region = Region::Values { attribute, test, up: settings.up };
            regions.with(RegionStep::Take { how, region })
        })
    }
}

/// A number of three digits, and zeros: what is told of merged surfels is no closer.
fn rounded(n: usize) -> usize {
    let step = 10usize.pow(n.max(1).ilog10().saturating_sub(2));
    (n + step / 2) / step * step
}

/// The edit that deletes what is selected.
pub(super) fn deleting(layer: &EditLayer, chosen: RegionSelection) -> Result<EditLayer, String> {
    Ok(layer.with(chosen, LayerChange::Delete))
}

/// The edit that deletes what is not selected.
pub(super) fn cropping(layer: &EditLayer, chosen: RegionSelection) -> Result<EditLayer, String> {
    Ok(layer.with(chosen.with(RegionStep::Invert), LayerChange::Delete))
}
