//! The open clouds with what the views need of the visible ones.

use super::open_clouds::OpenClouds;
use std::sync::Arc;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::options::camera::Extent;

/// The open clouds, and the visible ones among them.
pub(crate) struct VisibleClouds {
    pub(crate) open_clouds: OpenClouds,
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) extent: Extent,
    /// The factor on radii that the extent was computed with.
    pub(crate) radius_scale: f32,
    /// Counts the loads and edits.
    pub(crate) revision: u64,
}

impl VisibleClouds {
    pub(crate) fn new(open_clouds: OpenClouds, radius_scale: f32, revision: u64) -> Self {
        let clouds = open_clouds.clouds.clone();
        let extent = clouds.extent(radius_scale);
        Self { open_clouds, clouds, extent, radius_scale, revision }
    }
}
