//! The box and the plane that the window keeps.

use super::shape::{BoxShape, PlaneShape};
use std::sync::Arc;
use surfelshop_cloud::selection::{Combine, Selection};

/// What selects by handles.
#[derive(Default)]
pub(in crate::views) struct Handles {
    /// The box that was used last.
    pub(super) of_box: Option<BoxShape>,
    /// The plane.
    pub(super) of_plane: Option<PlaneShape>,
    /// What the shape does with what was selected before.
    pub(super) how: Combine,
    /// What was selected before, by the generation of the clouds' places.
    pub(super) before: Vec<(u64, Arc<Selection>)>,
}
