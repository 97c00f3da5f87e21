//! The numbers of a measure that follow from its places alone.

use super::plane::{Plane, twice_area};
use super::{Measure, MeasureError, MeasureKind, Profile, Volume, profile, volume};
use crate::cloud::Cloud;
use glam::DVec3;

/// What a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuantityKind {
    /// A length, scene units.
    Length,
    /// An area, square scene units.
    Area,
    /// A volume, cubic scene units.
    Volume,
    /// An angle, degrees.
    Degrees,
    /// A share, from 0 to 1.
    Share,
    /// How many there are.
    Count,
}

/// A number of a measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// What it is called.
    pub name: &'static str,
    /// The number.
    pub value: f64,
    /// What the number is.
    pub kind: QuantityKind,
}

impl Quantity {
    pub(super) fn length(name: &'static str, value: f64) -> Self {
        Self { name, value, kind: QuantityKind::Length }
    }

    pub(super) fn new(name: &'static str, value: f64, kind: QuantityKind) -> Self {
        Self { name, value, kind }
    }
}

/// The length of a line through places.
fn length_of(places: &[DVec3]) -> f64 {
    places.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

impl Measure {
    /// Whether its numbers may be of something within a ball in the world, scene units; not for other kinds than profiles
    /// and volumes. Yes where the ball is not finite.
    #[must_use]
    pub fn may_be_of(&self, up: DVec3, middle: DVec3, radius: f64) -> bool {
        let may_hold = match self.kind {
            MeasureKind::Profile => profile::may_hold(self, up, middle, radius),
            MeasureKind::Volume => volume::may_hold(self, up, middle, radius),
            _ => return false,
        };
        may_hold || !(middle.is_finite() && radius.is_finite())
    }

    /// The numbers that are of surfels: of a profile and of a volume, what that is first. Empty for other kinds.
    ///
    /// # Errors
    /// Where it has not the places that it needs, no surfel lies there, or there is no memory.
    pub fn surfel_quantities(
        &self,
        up: DVec3,
        clouds: &[&Cloud],
    ) -> Result<Vec<Quantity>, MeasureError> {
        match self.kind {
            MeasureKind::Profile => Ok(Profile::of(self, up, clouds)?.quantities()),
            MeasureKind::Volume => Ok(Volume::of(self, up, clouds)?.quantities()),
            _ => Ok(Vec::new()),
        }
    }

    /// The numbers that follow from the places alone, the one that a label shows first; `up` is a unit vector. Empty for
    /// notes and volumes, and where places are missing.
    #[must_use]
    pub fn quantities(&self, up: DVec3) -> Vec<Quantity> {
        if self.check().is_err() {
            return Vec::new();
        }
        let places = &self.places;
        let between = |a: usize, b: usize| places[b] - places[a];
        // How long a way is across, and how much it rises.
        let parts = |way: DVec3| {
            let rise = way.dot(up);
            [Quantity::length("across", (way - rise * up).length()), Quantity::length("rise", rise)]
        };
        match self.kind {
            MeasureKind::Note | MeasureKind::Volume => Vec::new(),
            MeasureKind::Distance => {
                let ends = between(0, places.len() - 1);
                let mut all = vec![Quantity::length("distance", length_of(places))];
                all.extend(parts(ends));
                if places.len() > 2 {
                    all.push(Quantity::length("from end to end", ends.length()));
                }
                all
            }
            MeasureKind::Angle => {
                let (a, b) = (between(1, 0), between(1, 2));
                // Of small angles as exact as of large ones, which a cosine is not.
                let angle = a.cross(b).length().atan2(a.dot(b));
                vec![
                    Quantity::new("angle", angle.to_degrees(), QuantityKind::Degrees),
                    Quantity::length("first side", a.length()),
                    Quantity::length("second side", b.length()),
                ]
            }
            MeasureKind::Height => {
                let [across, rise] = parts(between(0, 1));
                let height = Quantity { name: "height", ..rise };
                vec![height, across, Quantity::length("distance", between(0, 1).length())]
            }
            MeasureKind::Area => {
                let around = length_of(places) + between(places.len() - 1, 0).length();
                let plane = Plane::through(places, up);
                let off = |plane: Plane| {
                    places.iter().map(|place| plane.local(*place).1.abs()).fold(0.0, f64::max)
                };
                vec![
                    Quantity::new("area", 0.5 * twice_area(places).length(), QuantityKind::Area),
                    Quantity::length("around", around),
                    Quantity::length("off plane", plane.map_or(0.0, off)),
                ]
            }
            MeasureKind::Profile => {
                let [across, rise] = parts(between(0, 1));
                vec![Quantity { name: "length", ..across }, rise]
            }
        }
    }
}
