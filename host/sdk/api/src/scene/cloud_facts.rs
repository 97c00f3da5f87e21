//! What is known of the clouds in view.

use crate::columns::{Element, Role};
use crate::need::{Need, NeedInfo};
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
    /// What is known of each of these clouds. ABI 3.9.
    pub clouds: Vec<CloudInfo>,
}

/// What is known of one of the clouds in view. ABI 3.9.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CloudInfo {
    /// What it is called; may be empty, and is in hosts of 3.9.
    pub name: String,
    /// Number of surfels.
    pub n_surfels: u64,
    /// Its columns.
    pub columns: Vec<ColumnInfo>,
}

/// A column of a cloud, without its values. ABI 3.9.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ColumnInfo {
    /// The name.
    pub name: String,
    /// Elements of a surfel.
    pub components: u32,
    /// Type of an element.
    pub element: Element,
    /// What its values are.
    #[serde(default)]
    pub role: Role,
}

impl CloudInfo {
    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnInfo> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// What is required and this cloud lacks. ABI 3.9.
    pub fn lacks<'n>(&self, needs: &'n [Need]) -> impl Iterator<Item = &'n Need> {
        let is_there = |need: &Need| {
            self.column(&need.column).is_some_and(|column| column.components >= need.components)
        };
        needs.iter().filter(move |need| need.required && !is_there(need))
    }
}

impl CloudFacts {
    /// Whether the cloud has a column of this name.
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }

    /// Numbers of the clouds that have all that is required. ABI 3.9.
    #[must_use]
    pub fn fulfilling(&self, needs: &[NeedInfo]) -> Vec<u32> {
        let needs: Vec<Need> = needs.iter().map(Need::from).collect();
        let fulfils = |cloud: &CloudInfo| cloud.lacks(&needs).next().is_none();
        (0..).zip(&self.clouds).filter(|(_, cloud)| fulfils(cloud)).map(|(i, _)| i).collect()
    }

    /// Whether there are surfels of clouds besides these: where not, the host's surface hides nothing. Clouds that other
    /// renderers of a scene draw have no surfels here.
    #[must_use]
    pub fn has_others(&self, objects: &[u32]) -> bool {
        let mut all = (0..).zip(&self.clouds);
        all.any(|(i, cloud)| cloud.n_surfels > 0 && !objects.contains(&i))
    }
}
