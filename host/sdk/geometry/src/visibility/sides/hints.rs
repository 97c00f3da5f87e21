//! What the caller knows of a scan.

use glam::Vec3;

/// What is known about a scan beside its points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// The direction that is up, any length: land, streets and roofless rooms face it. Without it
    /// their side is a guess.
    pub up: Option<Vec3>,
    /// Metres per scene unit: a closed surface with a floor that is as large as a room is one.
    pub metres: Option<f32>,
    /// A place that a device stood at, scene units. One that did not harms: what it would have seen
    /// counts more than all but [`Self::interior`].
    pub device: Option<Vec3>,
    /// Whether the scan is of an interior, such as a room, or of a body from outside.
    pub interior: Option<bool>,
}
