//! A profile: the surfels near a vertical plane, seen from its side.

use super::{Measure, MeasureError, MeasureKind, Quantity, QuantityKind};
use crate::cloud::Cloud;
use crate::memory::ask;
use glam::DVec3;
use rayon::prelude::*;

/// The surfels within a slab.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// How far each surfel is along the line, and how high along the upward axis, scene units in world space; in the order
    /// along the line.
    pub points: Vec<[f64; 2]>,
    /// The length of the line across, scene units.
    pub length: f64,
    /// How thick the slab is, scene units.
    pub thickness: f64,
}

/// A slab: where a place is in it.
struct Slab {
    start: DVec3,
    along: DVec3,
    aside: DVec3,
    up: DVec3,
    length: f64,
    half: f64,
}

impl Slab {
    fn of(measure: &Measure, up: DVec3) -> Result<Self, MeasureError> {
        let way = measure.places[1] - measure.places[0];
        let across = way - way.dot(up) * up;
        let length = across.length();
        // What rounding leaves of a vertical way is no direction.
        if length <= 1e-9 * way.length() {
            return Err(MeasureError::Vertical);
        }
        let along = across.try_normalize().ok_or(MeasureError::Vertical)?;
        let thickness = measure.thickness.unwrap_or(Profile::USUAL_THICKNESS * length);
        let aside = up.cross(along);
        Ok(Self { start: measure.places[0], along, aside, up, length, half: 0.5 * thickness })
    }

    /// Where a place is along the line and along the upward axis, from the line's beginning; `None` outside of the slab.
    fn at(&self, from_start: DVec3) -> Option<[f64; 2]> {
        let along = from_start.dot(self.along);
        let is_in =
            (0.0..=self.length).contains(&along) && from_start.dot(self.aside).abs() <= self.half;
        is_in.then(|| [along, from_start.dot(self.up)])
    }
}

/// Whether something of a ball may lie in the slab of a measure; not where it has none.
pub(super) fn may_hold(measure: &Measure, up: DVec3, middle: DVec3, radius: f64) -> bool {
    let Ok(slab) = measure.check().and_then(|()| Slab::of(measure, up)) else { return false };
    let from_start = middle - slab.start;
    (-radius..=slab.length + radius).contains(&from_start.dot(slab.along))
        && from_start.dot(slab.aside).abs() <= slab.half + radius
}

impl Profile {
    /// The thickness of a slab that says none, share of its length.
    pub const USUAL_THICKNESS: f64 = 0.01;

    /// The profile of clouds along a measure's line; `up` is a unit vector.
    ///
    /// # Errors
    /// Where the measure is of other than two places, these lie above each other, no surfel is in the slab, or there is no
    /// memory.
    pub fn of(measure: &Measure, up: DVec3, clouds: &[&Cloud]) -> Result<Self, MeasureError> {
        let measure = Measure { kind: MeasureKind::Profile, ..measure.clone() };
        measure.check()?;
        let slab = Slab::of(&measure, up)?;
        let mut points: Vec<[f64; 2]> = Vec::new();
        for cloud in clouds {
            let from_start = cloud.origin() - slab.start;
            let positions = cloud.positions();
            let found = |position: &glam::Vec3| slab.at(from_start + position.as_dvec3());
            let n = positions.par_iter().filter(|position| found(position).is_some()).count();
            ask(2 * ((points.len() + n) * size_of::<[f64; 2]>()) as u64)?;
            let more: Vec<[f64; 2]> = positions.par_iter().filter_map(found).collect();
            points.extend(more);
        }
        if points.is_empty() {
            return Err(MeasureError::Nothing { kind: MeasureKind::Profile });
        }
        let base = slab.start.dot(up);
        points.par_iter_mut().for_each(|point| point[1] += base);
        points.par_sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        Ok(Self { points, length: slab.length, thickness: 2.0 * slab.half })
    }

    /// The lowest and the highest surfel, along the upward axis, scene units in world space.
    #[must_use]
    pub fn heights(&self) -> [f64; 2] {
        let heights = self.points.iter().map(|point| point[1]);
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], height| {
            [low.min(height), high.max(height)]
        })
    }

    /// Its numbers.
    #[must_use]
    pub fn quantities(&self) -> Vec<Quantity> {
        let [low, high] = self.heights();
        vec![
            Quantity::length("lowest", low),
            Quantity::length("highest", high),
            Quantity::length("relief", high - low),
            Quantity::length("thickness", self.thickness),
            Quantity::new("surfels", self.points.len() as f64, QuantityKind::Count),
        ]
    }

    /// At most `most` of the surfels, evenly along their order; all where they are no more.
    #[must_use]
    pub fn some(&self, most: usize) -> Vec<[f64; 2]> {
        let step = self.points.len().div_ceil(most.max(1)).max(1);
        self.points.iter().step_by(step).copied().collect()
    }

    /// The surfels as lines of `along,height`, in scene units, below a line that says so.
    #[must_use]
    pub fn csv(&self) -> String {
        let rows = self.points.iter().map(|[along, height]| format!("{along:?},{height:?}\n"));
        std::iter::once("along,height\n".to_owned()).chain(rows).collect()
    }
}
