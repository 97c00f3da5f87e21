//! What all ways to bring columns into drawing order share: their progress, and the number of surfels.

use crate::graph::RenderError;
use surfelshop_api::CloudView;

/// What share of the time putting surfels in order takes.
pub(crate) const ORDERED: f32 = 0.3;

/// Why columns were not made that nobody wants any more.
pub(crate) const STOPPED: &str = "its columns are not wanted any more";

/// Number of surfels, where all can be numbered.
pub(crate) fn counted(cloud: &CloudView<'_>) -> Result<u32, RenderError> {
    numbered(cloud.len)
}

pub(crate) fn numbered(n: usize) -> Result<u32, RenderError> {
    // The index texture keeps one bit for the side and one value for "none".
    u32::try_from(n)
        .ok()
        .filter(|n| *n < 1 << 31)
        .ok_or_else(|| RenderError::Cloud(format!("it has {n} surfels, fewer than 2^31 are drawn")))
}
