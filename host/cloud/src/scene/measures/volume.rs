//! The volume between surfels and a plane.

use super::grid::{Above, Grid};
use super::plane::{Plane, is_inside, twice_area};
use super::{Measure, MeasureError, MeasureKind, Quantity, QuantityKind};
use crate::cloud::Cloud;
use crate::memory::ask;
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

/// What lies between surfels and the plane through places, within these: mean heights in cells of a grid, each of some four
/// surfels, by how much of a surfel is seen along the plane's normal. Surfels that face away from the side that most face,
/// such as the underside of a body, do not count. Cells without any get the heights of their neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Above the plane, cubic scene units.
    pub above: f64,
    /// Below it.
    pub below: f64,
    /// The area within the places, square scene units.
    pub area: f64,
    /// The share of it in whose cells there are surfels.
    pub covered: f64,
    /// The side of a cell, scene units.
    pub cell: f64,
    /// Surfels within the places that count.
    pub n_surfels: usize,
}

/// Whether something of a ball may lie over or under the places of a measure; not where these enclose nothing.
pub(super) fn may_hold(measure: &Measure, up: DVec3, middle: DVec3, radius: f64) -> bool {
    let Some(plane) = Plane::through(&measure.places, up) else { return false };
    let polygon = measure.places.iter().map(|place| plane.local(*place).0);
    let ends = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) = polygon.fold(ends, |(low, high), at| (low.min(at), high.max(at)));
    let (at, _) = plane.local(middle);
    at.cmpge(low - radius).all() && at.cmple(high + radius).all()
}

/// Bytes for each surfel within the places: twice what is known of it, and a cell's numbers.
const BYTES: usize = 112;

/// Surfels that are steeper than this say nothing of heights, as a cosine.
const STEEPEST: f64 = 0.05;

impl Volume {
    /// The volume over a measure's places; `up` is a unit vector, and the plane is turned to it.
    ///
    /// # Errors
    /// Where there are fewer than three places, they enclose nothing, no surfel is within them, or there is no memory.
    pub fn of(measure: &Measure, up: DVec3, clouds: &[&Cloud]) -> Result<Self, MeasureError> {
        let measure = Measure { kind: MeasureKind::Volume, ..measure.clone() };
        measure.check()?;
        let plane = Plane::through(&measure.places, up).ok_or(MeasureError::Flat)?;
        let polygon: Vec<DVec2> = measure.places.iter().map(|p| plane.local(*p).0).collect();
        let area = 0.5 * twice_area(&measure.places).length();
        let low = polygon.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = polygon.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let mut points: Vec<Above> = Vec::new();
        for cloud in clouds {
            let origin = cloud.origin();
            let normals = cloud.normals();
            let found = |(i, position): (usize, &Vec3)| {
                let (at, height) = plane.local(origin + position.as_dvec3());
                let is_near = at.cmpge(low).all() && at.cmple(high).all();
                // Without a normal it lies in the plane.
                let facing = normals.get(i).map(|normal| normal.as_dvec3().dot(plane.normal));
                let weight = facing.unwrap_or(1.0);
                (is_near && is_inside(&polygon, at)).then_some(Above { at, height, weight })
            };
            let positions = cloud.positions();
            let n = positions.par_iter().enumerate().filter(|one| found(*one).is_some()).count();
            ask(((points.len() + n) * BYTES) as u64)?;
            let more: Vec<Above> = positions.par_iter().enumerate().filter_map(found).collect();
            points.extend(more);
        }
        if points.is_empty() {
            return Err(MeasureError::Nothing { kind: MeasureKind::Volume });
        }
        // Normals of a scan may all point inwards.
        let turned = match points.iter().map(|point| point.weight.signum()).sum::<f64>() {
            sum if sum < 0.0 => -1.0,
            _ => 1.0,
        };
        points.iter_mut().for_each(|point| point.weight *= turned);
        points.retain(|point| point.weight > STEEPEST);
        if points.is_empty() {
            return Err(MeasureError::Nothing { kind: MeasureKind::Volume });
        }
        let mut grid = Grid::new(&polygon, area, &points);
        let covered = grid.covered();
        grid.fill_holes();
        let [above, below] = grid.volumes();
        Ok(Self { above, below, area, covered, cell: grid.side, n_surfels: points.len() })
    }

    /// Its numbers, what lies above less what lies below first.
    #[must_use]
    pub fn quantities(&self) -> Vec<Quantity> {
        let volume = |name, value| Quantity::new(name, value, QuantityKind::Volume);
        vec![
            volume("volume", self.above - self.below),
            volume("above", self.above),
            volume("below", self.below),
            Quantity::new("area", self.area, QuantityKind::Area),
            Quantity::new("covered", self.covered, QuantityKind::Share),
            Quantity::length("cell", self.cell),
            Quantity::new("surfels", self.n_surfels as f64, QuantityKind::Count),
        ]
    }
}
