//! The state of the views: panes, cameras, and what is under the pointer.

use super::arrangement;
use super::hands::Hands;
use super::measuring::Measuring;
use super::pane::Pane;
use crate::document::OneCloud;
use crate::orientation::Flight;
use egui_tiles::Tree;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use surfelshop_api::Camera;
use surfelshop_session::options::LensArguments;
use surfelshop_session::options::UpAxis;
use surfelshop_session::options::camera;
use surfelshop_session::options::camera::CameraSpec;
use surfelshop_session::options::camera::Extent;

/// Everything about the views that is not in the settings.
pub(crate) struct Views {
    /// The camera of linked panes.
    pub(crate) camera: Camera,
    /// The cameras of panes that are not linked.
    pub(crate) own_cameras: HashMap<u32, Camera>,
    pub(crate) panes: BTreeMap<u32, Pane>,
    pub(crate) tree: Tree<u32>,
    pub(crate) focused: u32,
    /// Whether pictures in motion are drawn at a coarser level of detail.
    pub(crate) adaptive: bool,
    /// What a drag does besides moving the camera, and what is selected.
    pub(crate) hands: Hands,
    /// What is being measured, and what is known of measures.
    pub(crate) measuring: Measuring,
    /// The camera of a pane on its way.
    pub(crate) flight: Option<Flight>,
    /// Clouds of views that show one alone: those they are of, and which.
    pub(super) alone: OneCloud,
    /// Whether the camera walks: a drag looks around then.
    pub(crate) walking: bool,
    /// The pane and depth that the wheel zooms to while pictures have no depth.
    pub(crate) anchor_depth: Option<(u32, f64)>,
    /// The surface point under the pointer.
    pub(crate) pointer_position: Option<DVec3>,
    /// What lies at [`Views::pointer_position`], in one line.
    pub(crate) pointer_text: String,
}

impl Views {
    pub(crate) fn new(up: UpAxis) -> Self {
        Self {
            camera: initial_camera(&Extent::new(DVec3::ZERO, 1.0), up),
            own_cameras: HashMap::new(),
            panes: BTreeMap::from([(0, Pane::new())]),
            tree: arrangement::default_tree(&[0]),
            focused: 0,
            adaptive: true,
            hands: Hands::default(),
            measuring: Measuring::default(),
            flight: None,
            alone: OneCloud::default(),
            walking: false,
            anchor_depth: None,
            pointer_position: None,
            pointer_text: String::new(),
        }
    }
}

/// The camera that shows all of a cloud, from the front, the side and above.
pub(crate) fn initial_camera(extent: &Extent, up: UpAxis) -> Camera {
    camera_in(extent, up, CameraSpec::three_quarter())
}

/// The camera of a preset, or of a place.
pub(crate) fn camera_in(extent: &Extent, up: UpAxis, camera: CameraSpec) -> Camera {
    let lens = LensArguments { camera, up, fov: None, orthographic: false, zoom: 1.0 };
    camera::view(&lens, extent, [4, 3]).camera
}
