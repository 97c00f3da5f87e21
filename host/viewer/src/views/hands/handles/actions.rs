//! What the window does with a box and a plane.

use super::shape::{BoxShape, PlaneShape, Shape};
use crate::views::hands::place::rounded;
use crate::views::hands::state::HandMode;
use crate::window::Window;
use glam::DVec3;
use std::sync::Arc;
use surfelshop_api::columns::POSITION;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::{Combine, Selection};

/// What a new box leaves of the bounds of all clouds: so its sides lie within the picture.
const FIRST: f64 = 0.6;

/// While a handle is dragged, surfels are selected as it moves where there are at most so many: more would hold it up.
const AT_ONCE: usize = 2_000_000;

fn key(cloud: &Cloud) -> u64 {
    cloud.column(POSITION).map_or(0, surfelshop_cloud::Column::generation)
}

impl Window {
    /// Selects by a box or a plane; drags move the camera again where that is so already.
    pub(crate) fn toggle_handles(&mut self, mode: HandMode) {
        let bounds = self.bounds_of_surfels(false);
        self.toggle_hand(mode);
        self.keep_selection_of_handles();
        let (Some([low, high]), handles) = (bounds, &mut self.views.hands.handles) else { return };
        // Of other clouds they may be far away.
        let is_near = |place: DVec3| place.cmpge(low).all() && place.cmple(high).all();
        handles.of_box = handles.of_box.filter(|shape| is_near(0.5 * (shape.low + shape.high)));
        handles.of_plane = handles.of_plane.filter(|shape| is_near(shape.point));
    }

    /// What is selected now stays as it is while handles move.
    pub(super) fn keep_selection_of_handles(&mut self) {
        let selected = self
            .hand_clouds()
            .into_iter()
            .filter_map(|(.., cloud)| Some((key(&cloud), self.views.hands.selection_of(&cloud)?)));
        self.views.hands.handles.before = selected.collect();
    }

    /// The box or the plane that is shown.
    pub(super) fn shape(&self) -> Option<Shape> {
        let handles = &self.views.hands.handles;
        match self.views.hands.mode {
            HandMode::Box => {
                let first = || {
                    let [low, high] = self.bounds_of_surfels(false)?;
                    let (middle, half) = (0.5 * (low + high), 0.5 * FIRST * (high - low));
                    let thinnest = DVec3::splat(1e-3 * half.max_element().max(f64::MIN_POSITIVE));
                    let half = half.max(thinnest);
                    Some(BoxShape { low: middle - half, high: middle + half, degrees: 0.0 })
                };
                handles.of_box.or_else(first).map(Shape::Box)
            }
            HandMode::Plane => {
                let first = || {
                    let [low, high] = self.bounds_of_surfels(false)?;
                    Some(PlaneShape {
                        point: 0.5 * (low + high),
                        normal: self.document.up.axis().direction(),
                        reach: (0.5 * FIRST * (high - low).max_element()).max(f64::MIN_POSITIVE),
                    })
                };
                handles.of_plane.or_else(first).map(Shape::Plane)
            }
            _ => None,
        }
    }

    /// Changes it. Places have few digits, so that what is typed of them is short.
    pub(super) fn set_shape(&mut self, shape: Shape) {
        let handles = &mut self.views.hands.handles;
        match shape {
            Shape::Box(BoxShape { low, high, degrees }) => {
                let size = (high - low).max_element();
                let (low, high) = (rounded(low, size), rounded(high, size));
                let degrees = (degrees * 100.0).round() / 100.0;
                if low.cmplt(high).all() {
                    handles.of_box = Some(BoxShape { low, high, degrees });
                }
            }
            Shape::Plane(PlaneShape { point, normal, reach }) => {
                let (point, normal) = (rounded(point, reach), rounded(normal, 1.0));
                handles.of_plane = Some(PlaneShape { point, normal, reach });
            }
        }
    }

    /// Selects by it, if `at_rest` or where that is quick.
    pub(super) fn select_by_shape(&mut self, at_rest: bool) {
        let clouds = self.hand_clouds();
        let n: usize = clouds.iter().map(|(.., cloud)| cloud.len()).sum();
        let Some(shape) = self.shape().filter(|_| at_rest || n <= AT_ONCE) else { return };
        let region = shape.region(self.document.up.axis());
        let how = self.views.hands.handles.how;
        for (_, place, cloud) in clouds {
            let handles = &self.views.hands.handles;
            let before = handles.before.iter().find(|(own, _)| *own == key(&cloud));
            let combined = Selection::none(cloud.len()).and_then(|none| {
                let shown = self.only_shown(place, region.select(&cloud)?)?;
                before.map_or(&none, |(_, before)| before).combined(&shown, how)
            });
            match combined {
                Ok(chosen) => self.views.hands.set_selection(&cloud, Some(Arc::new(chosen))),
                Err(error) => self.messages.warn(error.to_string()),
            }
        }
    }

    /// Puts the box around all surfels, or around those that are selected.
    pub(super) fn fit_box(&mut self, selected: bool) {
        let Some([low, high]) = self.bounds_of_surfels(selected) else { return };
        // None lies outside for rounding.
        let more = DVec3::splat(1e-3 * (high - low).max_element().max(f64::MIN_POSITIVE));
        self.set_shape(Shape::Box(BoxShape { low: low - more, high: high + more, degrees: 0.0 }));
    }

    /// Does something else with what was selected before.
    pub(super) fn combine_handles(&mut self, how: Combine) {
        self.views.hands.handles.how = how;
        self.select_by_shape(true);
    }

    /// The bounds of the visible clouds' surfels, or of what is selected of them.
    fn bounds_of_surfels(&self, selected: bool) -> Option<[DVec3; 2]> {
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for (.., cloud) in self.hand_clouds() {
            let mut take = |[low, high]: [DVec3; 2]| {
                bounds = [bounds[0].min(low), bounds[1].max(high)];
            };
            if !selected {
                let facts = cloud.facts();
                take([facts.bounds_min, facts.bounds_max]);
            } else if let Some(selection) = self.views.hands.selection_of(&cloud) {
                let places = selection.indices().filter_map(|i| cloud.world_position(i));
                places.for_each(|place| take([place, place]));
            }
        }
        bounds[0].cmple(bounds[1]).all().then_some(bounds)
    }
}
