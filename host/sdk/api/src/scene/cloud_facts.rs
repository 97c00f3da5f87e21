//! What is known of the clouds in view.

use crate::scene::object::ObjectFrame;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Facts of the clouds in view, computed once when they are loaded.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CloudFacts {
    /// Number of surfels.
    pub n_surfels: u64,
    /// Lower corner of the bounding box of the surfel centres, world space; zero where empty.
    pub bounds_min: DVec3,
    /// Upper corner of the bounding box of the surfel centres, world space; zero where empty.
    pub bounds_max: DVec3,
    /// Names of the columns that exist, sorted.
    pub columns: Vec<String>,
    /// The radius all surfels share, scene units, where they do.
    pub equal_radius: Option<f32>,
    /// The colour all surfels share (linear albedo), where they do.
    pub equal_color: Option<[f32; 3]>,
    /// The box of each cloud, in the order in which `object_at` of the WGSL module
    /// `surfelshop::surface` counts them.
    pub objects: Vec<ObjectFrame>,
    /// Whether each of these clouds has colours of its own.
    pub colored: Vec<bool>,
}

impl CloudFacts {
    /// Whether the cloud has a column of this name.
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }
}
