//! A cloud to be drawn, and the same in a view.

use crate::columns::{Columns, Geometry};
use crate::view::Eye;
use glam::Mat4;

/// A cloud to be drawn.
pub struct Cloud<'a> {
    /// Its columns.
    pub columns: &'a Columns,
    /// The cloud that the columns were made of, by which parts of them are put in order that are not yet. None where all
    /// are, or where nothing is drawn.
    pub geometry: Option<Geometry<'a>>,
    /// Rigid motion from its positions to view space, scaled to units of drawing.
    pub view_from_cloud: Mat4,
    /// The number of its first surfel in the picture, above 0.
    pub first: u32,
    /// Number of the object that it belongs to.
    pub object: u32,
    /// The largest radius of its round splats in perspective, in shares of their distance from the eye and times the
    /// view's factor on radii; infinity where they are as large as they are. Merged ones are not bounded: they stand
    /// for what lies between others.
    pub round_reach: f32,
}

/// A cloud in a view.
pub(crate) struct CloudInView<'a> {
    pub(crate) columns: &'a Columns,
    pub(crate) eye: Eye,
    /// Number of its first place; above 0.
    pub(crate) first: u32,
    /// Number of its first surfel in the picture.
    pub(crate) first_surfel: u32,
    /// Number of the object that it belongs to.
    pub(crate) object: u32,
}
