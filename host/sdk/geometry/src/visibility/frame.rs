//! The box of unit size that distances are computed in.

use crate::Bounds;
use glam::{DVec3, Vec3};

/// How scene units become those of the box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) centre: DVec3,
    /// Scene units per unit of the box, above 0.
    pub(super) scale: f64,
}

impl Frame {
    /// The box of about unit size around these bounds. Its scale is a power of two, so that scaling rounds nothing.
    pub(super) fn of(bounds: Bounds) -> Self {
        let extent = bounds.extent();
        let scale = if extent > 0.0 { 2f64.powi(extent.log2().ceil() as i32) } else { 1.0 };
        Self { centre: bounds.centre(), scale }
    }

    /// A place of the scene in the box.
    pub(super) fn inside(&self, place: Vec3) -> Vec3 {
        ((place.as_dvec3() - self.centre) / self.scale).as_vec3()
    }
}
