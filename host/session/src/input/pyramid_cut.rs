//! The nodes of a pyramid that a view is drawn from: what others hide may be coarser.

use crate::input::pyramids::OpenPyramid;
use std::collections::{HashSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::{SurfaceSettings, View};
use surfelshop_pyramid::{Cut, CutView, DepthGrid, PyramidError, ShownNode};

/// Views whose visible nodes are remembered: those of panes side by side.
const REMEMBERED: usize = 4;

/// Surfels of a cut for each pixel from which on it is found out what of it is hidden: fewer are drawn sooner than that.
const WORTHWHILE: u64 = 8;

/// Tenths of what may be hidden that are visible where finding out more is given up: as from above a city.
const ALMOST_ALL: usize = 9;

/// A cut is refined so many times at most where something becomes visible. Five to seven were seen; beyond these all
/// counts as visible.
const ROUNDS: usize = 24;

/// What is known of the last views.
#[derive(Clone, Default)]
pub(super) struct VisibleNodes(Arc<Mutex<VecDeque<Known>>>);

/// A view, with what it shows.
struct Known {
    of: (View, SurfaceSettings, f32),
    shows: Shows,
}

/// The nodes that a view shows, of those that could be finer.
#[derive(Clone)]
enum Shows {
    /// These, and maybe others.
    Some(Arc<HashSet<u32>>),
    /// These and no others.
    These(Arc<HashSet<u32>>),
    /// All, as far as it is worthwhile to find out.
    All,
}

impl Shows {
    fn has(&self, node: u32) -> bool {
        match self {
            Self::Some(these) | Self::These(these) => these.contains(&node),
            Self::All => true,
        }
    }

    /// What is known when these are found, of so many that were asked about.
    fn with(self, found: Vec<u32>, n_asked: usize) -> Self {
        match self {
            Self::Some(these) if found.is_empty() => Self::These(these),
            Self::Some(_) if 10 * found.len() > ALMOST_ALL * n_asked => Self::All,
            Self::Some(mut these) => {
                Arc::make_mut(&mut these).extend(found);
                Self::Some(these)
            }
            known => known,
        }
    }
}

impl VisibleNodes {
    /// What is in there is only ever changed whole.
    fn with<T>(&self, work: impl FnOnce(&mut VecDeque<Known>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn get(&self, of: &(View, SurfaceSettings, f32)) -> Shows {
        let known = |all: &mut VecDeque<Known>| {
            all.iter().find(|known| known.of == *of).map(|known| known.shows.clone())
        };
        self.with(known).unwrap_or_else(|| Shows::Some(Arc::default()))
    }

    fn put(&self, known: Known) {
        self.with(|all| {
            all.retain(|other| other.of != known.of);
            all.truncate(REMEMBERED - 1);
            all.push_front(known);
        });
    }
}

impl OpenPyramid {
    /// The nodes of a view, of those `at_hand`.
    pub fn cut(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        detail_px: f32,
        at_hand: impl Fn(u32) -> bool,
    ) -> Cut {
        self.cut_of(&self.cut_view((view, surface), detail_px), at_hand, |_| true)
    }

    /// The same where nodes that others hide stay coarser.
    ///
    /// Drawn coarsely first, nodes that turn out to be visible are refined, until those that are visible are fine enough.
    /// So what is seen through a gap is seen once what surrounds the gap is fine. The outcome follows from the view and
    /// the nodes; where some are missing that decide, it is the cut as far as is known without them.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub(super) fn visible_cut(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        detail_px: f32,
        at_hand: impl Fn(u32) -> bool,
    ) -> Result<Cut, PyramidError> {
        let cut_view = self.cut_view((view, surface), detail_px);
        // Merged values may be filtered out where those of leaves are not.
        if self.has_filters || detail_px <= 0.0 || !self.is_worthwhile(&cut_view) {
            return Ok(self.cut_of(&cut_view, at_hand, |_| true));
        }
        let of = (*view, *surface, detail_px);
        let mut shows = self.visible.get(&of);
        let Some(mut search) = Search::new(view, surface) else { return Ok(Cut::default()) };
        for _ in 0..ROUNDS {
            let cut = self.cut_of(&cut_view, &at_hand, |node| shows.has(node));
            let is_known = !matches!(shows, Shows::Some(_)) || cut.hidden.is_empty();
            if is_known || !cut.missing.is_empty() {
                return Ok(cut);
            }
            let found = search.visible_of(self, &cut, &cut_view)?;
            shows = shows.with(found, cut.hidden.len());
            self.visible.put(Known { of, shows: shows.clone() });
        }
        Ok(self.cut_of(&cut_view, at_hand, |_| true))
    }

    /// Whether a view is drawn from so many surfels, whatever memory holds, that most of them may be hidden.
    fn is_worthwhile(&self, view: &CutView) -> bool {
        let all = (|_| true, |_| true);
        let [width, height] = view.size_px.map(u64::from);
        Cut::of(self.pyramid().nodes(), view, u64::MAX, all).n_surfels > WORTHWHILE * width * height
    }

    fn cut_of(
        &self,
        view: &CutView,
        at_hand: impl Fn(u32) -> bool,
        is_visible: impl Fn(u32) -> bool,
    ) -> Cut {
        let most = self.budget.drawn(self.pyramid().surfel_bytes());
        let is_there = |node| self.is_left(node);
        Cut::of_visible(self.pyramid().nodes(), view, most, (at_hand, is_there), is_visible)
    }

    fn cut_view(&self, (view, surface): (&View, &SurfaceSettings), detail_px: f32) -> CutView {
        CutView {
            largest_radius: self.largest_radius * f64::from(surface.radius_scale),
            ..CutView::new(view, surface, self.transform(), detail_px)
        }
    }
}

/// What is known while it is found out what a view shows.
struct Search {
    grid: DepthGrid,
    /// Nodes that are in the grid for good.
    added: HashSet<u32>,
}

impl Search {
    fn new(view: &View, surface: &SurfaceSettings) -> Option<Self> {
        Some(Self { grid: DepthGrid::new(view, surface)?, added: HashSet::new() })
    }

    /// Those of the hidden nodes of a cut that are visible.
    fn visible_of(
        &mut self,
        pyramid: &OpenPyramid,
        cut: &Cut,
        view: &CutView,
    ) -> Result<Vec<u32>, PyramidError> {
        let (records, scale) = (pyramid.pyramid().nodes(), pyramid.transform().scale);
        let new = cut.nodes.iter().copied().filter(|node| !self.added.contains(node));
        let new: Vec<u32> = new.collect();
        let clouds = pyramid.shown(&new)?;
        let shown = |(cloud, &node): (_, &u32)| {
            let apart = f64::from(records[node as usize].apart) * scale;
            (node, ShownNode { cloud, apart: apart as f32 })
        };
        let nodes = clouds.iter().map(|cloud| &**cloud).zip(&new).map(shown);
        let (fine, open): (Vec<_>, Vec<_>) =
            nodes.partition(|(node, _)| view.is_fine(&records[*node as usize]));
        self.added.extend(fine.iter().map(|(node, _)| node));
        self.grid.add(&fine.into_iter().map(|(_, node)| node).collect::<Vec<_>>());
        let (open, nodes): (Vec<u32>, Vec<_>) = open.into_iter().unzip();
        let visible = self.grid.visible(&nodes);
        let is_hidden = |node: &u32| cut.hidden.binary_search(node).is_ok();
        let found = open.into_iter().zip(visible).filter(|(_, is_visible)| *is_visible);
        Ok(found.map(|(node, _)| node).filter(is_hidden).collect())
    }
}
