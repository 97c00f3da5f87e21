//! What gestures select.

use super::layers::HandPyramid;
use super::state::{Gesture, HandMode};
use crate::window::Window;
use eframe::egui::Context;
use std::sync::Arc;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::{
    Combine, DepthPicture, Region, RegionStep, ScreenRegion, ScreenShape, Selection,
    SelectionError, grown, shrunk, usual_distance,
};
use surfelshop_session::input::displayed::Selected;

/// Columns and rows of the distances that a pyramid's layer keeps of a picture: 400 kB as text.
const MOST_CELLS: u32 = 256;

impl Window {
    /// Shows what a gesture does so far, where that is quick.
    pub(super) fn preview_gesture(&mut self, ctx: &Context) {
        match self.views.hands.mode.clone() {
            HandMode::Brush => self.select_along(),
            HandMode::Tool(name) => self.lead_tool(ctx, &name, false),
            HandMode::Camera
            | HandMode::Rectangle
            | HandMode::Lasso
            | HandMode::Box
            | HandMode::Plane
            | HandMode::Measure(_)
            | HandMode::Pairs => {}
        }
        ctx.request_repaint();
    }

    /// Does what a gesture meant.
    pub(super) fn end_gesture(&mut self, ctx: &Context, gesture: Gesture) {
        match self.views.hands.mode.clone() {
            HandMode::Camera
            | HandMode::Box
            | HandMode::Plane
            | HandMode::Measure(_)
            | HandMode::Pairs => {}
            HandMode::Brush => {
                self.views.hands.gesture = Some(gesture);
                self.select_along();
                self.views.hands.gesture = None;
            }
            HandMode::Rectangle | HandMode::Lasso => self.select_in(&gesture),
            HandMode::Tool(name) => {
                self.views.hands.gesture = Some(gesture);
                self.lead_tool(ctx, &name, true);
                self.views.hands.gesture = None;
            }
        }
        ctx.request_repaint();
    }

    /// Selects what is in a part of a picture.
    fn select_in(&mut self, gesture: &Gesture) {
        let picture = &gesture.picture;
        let line: Vec<_> = gesture.line.iter().map(|at| picture.pixel(*at)).collect();
        let shape = match (&self.views.hands.mode, &line[..]) {
            (HandMode::Rectangle, [a, b]) => ScreenShape::Rectangle([*a, *b]),
            (HandMode::Lasso, [_, _, _, ..]) => ScreenShape::Lasso(line),
            // A click takes what was selected away.
            _ if gesture.how == Combine::Replace => return self.select_no_surfels(),
            _ => return,
        };
        let size = [picture.depth.width, picture.depth.height];
        let depth = match self.views.hands.through {
            true => Ok(None),
            false => DepthPicture::new(size, &picture.depth.data, (&shape, picture.view.size_px))
                .map(Some),
        };
        let depth = match depth {
            Ok(depth) => depth,
            Err(error) => return self.messages.warn(error.to_string()),
        };
        let region = ScreenRegion { view: picture.view, shape, depth };
        self.select_by(gesture, |cloud, _| region.select(cloud));
        self.select_regions_by(gesture, |window, hand| {
            let mut seen = region.clone();
            seen.depth = seen
                .depth
                .map(|depth| depth.coarse(MOST_CELLS, window.merged_px(hand, &region.view)));
            Region::Seen(Box::new(seen))
        });
    }

    /// Selects regions of pyramids, together with what was selected before the gesture as its keys say.
    fn select_regions_by(
        &mut self,
        gesture: &Gesture,
        region: impl Fn(&Self, &HandPyramid) -> Region,
    ) {
        let before = |_: &Self, hand: &HandPyramid| match gesture.before.get(hand.place)? {
            Some(Selected::Regions(regions, _)) => Some(Arc::clone(regions)),
            Some(Selected::Surfels(_)) | None => None,
        };
        self.select_regions(before, |window, hand| RegionStep::Take {
            how: gesture.how,
            region: region(window, hand),
        });
    }

    /// Selects what the brush has gone over.
    fn select_along(&mut self) {
        let Some(gesture) = self.views.hands.gesture.take() else { return };
        let radius = gesture.radius;
        // It is selected as it is gone over, so that only the last places are new.
        let places: Vec<_> = gesture.samples.iter().map(|sample| sample.place).collect();
        self.select_by(&gesture, |cloud, chosen| {
            places.iter().try_fold(chosen, |chosen, center| {
                let near = Region::Sphere { center: *center, radius }.select(cloud)?;
                chosen.combined(&near, Combine::Add)
            })
        });
        self.select_regions_by(&gesture, |_, _| Region::Spheres {
            centers: places.clone(),
            radius,
        });
        self.views.hands.gesture = Some(gesture);
    }

    /// Selects surfels that are shown, together with what was selected before the gesture as its keys say.
    fn select_by(
        &mut self,
        gesture: &Gesture,
        select: impl Fn(&Cloud, Selection) -> Result<Selection, SelectionError>,
    ) {
        for (_, place, cloud) in self.hand_clouds() {
            let before = match gesture.before.get(place) {
                Some(Some(Selected::Surfels(before))) => Some(&**before),
                _ => None,
            };
            let select = |none| select(&cloud, none);
            match self.combined_selection(place, &cloud, (before, gesture.how), select) {
                Ok(chosen) => self.views.hands.set_selection(&cloud, Some(Arc::new(chosen))),
                Err(error) => self.messages.warn(error.to_string()),
            }
        }
    }

    /// What is selected of a cloud that is shown, together with what was selected before.
    pub(super) fn combined_selection(
        &self,
        place: usize,
        cloud: &Cloud,
        (before, how): (Option<&Selection>, Combine),
        select: impl FnOnce(Selection) -> Result<Selection, SelectionError>,
    ) -> Result<Selection, SelectionError> {
        let none = Selection::none(cloud.len())?;
        let shown = self.only_shown(place, select(none.clone())?)?;
        before.unwrap_or(&none).combined(&shown, how)
    }

    /// Of a selection what filters show.
    fn only_shown(&self, place: usize, chosen: Selection) -> Result<Selection, SelectionError> {
        let shown = self.document.clouds.as_ref();
        let Some(rows) = shown.and_then(|shown| shown.displayed.rows(place)) else {
            return Ok(chosen);
        };
        let mut visible = Selection::none(chosen.len())?;
        rows.iter().for_each(|row| visible.insert(*row as usize));
        chosen.combined(&visible, Combine::Intersect)
    }

    /// Changes what is selected of each visible cloud.
    pub(crate) fn change_selections(
        &mut self,
        change: impl Fn(&Cloud, &Selection) -> Result<Selection, SelectionError>,
    ) {
        for (_, place, cloud) in self.hand_clouds() {
            let before = self.views.hands.selection_of(&cloud);
            let changed = Selection::none(cloud.len()).and_then(|none| {
                let changed = change(&cloud, before.as_deref().unwrap_or(&none))?;
                self.only_shown(place, changed)
            });
            match changed {
                Ok(changed) => self.views.hands.set_selection(&cloud, Some(Arc::new(changed))),
                Err(error) => self.messages.warn(error.to_string()),
            }
        }
    }

    /// Selects all surfels that are shown.
    pub(crate) fn select_all_surfels(&mut self) {
        self.change_selections(|_, before| before.combined(&before.inverted(), Combine::Add));
        self.change_regions(&RegionStep::Take { how: Combine::Replace, region: Region::All });
    }

    /// Selects no surfel.
    pub(crate) fn select_no_surfels(&mut self) {
        for (.., cloud) in self.hand_clouds() {
            self.views.hands.set_selection(&cloud, None);
        }
        for hand in self.hand_pyramids() {
            self.views.hands.set_selected(&hand.cloud, None);
        }
    }

    /// Selects the others.
    pub(crate) fn invert_surfels(&mut self) {
        self.change_selections(|_, before| Ok(before.inverted()));
        self.change_regions(&RegionStep::Invert);
    }

    /// Selects the neighbours of what is selected, too.
    pub(crate) fn grow_surfels(&mut self) {
        self.change_selections(|cloud, before| grown(cloud, before, usual_distance(cloud)));
        self.note_neighbours();
    }

    /// Selects only what has no neighbour that is not selected.
    pub(crate) fn shrink_surfels(&mut self) {
        self.change_selections(|cloud, before| shrunk(cloud, before, usual_distance(cloud)));
        self.note_neighbours();
    }

    /// Says what was not done of what is selected of pyramids.
    fn note_neighbours(&mut self) {
        if self.has_regions() {
            self.messages.report(
                "what is selected of pyramids stays as it is: neighbours are looked for in clouds in memory",
            );
        }
    }

    /// Selects all that hangs together with what is selected.
    pub(crate) fn select_connected(&mut self) {
        self.change_selections(|cloud, before| {
            surfelshop_cloud::selection::connected(cloud, before, usual_distance(cloud))
        });
        self.note_neighbours();
    }
}
