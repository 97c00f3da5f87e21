//! A picture that the window requests, and the slot it is for.

use super::level_of_detail::Detail;
use std::sync::Arc;
use surfelshop_api::params::Values;
use surfelshop_api::{Scene, View};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_image::EyeDome;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::scenes::NamedRenderer;

/// The slot of exported pictures; no pane has it.
pub(crate) const EXPORT_SLOT: ViewSlot = ViewSlot { pane: u32::MAX, side: 0 };

/// The pane number of measured pictures; no pane has it.
pub(crate) const MEASURE_PANE: u32 = u32::MAX - 1;

/// What a picture is drawn for: a pane and one of its two sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct ViewSlot {
    pub(crate) pane: u32,
    pub(crate) side: usize,
}

/// Everything a picture depends on.
#[derive(Clone)]
pub(crate) struct ViewRequest {
    pub(crate) renderer: String,
    pub(crate) values: Values,
    pub(crate) clouds: Arc<Clouds>,
    /// What each of the clouds names to draw it.
    pub(crate) named: Vec<Option<NamedRenderer>>,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) display: DisplayTransform,
    pub(crate) view: View,
    /// Settled pictures that it is the mean of at rest, each seen at another place of every pixel; at least 1.
    pub(crate) antialias: u32,
    /// Whether surfels that are seen from behind have a colour of their own.
    pub(crate) tint_backs: bool,
    /// How it is darkened by what is nearer, if it is; in pixels of the whole picture.
    pub(crate) eye_dome: Option<EyeDome>,
    /// The share of surfels and pixels that is drawn.
    pub(crate) detail: Detail,
    /// Whether something moves: the first frame is enough, since another request follows.
    pub(crate) in_motion: bool,
    /// Whether the picture is measured and not shown: only colour is drawn, and pictures of views go
    /// first.
    pub(crate) for_measurement: bool,
    /// The request's number, which its reply repeats.
    pub(crate) serial: u64,
}
