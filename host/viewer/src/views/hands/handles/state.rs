//! The box and the plane that the window keeps.

use super::shape::{BoxShape, PlaneShape};
use std::collections::HashMap;
use surfelshop_cloud::selection::Combine;
use surfelshop_session::input::displayed::Selected;

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
    pub(super) before: Option<Selected>,
    pub(super) after: Selected,
}

impl Handles {
    /// What was selected of a cloud before the shape did; what is selected `now`, where something else did so since.
    pub(super) fn before(&self, key: u64, now: Option<Selected>) -> Option<Selected> {
        match (self.made.get(&key), &now) {
            (Some(made), Some(now)) if made.after.is_same(now) => made.before.clone(),
            (Some(made), None) if made.after.is_empty() => made.before.clone(),
            _ => now,
        }
    }
}
