//! The box and the plane that the window keeps.

use super::shape::{BoxShape, PlaneShape};
use std::collections::HashMap;
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
    /// What was selected before of clouds, and what was made of it, by the generation of their places.
    pub(super) made: HashMap<u64, Made>,
}

/// What the shape has made of the selection of a cloud.
pub(super) struct Made {
    pub(super) before: Option<Arc<Selection>>,
    pub(super) after: Arc<Selection>,
}

impl Handles {
    /// What was selected of a cloud before the shape did; what is selected `now`, where something else did so since.
    pub(super) fn before(&self, key: u64, now: Option<Arc<Selection>>) -> Option<Arc<Selection>> {
        match (self.made.get(&key), &now) {
            (Some(made), Some(now)) if Arc::ptr_eq(&made.after, now) => made.before.clone(),
            (Some(made), None) if made.after.is_empty() => made.before.clone(),
            _ => now,
        }
    }
}
