//! The nodes of a pyramid that a view is drawn from: what others hide may be coarser.

use crate::input::pyramids::OpenPyramid;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::{SurfaceSettings, View};
use surfelshop_pyramid::{Cut, CutView, Nodes, Occlusion, PyramidError};

/// Views whose occlusion is kept: those of panes side by side.
const KEPT: usize = 4;

/// What is drawn coarsely to find out what it hides has to be followed by so many surfels more. Pictures from outside and
/// in motion have fewer, and finding out takes some tens of milliseconds.
const WORTHWHILE: u64 = 4_000_000;

/// What the last views hide.
#[derive(Default)]
pub(super) struct Occlusions {
    of: Mutex<VecDeque<(Seen, Arc<Occlusion>)>>,
}

/// What an occlusion follows from, for a pyramid as it stands and is displayed.
#[derive(Clone, PartialEq)]
struct Seen {
    view: View,
    surface: SurfaceSettings,
    detail_px: f32,
    nodes: Vec<u32>,
}

impl Occlusions {
    fn get(
        &self,
        nodes: &Nodes,
        view: &CutView,
        seen: Seen,
    ) -> Result<Arc<Occlusion>, PyramidError> {
        // What is in there is only ever changed whole.
        let lock = || self.of.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, kept)) = lock().iter().find(|(kept, _)| *kept == seen) {
            return Ok(Arc::clone(kept));
        }
        let clouds = nodes.get(&seen.nodes)?;
        let occlusion = Arc::new(Occlusion::new(view, &seen.view, &seen.surface, &clouds));
        let mut kept = lock();
        kept.truncate(KEPT - 1);
        kept.push_front((seen, Arc::clone(&occlusion)));
        Ok(occlusion)
    }
}

impl OpenPyramid {
    /// The nodes of a view, of those `at_hand`.
    ///
    /// # Errors
    /// Where a coarse node, by which it is found out what is hidden, cannot be read.
    pub(super) fn cut(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        detail_px: f32,
        at_hand: impl Fn(u32) -> bool,
    ) -> Result<Cut, PyramidError> {
        let cut_view = CutView {
            largest_radius: self.largest_radius * f64::from(surface.radius_scale),
            ..CutView::new(view, surface, &self.transform, detail_px)
        };
        let nodes = self.nodes.pyramid().nodes();
        let at_most = self.budget.drawn(self.nodes.pyramid().surfel_bytes());
        let all = |_| true;
        let whole = Cut::of(nodes, &cut_view, at_most, all, None);
        let coarse = Cut::of(nodes, &cut_view.coarser(), at_most, all, None);
        if whole.n_surfels < coarse.n_surfels + WORTHWHILE {
            return Ok(Cut::of(nodes, &cut_view, at_most, at_hand, None));
        }
        let coarse = Cut::of(nodes, &cut_view.coarser(), at_most, &at_hand, None).nodes;
        let seen = Seen { view: *view, surface: *surface, detail_px, nodes: coarse };
        let occlusion = self.occlusions.get(&self.nodes, &cut_view, seen)?;
        Ok(Cut::of(nodes, &cut_view, at_most, at_hand, Some(&occlusion)))
    }
}
