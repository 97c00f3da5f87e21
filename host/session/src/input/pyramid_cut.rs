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

/// How far points of cells that are read in place may lie from the coarser ones, in spacings of these.
const IN_PLACE: f64 = 2.0;

/// A cut is refined so many times at most where something becomes visible; after that all counts as visible. What is
/// hidden is three levels coarser at most, and a gap shows what is behind it once its edges are fine.
const ROUNDS: usize = 24;

/// What is known of the last views.
#[derive(Clone, Default)]
pub(super) struct VisibleNodes(Arc<Mutex<VecDeque<Known>>>);

/// A view of a pyramid as fine as so many pixels.
type Of = (View, SurfaceSettings, f32);

/// A view, with the nodes that it shows of those that could be finer.
struct Known {
    of: Of,
    shows: Shows,
}

enum Shows {
    /// These, and maybe others.
    Some(Box<Search>),
    /// These and no others.
    These(HashSet<u32>),
    /// All, as far as it is worthwhile to find out.
    All,
}

/// What is known while it is found out what a view shows.
struct Search {
    grid: DepthGrid,
    /// Nodes that are in the grid for good.
    added: HashSet<u32>,
    /// Those that are visible.
    found: HashSet<u32>,
    n_rounds: usize,
}

impl VisibleNodes {
    /// What is known of a view is looked at, or changed; what is in there is only ever changed whole.
    fn with<T>(&self, work: impl FnOnce(&mut VecDeque<Known>) -> T) -> T {
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Takes out what is known of a view.
    fn take(&self, of: &Of) -> Option<Shows> {
        self.with(|all| {
            let at = all.iter().position(|known| known.of == *of)?;
            all.remove(at).map(|known| known.shows)
        })
    }

    fn put(&self, of: Of, shows: Shows) {
        self.with(|all| {
            all.truncate(REMEMBERED - 1);
            all.push_front(Known { of, shows });
        });
    }
}

impl Shows {
    fn has(&self, node: u32) -> bool {
        match self {
            Self::Some(search) => search.found.contains(&node),
            Self::These(these) => these.contains(&node),
            Self::All => true,
        }
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

    /// The same where nodes that others hide stay coarser; as long as it is not known which these are, with the nodes by
    /// which that is found out.
    ///
    /// Drawn coarsely first, nodes that turn out to be visible are refined, until those that are visible are fine enough.
    /// So what lies behind a gap is refined once what surrounds the gap is fine. The outcome follows from the view and the
    /// nodes. As long as it is not known all nodes count as visible, and the missing ones are of those by which it is found
    /// out.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub(super) fn visible_cut(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        detail_px: f32,
        at_hand: impl Fn(u32) -> bool,
        most_rounds: usize,
    ) -> Result<(Cut, Option<Vec<u32>>), PyramidError> {
        let cut_view = self.cut_view((view, surface), detail_px);
        let of = (*view, *surface, detail_px);
        let mut shows = self
            .visible
            .take(&of)
            .unwrap_or_else(|| self.nothing_known((view, surface), &cut_view));
        let mut n_rounds = 0;
        let cut = loop {
            let cut = self.cut_of(&cut_view, &at_hand, |node| shows.has(node));
            let Shows::Some(search) = &mut shows else { break (cut, None) };
            if !cut.missing.is_empty() || n_rounds >= most_rounds {
                let all = self.cut_of(&cut_view, &at_hand, |_| true);
                break (Cut { missing: cut.missing, ..all }, Some(cut.nodes));
            }
            let found = search.visible_of(self, &cut, &cut_view)?;
            n_rounds += 1;
            search.n_rounds += 1;
            if found.is_empty() {
                shows = Shows::These(std::mem::take(&mut search.found));
            } else if 10 * found.len() > ALMOST_ALL * cut.hidden.len() || search.n_rounds > ROUNDS {
                shows = Shows::All;
            } else {
                search.found.extend(found);
            }
        };
        self.visible.put(of, shows);
        Ok(cut)
    }

    /// What is known of a view at first. Merged values may be filtered out, or edited away, where those of leaves are not.
    fn nothing_known(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        cut_view: &CutView,
    ) -> Shows {
        let is_as_in_file = !self.has_filters && self.layer().is_empty();
        if !is_as_in_file || cut_view.detail_px <= 0.0 || !self.is_worthwhile(cut_view) {
            return Shows::All;
        }
        DepthGrid::new(view, surface).map_or(Shows::All, |grid| {
            let (added, found) = (HashSet::new(), HashSet::new());
            Shows::Some(Box::new(Search { grid, added, found, n_rounds: 0 }))
        })
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

impl Search {
    /// Those of the hidden nodes of a cut that are visible.
    fn visible_of(
        &mut self,
        pyramid: &OpenPyramid,
        cut: &Cut,
        view: &CutView,
    ) -> Result<Vec<u32>, PyramidError> {
        let (records, scale) = (pyramid.pyramid().nodes(), pyramid.transform().scale);
        // Points of cells lie up to a few of their spacings apart.
        let in_place = if pyramid.pyramid().is_in_place() { IN_PLACE } else { 1.0 };
        let new = cut.nodes.iter().copied().filter(|node| !self.added.contains(node));
        let new: Vec<u32> = new.collect();
        let clouds = pyramid.shown(&new)?;
        let shown = |(cloud, &node): (_, &u32)| {
            let apart = f64::from(records[node as usize].apart) * scale * in_place;
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
