//! Radii that are all the same: a constant does, and the device is given no column.

use crate::surfels::columns::elements::{drawn_generation, floats_of, round_of};
use std::collections::HashMap;
use surfelshop_api::columns::{self, CloudView};
use surfelshop_raster::radius_drawn;

/// What a column of radii holds.
struct Known {
    /// The one that all are equal to, where they are.
    equal: Option<f32>,
    last_used: u64,
}

/// What is known of columns of radii.
#[derive(Default)]
pub(crate) struct Radii {
    /// By generation.
    known: HashMap<u64, Known>,
    /// Whether equal radii are columns all the same.
    pub(crate) are_columns: bool,
}

impl Radii {
    /// The radius that all surfels are drawn with, where they have one: negative of round splats.
    pub(crate) fn equal(&mut self, cloud: &CloudView<'_>, frame: u64) -> Option<f32> {
        let column = cloud.column(columns::RADIUS).filter(|_| !self.are_columns)?;
        let values = floats_of(cloud, columns::RADIUS).ok()?;
        let round = round_of(cloud);
        let known = self.known.entry(drawn_generation(cloud, column)).or_insert_with(|| {
            let first = values.first().copied();
            let equal = first.filter(|first| values.iter().all(|v| v.to_bits() == first.to_bits()));
            // Not 0 of all, or of none.
            let first_round = round.is_some_and(|round| round.first().is_some_and(|&is| is != 0));
            let alike = |round: &[u8]| round.iter().all(|&is| (is != 0) == first_round);
            let equal = equal.filter(|_| round.is_none_or(alike));
            let equal = equal.map(|radius| radius_drawn(radius, first_round));
            Known { equal, last_used: frame }
        });
        known.last_used = frame;
        known.equal
    }

    /// Whether the radii of a column are known to be one.
    pub(crate) fn in_a_constant(&self, generation: u64) -> bool {
        let is_equal = || self.known.get(&generation).is_some_and(|known| known.equal.is_some());
        !self.are_columns && is_equal()
    }

    /// Forgets what was not used since a frame.
    pub(crate) fn forget(&mut self, before: u64) {
        self.known.retain(|_, known| known.last_used >= before);
    }

    /// Takes what others know.
    pub(crate) fn absorb(&mut self, other: Self, frame: u64) {
        let other = other.known.into_iter();
        self.known.extend(other.map(|(of, known)| (of, Known { last_used: frame, ..known })));
    }
}
