//! A stroke that a tool is led along.

use crate::document::OpenClouds;
use surfelshop_api::Stroke;
use surfelshop_api::params::Values;
use surfelshop_cloud::Cloud;
use surfelshop_cloud::selection::RegionSelection;
use surfelshop_runtime::plugins::{Contents, CrashMark, UnitRef};
use surfelshop_runtime::tools::Running;

/// A tool over a stroke, on a cloud as it was before.
pub(super) struct StrokeRun {
    pub(super) name: String,
    pub(super) reference: UnitRef,
    /// The cloud among the open ones, and all of them before the stroke.
    pub(super) index: usize,
    pub(super) before: OpenClouds,
    /// What the tool runs over; of a pyramid a node of it.
    pub(super) base: Cloud,
    /// What of a pyramid the stroke is of, by regions.
    pub(super) regions: Option<RegionSelection>,
    pub(super) running: Option<(Running, Contents)>,
    /// What the run that is under way or was the last is given: its parameters, and how much of the stroke.
    pub(super) given: Option<(Values, Stroke)>,
    /// Whether it changed colours.
    pub(super) paints: bool,
    /// Samples that the run that is under way or was the last knows.
    pub(super) n_samples: usize,
    /// The whole stroke, once it is over.
    pub(super) whole: Option<Stroke>,
    /// A file that names the tool meanwhile, so that a crash is attributed to it.
    #[expect(dead_code, reason = "it is removed when it is dropped")]
    pub(super) mark: Option<CrashMark>,
}
