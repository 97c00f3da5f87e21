//! The open clouds with what the views need of the visible ones.

use super::display::job::DisplayInputs;
use super::one_cloud::{OneCloud, Part};
use super::open_clouds::OpenClouds;
use std::sync::Arc;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::displayed::DisplayedClouds;
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::options::camera::Extent;

/// The open clouds, and the visible ones among them.
pub(crate) struct VisibleClouds {
    pub(crate) open_clouds: OpenClouds,
    /// The visible ones as they are displayed: coloured and filtered.
    pub(crate) clouds: Arc<Clouds>,
    /// How they came to be.
    pub(crate) displayed: DisplayedClouds,
    /// What they were made of; `None` where they are still to be coloured and filtered.
    pub(crate) displayed_of: Option<DisplayInputs>,
    /// Whether the camera has to see all of what is displayed first.
    pub(crate) frames: bool,
    pub(crate) extent: Extent,
    /// The factor on radii that the extent was computed with.
    pub(crate) radius_scale: f32,
    /// Counts the loads, the edits, and the changes of colours and filters.
    pub(crate) revision: u64,
}

impl VisibleClouds {
    /// Clouds that are still to be coloured and filtered.
    pub(crate) fn new(open_clouds: OpenClouds, radius_scale: f32, revision: u64) -> Self {
        let clouds = open_clouds.clouds.clone();
        let extent = clouds.extent(radius_scale);
        let (displayed, displayed_of) = (DisplayedClouds::plain(&clouds), None);
        let frames = false;
        Self {
            open_clouds,
            clouds,
            displayed,
            displayed_of,
            frames,
            extent,
            radius_scale,
            revision,
        }
    }

    /// What the clouds that are displayed name to draw them.
    pub(crate) fn named(&self) -> Vec<Option<NamedRenderer>> {
        let of = self.displayed_of.as_ref();
        of.map_or(&self.open_clouds, |of| &of.open_clouds).named()
    }

    /// What is displayed of a visible cloud of this name; of all of them where there is none.
    pub(crate) fn part(&self, name: Option<&String>) -> Part {
        let of = self.displayed_of.as_ref();
        let open_clouds = of.map_or(&self.open_clouds, |of| &of.open_clouds);
        OneCloud::default().part((&self.clouds, self.revision), open_clouds, name)
    }
}
