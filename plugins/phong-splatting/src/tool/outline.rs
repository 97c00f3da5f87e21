//! Splats: an ellipse in space, its field of normals, and the lines that cut it.

use super::clip::Cut;
use super::ellipse::Ellipse;
use super::normal_field::{Field, Fit};
use super::plane::{Axes, Plane};
use surfelshop_api::glam::{DVec2, DVec3};

/// An ellipse in space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outline {
    pub(crate) plane: Plane,
    pub(crate) axes: Axes,
    pub(crate) ellipse: Ellipse,
}

impl Outline {
    /// Coordinates of a point in units of the half axes.
    pub(crate) fn of(&self, point: DVec3) -> DVec2 {
        self.ellipse.of(self.axes.of(point - self.plane.at))
    }

    /// The middle.
    pub(crate) fn centre(&self) -> DVec3 {
        self.plane.at + self.axes.u * self.ellipse.centre.x + self.axes.v * self.ellipse.centre.y
    }
}

/// A splat.
#[derive(Clone, Debug)]
pub(crate) struct Splat {
    pub(crate) outline: Outline,
    /// Samples that it stands for.
    pub(crate) members: Vec<u32>,
    pub(crate) field: Field,
    /// How sure the field is.
    pub(crate) fit: Fit,
    /// Lines in the plane, from its middle.
    pub(crate) cut: Cut,
}
