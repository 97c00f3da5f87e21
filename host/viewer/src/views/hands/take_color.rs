//! The colour of the surfel under the pointer, for the tool in hand.

use crate::plugins::Readiness;
use crate::window::Window;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use surfelshop_api::params::{ParamKind, Value};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::display::hidden;
use surfelshop_cloud::selection::{Selection, SelectionError, extracted};

/// Surfels of the nodes of a pyramid that are looked at, at most.
const MOST_NEAR: u64 = 1 << 18;

impl Window {
    /// The parameter of a tool that takes a colour: its first one.
    pub(super) fn color_parameter(&self, tool: &str) -> Option<String> {
        let Readiness::Ready(unit) = self.plugins.tools.units.readiness(tool) else { return None };
        let mut declared = unit.description.params.iter();
        declared.find(|declared| declared.kind == ParamKind::Color).map(|found| found.id.clone())
    }

    /// Gives a tool the colour of the surfel that is nearest to a place; says why where it cannot.
    pub(super) fn take_color(&mut self, tool: &str, place: DVec3) {
        if matches!(self.plugins.tools.units.readiness(tool), Readiness::Loading) {
            return self.messages.report(format!("{tool} is being loaded; click again"));
        }
        let Some(id) = self.color_parameter(tool) else {
            return self.messages.report(format!("{tool} takes no colour"));
        };
        let found = match self.color_near(place) {
            Ok(Some(found)) => found,
            Ok(None) => return self.messages.report("no surfel is there"),
            Err(line) => return self.messages.warn(line),
        };
        let values = self.plugins.tools.values.entry(tool.to_owned()).or_default();
        values.insert(id, Value::Color(found.to_array()));
        let [r, g, b] = found.to_array();
        self.views.hands.said = format!("{tool}: took the colour {r:.3}, {g:.3}, {b:.3}");
    }

    /// Linear Rec. 709 of the nearest visible surfel, as its file has it.
    fn color_near(&self, place: DVec3) -> Result<Option<Vec3>, String> {
        let mut clouds: Vec<Arc<Cloud>> =
            self.hand_clouds().into_iter().map(|(.., cloud)| Arc::new(cloud)).collect();
        for hand in self.hand_pyramids() {
            let is_near = |middle: DVec3, radius: f64| middle.distance(place) <= radius;
            clouds.extend(hand.nodes_within(is_near, MOST_NEAR)?);
        }
        let mut found = Vec::new();
        for cloud in &clouds {
            let hidden = hidden(cloud).map_err(|error| error.to_string())?;
            found.extend(nearest(cloud, place, hidden.as_ref()).map(|nearest| (nearest, cloud)));
        }
        let nearest = found.into_iter();
        let Some(((_, row), cloud)) = nearest.min_by(|a, b| a.0.0.total_cmp(&b.0.0)) else {
            return Ok(None);
        };
        color_of(cloud, row).map_err(|error| error.to_string())
    }
}

fn color_of(cloud: &Cloud, row: usize) -> Result<Option<Vec3>, SelectionError> {
    let mut one = Selection::none(cloud.len())?;
    one.insert(row);
    Ok(extracted(cloud, &one)?.view().albedos().first().copied())
}

/// How far away the nearest surfel of a cloud that is not hidden is, squared, and its number.
fn nearest(cloud: &Cloud, place: DVec3, hidden: Option<&Selection>) -> Option<(f64, usize)> {
    let place = place - cloud.origin();
    let is_shown = |(i, _): &(usize, _)| hidden.is_none_or(|hidden| !hidden.contains(*i));
    let all = cloud.positions().par_iter().enumerate().filter(is_shown);
    let all = all.map(|(i, at)| (at.as_dvec3().distance_squared(place), i));
    all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}
