//! Which points and columns are kept.

use glam::DVec3;
use surfelshop_api::columns::POSITION;

/// A box as it is cropped to: smallest and largest coordinates, both included.
pub type CropBox = [DVec3; 2];

/// What is kept of clouds on their way from file to file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// Only points in this box of common coordinates.
    pub crop: Option<CropBox>,
    /// Only every so many-th point, counted from the first; 0 and 1 keep all.
    pub every: u64,
    /// Only these columns, and positions.
    pub columns: Option<Vec<String>>,
}

impl Selection {
    /// Whether a column is kept.
    pub(super) fn keeps(&self, name: &str) -> bool {
        let named = |columns: &Vec<String>| columns.iter().any(|column| column == name);
        name == POSITION || self.columns.as_ref().is_none_or(named)
    }

    /// Whether points may be left out.
    pub(super) fn thins(&self) -> bool {
        self.crop.is_some() || self.every > 1
    }
}
