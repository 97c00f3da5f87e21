//! What the window does with a box and a plane.

use super::shape::{BoxShape, PlaneShape, Shape};
use super::state::Made;
use crate::views::hands::place::rounded;
use crate::views::hands::state::{HandMode, key};
use crate::window::Window;
use glam::DVec3;
use std::sync::Arc;
use surfelshop_cloud::selection::{Combine, Region, RegionStep, Selection};
use surfelshop_session::input::displayed::{Selected, SelectedShare};

/// What a new box leaves of the bounds of all clouds: so its sides lie within the picture.
const FIRST: f64 = 0.6;

/// While a handle is dragged, surfels are selected as it moves where there are at most so many: more would hold it up.
const AT_ONCE: usize = 2_000_000;

/// A shape that was used before is kept where clouds are about as large, between these factors, and it meets them.
const ALIKE: std::ops::Range<f64> = 1e-3..1e3;

impl Window {
    /// Selects by the box or the plane, where the mode has one now.
    pub(in crate::views::hands) fn begin_handles(&mut self) {
        if !matches!(self.views.hands.mode, HandMode::Box | HandMode::Plane) {
            return;
        }
        self.views.hands.handles.made.clear();
        let Some([low, high]) = self.bounds_of_surfels(false) else { return };
        let handles = &mut self.views.hands.handles;
        let size = (high - low).max_element();
        // Of other clouds they may be far away.
        let fits = |corners: [DVec3; 2]| {
            let share = (corners[1] - corners[0]).max_element() / size;
            let meets = corners[1].cmpge(low).all() && corners[0].cmple(high).all();
            meets && (size <= 0.0 || ALIKE.contains(&share))
        };
        handles.of_box = handles.of_box.filter(|shape| fits([shape.low, shape.high]));
        handles.of_plane = handles
            .of_plane
            .filter(|shape| fits([shape.point - shape.reach, shape.point + shape.reach]));
        if let Some(shape) = self.shape() {
            self.set_shape(shape);
        }
        // What is selected already is not taken away before a handle moves.
        if self.n_selected().0 == 0 {
            self.combine_handles(Combine::Replace);
        }
    }

    /// What is selected now stays as it is while handles move.
    pub(super) fn keep_selection_of_handles(&mut self) {
        self.views.hands.handles.made.clear();
    }

    /// The box or the plane that is shown.
    pub(super) fn shape(&self) -> Option<Shape> {
        let handles = &self.views.hands.handles;
        match self.views.hands.mode {
            HandMode::Box => {
                let first = || {
                    let [low, high] = self.bounds_of_surfels(false)?;
                    Some(box_around(0.5 * (low + high), 0.5 * FIRST * (high - low)))
                };
                handles.of_box.or_else(first).map(Shape::Box)
            }
            HandMode::Plane => {
                let first = || {
                    let [low, high] = self.bounds_of_surfels(false)?;
                    let around = box_around(0.5 * (low + high), 0.5 * FIRST * (high - low));
                    Some(PlaneShape {
                        point: 0.5 * (low + high),
                        normal: self.document.up.axis().direction(),
                        reach: 0.5 * (around.high - around.low).max_element(),
                    })
                };
                handles.of_plane.or_else(first).map(Shape::Plane)
            }
            _ => None,
        }
    }

    /// Changes it; whether it is another one. Places have few digits, so that what is typed of them is short.
    pub(super) fn set_shape(&mut self, shape: Shape) -> bool {
        let before = self.shape();
        let handles = &mut self.views.hands.handles;
        match shape {
            Shape::Box(BoxShape { low, high, degrees }) => {
                let size = (high - low).max_element();
                let (low, high) = (rounded(low, size), rounded(high, size));
                let degrees = (degrees * 100.0).round() / 100.0;
                let round = BoxShape { low, high, degrees };
                // What rounding or typing made flat has the thickness that new boxes have at least.
                let is_flat = !low.cmplt(high).all();
                let thick = || box_around(0.5 * (low + high), 0.5 * (high - low));
                handles.of_box =
                    Some(if is_flat { BoxShape { degrees, ..thick() } } else { round });
            }
            Shape::Plane(PlaneShape { point, normal, reach }) => {
                let (point, normal) = (rounded(point, reach), rounded(normal, 1.0));
                handles.of_plane = Some(PlaneShape { point, normal, reach });
            }
        }
        self.shape() != before
    }

    /// Selects by it, if `at_rest` or where that is quick.
    pub(super) fn select_by_shape(&mut self, at_rest: bool) {
        let clouds = self.hand_clouds();
        let n: usize = clouds.iter().map(|(.., cloud)| cloud.len()).sum();
        let n = n + self.hand_pyramids().iter().map(|hand| hand.cloud.len()).sum::<usize>();
        let Some(shape) = self.shape().filter(|_| at_rest || n <= AT_ONCE) else { return };
        let region = shape.region(self.document.up.axis());
        let how = self.views.hands.handles.how;
        for (_, place, cloud) in clouds {
            let Some(key) = key(&cloud) else { continue };
            let hands = &self.views.hands;
            let before = hands.handles.before(key, hands.selected_of(&cloud));
            let own = match &before {
                Some(Selected::Surfels(before)) => Some(&**before),
                Some(Selected::Regions(..)) | None => None,
            };
            let select = |_: Selection| region.select(&cloud);
            match self.combined_selection(place, &cloud, (own, how), select) {
                Ok(chosen) => {
                    let after = Selected::Surfels(Arc::new(chosen));
                    let hands = &mut self.views.hands;
                    hands.set_selected(&cloud, Some(after.clone()));
                    hands.handles.made.insert(key, Made { before, after });
                }
                Err(error) => self.messages.warn(error.to_string()),
            }
        }
        self.select_pyramids_by(&region, how);
    }

    /// The same of pyramids.
    fn select_pyramids_by(&mut self, region: &Region, how: Combine) {
        for hand in self.hand_pyramids() {
            let Some(key) = key(&hand.cloud) else { continue };
            let hands = &self.views.hands;
            let before = hands.handles.before(key, hands.selected_of(&hand.cloud));
            let regions = match &before {
                Some(Selected::Regions(regions, _)) => (**regions).clone(),
                Some(Selected::Surfels(_)) | None => hand.nothing(),
            };
            let step = RegionStep::Take { how, region: region.clone() };
            let regions = Arc::new(regions.with(step));
            self.set_regions(&hand, regions);
            // Where it selects nothing.
            let nothing = || Selected::Regions(Arc::default(), SelectedShare(0.0));
            let after = self.views.hands.selected_of(&hand.cloud).unwrap_or_else(nothing);
            self.views.hands.handles.made.insert(key, Made { before, after });
        }
    }

    /// The box around all surfels, or around those that are selected.
    pub(super) fn fitted_box(&self, selected: bool) -> Option<BoxShape> {
        let [low, high] = self.bounds_of_surfels(selected)?;
        // None lies outside for rounding.
        let half = 0.5 * (high - low) + 1e-3 * (high - low).max_element();
        Some(box_around(0.5 * (low + high), half))
    }

    /// Does something else with what was selected before.
    pub(super) fn combine_handles(&mut self, how: Combine) {
        self.views.hands.handles.how = how;
        self.select_by_shape(true);
    }

    /// The bounds of the visible clouds' surfels, or of what is selected of them.
    fn bounds_of_surfels(&self, selected: bool) -> Option<[DVec3; 2]> {
        let shown = self.document.clouds.as_ref()?;
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for hand in self.hand_pyramids() {
            let selected = match (selected, self.views.hands.regions_of(&hand.cloud)) {
                (false, _) => None,
                (true, None) => continue,
                (true, Some(regions)) => regions.select_in_world(&hand.cloud).ok(),
            };
            let facts = hand.cloud.facts();
            let ends = match &selected {
                None => vec![facts.bounds_min, facts.bounds_max],
                Some(some) => some.indices().filter_map(|i| hand.cloud.world_position(i)).collect(),
            };
            for end in ends {
                bounds = [bounds[0].min(end), bounds[1].max(end)];
            }
        }
        for (_, place, cloud) in self.hand_clouds() {
            let mut take = |[low, high]: [DVec3; 2]| {
                bounds = [bounds[0].min(low), bounds[1].max(high)];
            };
            if !selected && !cloud.is_empty() {
                // The facts of these are known, and of copies they would be found anew.
                let known = shown.open_clouds.clouds.loaded.get(place);
                let facts = known.map_or(&cloud, |known| &known.cloud).facts();
                take([facts.bounds_min, facts.bounds_max]);
            } else if selected && let Some(selection) = self.views.hands.selection_of(&cloud) {
                let places = selection.indices().filter_map(|i| cloud.world_position(i));
                places.for_each(|place| take([place, place]));
            }
        }
        bounds[0].cmple(bounds[1]).all().then_some(bounds)
    }
}

/// A box about a middle, nowhere thinner than a thousandth of its size; about a single place a unit wide.
fn box_around(middle: DVec3, half: DVec3) -> BoxShape {
    let size = half.max_element();
    let least = if size > 0.0 { 1e-3 * size } else { 0.5 };
    let half = half.max(DVec3::splat(least.max(1e-9 * middle.abs().max_element())));
    BoxShape { low: middle - half, high: middle + half, degrees: 0.0 }
}
