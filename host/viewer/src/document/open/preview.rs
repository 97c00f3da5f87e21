//! What is shown of files while they are read.

use crate::document::settings::Settings;
use crate::document::visible_clouds::VisibleClouds;
use egui_tiles::Tree;
use surfelshop_api::Camera;
use surfelshop_session::options::UpAxis;

/// What is shown of files while they are read. It is no document: nothing of it is saved, edited or measured.
pub(crate) struct Preview {
    /// What was open before.
    pub(super) former: Option<VisibleClouds>,
    pub(super) former_camera: Camera,
    pub(super) former_walking: bool,
    pub(super) former_up: UpAxis,
    pub(super) former_settings: Settings,
    pub(super) former_tree: Tree<u32>,
    /// The camera that sees all of the preview; another one is the user's.
    pub(super) camera: Camera,
}
