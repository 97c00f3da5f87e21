//! The box of unit size that distances are computed in.

use glam::{DVec3, Vec3};

/// How scene units become those of the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) centre: DVec3,
    /// Scene units per unit of the box, above 0.
    pub(super) scale: f64,
}

impl Frame {
    /// A place of the scene in the box.
    pub(super) fn inside(&self, place: Vec3) -> Vec3 {
        ((place.as_dvec3() - self.centre) / self.scale).as_vec3()
    }
}
