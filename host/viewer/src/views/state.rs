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
    /// The shared camera as it saw everything, where panes are about to become narrower.
    pub(super) framed: Option<Camera>,
    /// Whether the camera walks: a drag looks around then.
    pub(crate) walking: bool,
    /// The pane and depth that the wheel zooms to while pictures have no depth.
    pub(crate) anchor_depth: Option<(u32, f64)>,
    /// The surface point under the pointer.
    pub(crate) pointer_position: Option<DVec3>,
    /// What lies at [`Views::pointer_position`], in one line.
    pub(crate) pointer_text: String,
    /// Of which of the visible clouds it is.
    pub(crate) pointer_cloud: Option<usize>,
}

impl Views {
    pub(crate) fn new(up: UpAxis) -> Self {
        Self {
            camera: initial_camera(&Extent::new(DVec3::ZERO, 1.0), up, USUAL_SHAPE),
            own_cameras: HashMap::new(),
            panes: BTreeMap::from([(0, Pane::new())]),
            tree: arrangement::default_tree(&[0]),
            focused: 0,
            adaptive: true,
            hands: Hands::default(),
            measuring: Measuring::default(),
            flight: None,
            alone: OneCloud::default(),
            framed: None,
            walking: false,
            anchor_depth: None,
            pointer_position: None,
            pointer_text: String::new(),
            pointer_cloud: None,
        }
    }
}

/// Width and height of what a camera frames where views are as wide or wider.
const USUAL_SHAPE: [u32; 2] = [4, 3];

impl Views {
    /// Width and height that a camera has to fill so that all views show what it frames.
    pub(crate) fn shape(&self) -> [u32; 2] {
        let aspect = |[width, height]: [u32; 2]| f64::from(width) / f64::from(height);
        let sizes = self.panes.values().map(|pane| pane.size_px);
        let sizes = sizes.filter(|size| !size.contains(&0)).chain([USUAL_SHAPE]);
        sizes.min_by(|a, b| aspect(*a).total_cmp(&aspect(*b))).unwrap_or(USUAL_SHAPE)
    }
}

/// The camera that shows all of a cloud, from the front, the side and above, in pictures of this width and height.
pub(crate) fn initial_camera(extent: &Extent, up: UpAxis, shape: [u32; 2]) -> Camera {
    camera_in(extent, up, CameraSpec::three_quarter(), shape)
}

/// The camera of a preset, or of a place.
pub(crate) fn camera_in(
    extent: &Extent,
    up: UpAxis,
    camera: CameraSpec,
    shape: [u32; 2],
) -> Camera {
    let lens = LensArguments { camera, up, fov: None, orthographic: false, zoom: 1.0 };
    camera::view(&lens, extent, shape).camera
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_framed_fits_into_the_narrowest_view() {
        let mut views = Views::new(UpAxis::Y);
        let extent = Extent::new(DVec3::ZERO, 1.0);
        let distance = |views: &Views| {
            let camera = initial_camera(&extent, UpAxis::Y, views.shape());
            camera.eye.distance(camera.target)
        };
        let usual = distance(&views);
        let pane = |size_px: [u32; 2]| {
            let mut pane = Pane::new();
            pane.size_px = size_px;
            pane
        };
        views.panes.insert(1, pane([900, 300]));
        assert_eq!(distance(&views), usual, "wider ones show all of it");
        views.panes.insert(2, pane([300, 600]));
        assert!(distance(&views) > 1.5 * usual);
    }
}
