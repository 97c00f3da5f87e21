//! Strokes over pyramids: a tool runs over the node that is near, and what it does becomes an edit of the layer.

use crate::document::generations;
use crate::window::Window;
use glam::DVec3;
use std::sync::Arc;
use surfelshop_api::Stroke;
use surfelshop_cloud::selection::{Combine, LayerChange, Region, RegionSelection, RegionStep};
use surfelshop_cloud::{Cloud, CloudPart, EditedCloud};
use surfelshop_session::input::strokes;

/// Surfels of the nodes that are looked at, at most, and radii of the stroke around where it begins.
const MOST_NEAR: u64 = 1 << 18;
const NEAR: f64 = 2.0;

impl Window {
    /// The visible pyramid that a stroke begins over: its index, the node there of which it concerns most surfels, and what
    /// the stroke is of.
    pub(super) fn pyramid_near(
        &self,
        stroke: &Stroke,
    ) -> Result<Option<(usize, Cloud, Option<RegionSelection>)>, String> {
        let Some(first) = stroke.samples.first() else { return Ok(None) };
        let reach = NEAR * stroke.radius;
        for hand in self.hand_pyramids() {
            let is_near =
                |middle: DVec3, radius: f64| middle.distance(first.place) <= radius + reach;
            let nodes = hand.nodes_within(is_near, MOST_NEAR)?;
            let regions = self.views.hands.regions_of(&hand.cloud);
            let all = RegionStep::Take { how: Combine::Replace, region: Region::All };
            let regions =
                regions.map_or_else(|| hand.nothing().with(all), |regions| (*regions).clone());
            let regions = self.shown_of(&hand, &regions);
            let concerned = |node: &Arc<Cloud>| {
                let chosen = regions.select_in_world(node).ok()?;
                CloudPart::along(node, stroke, Some(&chosen)).ok().map(|part| part.rows.len())
            };
            let most = nodes.iter().map(|node| (concerned(node), node)).max_by_key(|(n, _)| *n);
            if let Some((_, node)) = most.filter(|(n, _)| n.is_some_and(|n| n > 0)) {
                return Ok(Some((hand.index, (**node).clone(), Some(regions))));
            }
        }
        Ok(None)
    }

    /// Shows a pyramid with the stroke so far as an edit of its layer.
    ///
    /// # Errors
    /// A line, where the edit cannot be.
    pub(super) fn show_stroke_of_pyramid(&mut self, edited: &EditedCloud) -> Result<(), String> {
        let Some(run) = &self.views.hands.stroke else { return Ok(()) };
        let (Some(regions), Some((values, stroke))) = (&run.regions, &run.given) else {
            return Ok(());
        };
        let before = run.before.all().get(run.index).and_then(|open_cloud| open_cloud.pyramid());
        let Some(before) = before else { return Ok(()) };
        let tool = format!("{}/{}", run.reference.package, run.reference.id);
        let led = strokes::named(&tool, values, stroke.clone());
        // Merged surfels may lie beside the stroke, and only finer ones tell.
        led.allows(&run.base, edited).map_err(|error| error.to_string())?;
        let layer = before.layer().with(regions.clone(), LayerChange::Stroke(led));
        let (index, clouds) = (run.index, run.before.layered(run.index, layer));
        let clouds = clouds.map_err(|error| format!("{error:#}"))?;
        let hand = self.hand_pyramids().into_iter().find(|hand| hand.index == index);
        let selected = hand.and_then(|hand| {
            let regions = self.views.hands.regions_of(&hand.cloud)?;
            Some((hand, regions))
        });
        let stood_before = run.before.all().get(index).map(|open| generations(&open.loaded.cloud));
        self.show_clouds(clouds);
        // What is selected stays so.
        let now = self.hand_pyramids().into_iter().find(|hand| hand.index == index);
        if let Some((now, (hand, regions))) = now.zip(selected) {
            // What stood for it a step ago is shown no more, unless undo brings it back.
            if stood_before != Some(generations(&hand.cloud)) {
                self.views.hands.set_selected(&hand.cloud, None);
            }
            self.set_regions(&now, regions);
        }
        Ok(())
    }
}
