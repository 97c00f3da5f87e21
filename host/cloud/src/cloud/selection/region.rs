//! Surfels by where they are, and by their numbers.

use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::display::{Attribute, FilterTest, numbers};
use glam::{DQuat, DVec3};

/// Some of space, or some numbers; places are in world space.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// Everything.
    All,
    /// Between two corners, ends included.
    Box([DVec3; 2]),
    /// In a box that is turned about its middle, ends included.
    TurnedBox {
        /// The middle.
        middle: DVec3,
        /// From there to each pair of sides, scene units.
        half: DVec3,
        /// How the box is turned.
        turn: DQuat,
    },
    /// At most so far from a place, scene units.
    Sphere {
        /// The middle.
        center: DVec3,
        /// The radius, scene units.
        radius: f64,
    },
    /// On the side of a plane to which its normal points, and on the plane itself.
    Plane {
        /// A place on it.
        point: DVec3,
        /// Its normal, of any length above 0.
        normal: DVec3,
    },
    /// Numbers that pass a test.
    Values {
        /// The attribute.
        attribute: Attribute,
        /// The test.
        test: FilterTest,
        /// Which axis height is along.
        up: Axis,
    },
}

impl Region {
    /// The surfels of a cloud whose centres lie in the region, or whose numbers do.
    ///
    /// # Errors
    /// Where the cloud lacks the attribute, or there is no memory.
    pub fn select(&self, cloud: &Cloud) -> Result<Selection, SelectionError> {
        let (origin, positions) = (cloud.origin(), cloud.positions());
        let place = |i: usize| origin + positions[i].as_dvec3();
        let len = cloud.len();
        match self {
            Self::All => Selection::of(len, |_| true),
            Self::Box([low, high]) => Selection::of(len, |i| {
                let place = place(i);
                place.cmpge(*low).all() && place.cmple(*high).all()
            }),
            Self::TurnedBox { middle, half, turn } => {
                let back = turn.inverse();
                Selection::of(len, |i| (back * (place(i) - *middle)).abs().cmple(*half).all())
            }
            Self::Sphere { center, radius } => {
                Selection::of(len, |i| place(i).distance_squared(*center) <= radius * radius)
            }
            Self::Plane { point, normal } => {
                Selection::of(len, |i| (place(i) - *point).dot(*normal) >= 0.0)
            }
            Self::Values { attribute, test, up } => {
                let numbers = numbers(cloud, attribute, *up)?;
                Selection::of(len, |i| test.passes(numbers(i)))
            }
        }
    }
}
