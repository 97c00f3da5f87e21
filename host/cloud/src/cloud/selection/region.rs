//! Surfels by where they are, and by their numbers.

use super::placement::Placement;
use super::{ScreenRegion, Selection, SelectionError};
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::transform::Transform;
use crate::display::{Attribute, FilterTest, numbers};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Some of space, or some numbers; places are in world space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
    /// At most so far from one of several places, scene units: what a brush goes over.
    Spheres {
        /// The middles.
        centers: Vec<DVec3>,
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
    /// What is seen in a part of a picture.
    Seen(Box<ScreenRegion>),
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
        self.select_placed(cloud, &Transform::default())
    }

    /// The same of a cloud that `placed` puts into the world.
    ///
    /// # Errors
    /// As [`select`](Self::select), and where the cloud cannot be placed like this.
    pub fn select_placed(
        &self,
        cloud: &Cloud,
        placed: &Transform,
    ) -> Result<Selection, SelectionError> {
        let positions = cloud.positions();
        let placement = Placement::new(placed, cloud.origin());
        let place = |i: usize| placement.place(positions[i]);
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
            Self::Spheres { centers, radius } => {
                let (low, high) = placement.bounds(positions);
                // Of a long stroke a part of a cloud is near few places.
                let near = |center: &&DVec3| {
                    center.distance_squared(center.clamp(low, high)) <= radius * radius
                };
                let is_some = low.cmple(high).all();
                let near: Vec<DVec3> =
                    centers.iter().filter(|_| is_some).filter(near).copied().collect();
                Selection::of(len, |i| {
                    let place = place(i);
                    near.iter().any(|center| place.distance_squared(*center) <= radius * radius)
                })
            }
            Self::Plane { point, normal } => {
                Selection::of(len, |i| (place(i) - *point).dot(*normal) >= 0.0)
            }
            Self::Seen(region) => region.select_placed(cloud, placed),
            Self::Values { attribute, test, up } => {
                let cloud = cloud.transformed(placed)?;
                let numbers = numbers(&cloud, attribute, *up)?;
                Selection::of(len, |i| test.passes(numbers(i)))
            }
        }
    }

    /// How much of a ball in the world the region may have, as far as that is told quickly: some, where the ball is not
    /// finite.
    #[must_use]
    pub fn reach(&self, middle: DVec3, radius: f64) -> Reach {
        if !(middle.is_finite() && radius.is_finite()) {
            return Reach::Some;
        }
        if !self.may_reach(middle, radius) {
            return Reach::Nothing;
        }
        if self.has_all(middle, radius * (1.0 + 1e-9)) { Reach::All } else { Reach::Some }
    }

    fn may_reach(&self, middle: DVec3, radius: f64) -> bool {
        // What rounding does is far less.
        let reach = radius * (1.0 + 1e-9);
        let is_near = |place: DVec3, own: f64| {
            let distance = reach + own;
            place.distance_squared(middle) <= distance * distance * (1.0 + 1e-9)
        };
        match self {
            Self::Values { attribute: Attribute::Height, test: FilterTest::Range(ends), up } => {
                let height = middle.dot(up.direction());
                height + reach >= ends[0] && height - reach <= ends[1]
            }
            Self::All | Self::Values { .. } => true,
            Self::Box([low, high]) => is_near(middle.max(*low).min(*high), 0.0),
            Self::TurnedBox { middle: own, half, turn } => {
                let within = turn.inverse() * (middle - *own);
                is_near(*own + *turn * within.max(-*half).min(*half), 0.0)
            }
            Self::Sphere { center, radius } => is_near(*center, *radius),
            Self::Spheres { centers, radius } => {
                centers.iter().any(|center| is_near(*center, *radius))
            }
            Self::Plane { point, normal } => {
                (middle - *point).dot(*normal) >= -reach * normal.length() * (1.0 + 1e-9)
            }
            Self::Seen(region) => region.may_reach(middle, reach),
        }
    }

    /// Whether the region surely has all of a ball.
    fn has_all(&self, middle: DVec3, radius: f64) -> bool {
        let is_within = |center: DVec3, own: f64| center.distance(middle) + radius <= own;
        match self {
            Self::All => true,
            Self::Box([low, high]) => {
                (middle - radius).cmpge(*low).all() && (middle + radius).cmple(*high).all()
            }
            Self::TurnedBox { middle: own, half, turn } => {
                ((turn.inverse() * (middle - *own)).abs() + radius).cmple(*half).all()
            }
            Self::Sphere { center, radius } => is_within(*center, *radius),
            Self::Spheres { centers, radius } => {
                centers.iter().any(|center| is_within(*center, *radius))
            }
            Self::Plane { point, normal } => {
                (middle - *point).dot(*normal) >= radius * normal.length()
            }
            Self::Values { attribute: Attribute::Height, test: FilterTest::Range(ends), up } => {
                let height = middle.dot(up.direction());
                height - radius >= ends[0] && height + radius <= ends[1]
            }
            Self::Seen(_) | Self::Values { .. } => false,
        }
    }
}

/// How much of a ball is in a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Nothing.
    Nothing,
    /// Something, or nothing, or all.
    Some,
    /// All.
    All,
}
