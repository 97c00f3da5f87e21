//! Places of a cloud's surfels in the world.

use crate::cloud::transform::Transform;
use glam::{DMat3, DVec3, Vec3};

/// How the positions of a cloud are put into the world.
pub(super) struct Placement {
    /// Where the cloud's origin comes to lie.
    origin: DVec3,
    linear: DMat3,
    /// Scene units per unit of the cloud.
    pub(super) scale: f64,
}

impl Placement {
    /// Of a cloud around `origin`. Without a rotation that means anything it is not turned.
    pub(super) fn new(placed: &Transform, origin: DVec3) -> Self {
        let Transform { translation, rotation, scale } = *placed;
        let linear = DMat3::from_quat(rotation.quaternion().unwrap_or_default()) * scale;
        Self { origin: linear * origin + translation, linear, scale }
    }

    /// Where the cloud's origin lies.
    pub(super) fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The linear part, which offsets from there go through.
    pub(super) fn linear(&self) -> DMat3 {
        self.linear
    }

    /// The place of a position.
    pub(super) fn place(&self, position: Vec3) -> DVec3 {
        self.origin + self.linear * position.as_dvec3()
    }

    /// The box around all places; of none, ends that are the wrong way round.
    pub(super) fn bounds(&self, positions: &[Vec3]) -> (DVec3, DVec3) {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        positions.iter().fold(none, |(low, high), position| {
            let place = self.place(*position);
            (low.min(place), high.max(place))
        })
    }
}
