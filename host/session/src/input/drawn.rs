//! What a view is drawn from: clouds, and of pyramids the nodes that are as fine as it needs.

use crate::input::clouds::Clouds;
use crate::input::pyramids::OpenPyramid;
use crate::output::terminal;
use std::sync::Arc;
use std::time::Duration;
use surfelshop_api::{CloudView, ObjectFrame, SurfaceSettings, View};
use surfelshop_cloud::{Cloud, Loaded};
use surfelshop_pyramid::{Cut, NodesInMemory, PyramidError};
use surfelshop_render::{PartOf, Parts};

/// Nodes of a view that may come next, at most: so many that what is drawn now comes soon, too.
const PREFETCHED: usize = 32;

/// What a view is drawn from.
#[derive(Default)]
pub struct Drawn<'a> {
    clouds: Vec<Held<'a>>,
    objects: Vec<PartOf>,
    /// The nodes of each pyramid.
    cuts: Vec<(&'a OpenPyramid, Cut)>,
    /// Whether it is not known yet what of them is hidden.
    is_provisional: bool,
}

/// What a view is drawn from of a pyramid.
#[derive(Clone, Debug, serde::Serialize)]
pub struct PyramidUse {
    /// The file.
    pub file: String,
    /// Nodes that are drawn, of all.
    pub nodes_drawn: usize,
    /// See there.
    pub nodes: usize,
    /// Surfels that are drawn, of those of all leaves.
    pub surfels_drawn: u64,
    /// See there.
    pub surfels: u64,
    /// Nodes that others hide and that are therefore coarser than those that are visible, at most eight times.
    pub nodes_hidden: usize,
    /// The largest radius of a merged surfel in pixels, of nodes that are not hidden; none where one lies before the
    /// near plane.
    pub coarsest_px: Option<f64>,
    /// What is in memory, and what was read for it.
    pub memory: NodesInMemory,
    /// Whether it is a file of points that is read in place: its nodes are cells, their points are not merged, and
    /// how many there are of them is an estimate.
    pub in_place: bool,
}

impl std::fmt::Display for PyramidUse {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            file,
            nodes_drawn,
            nodes,
            surfels_drawn,
            surfels,
            nodes_hidden,
            coarsest_px,
            memory,
            in_place,
        } = self;
        let hidden = match nodes_hidden {
            0 => String::new(),
            1 => "; 1 node is hidden, and coarser than the others".to_owned(),
            n => format!("; {n} nodes are hidden, and coarser than the others"),
        };
        if *in_place {
            let (n, read) = (surfels_drawn.min(surfels), memory.nodes_read);
            return write!(
                out,
                "{file}: drawn in place from {nodes_drawn} of {nodes} cells, about {n} of {surfels} points{hidden}; {read} \
                 cells were read"
            );
        }
        let coarsest = match coarsest_px {
            Some(px) if *px > 0.0 => format!("merged ones have at most {px:.2} pixels"),
            Some(_) => "none of them merged".to_owned(),
            None => "merged ones are close to the eye".to_owned(),
        };
        let megabytes = memory.bytes_read as f64 / 1e6;
        write!(
            out,
            "{file}: drawn from {nodes_drawn} of {nodes} nodes, {surfels_drawn} of {surfels} surfels{hidden}; {coarsest}; \
             {} nodes were read, {megabytes:.1} MB",
            memory.nodes_read
        )
    }
}

enum Held<'a> {
    Whole(&'a Cloud),
    Part(Arc<Cloud>, ObjectFrame),
}

impl Drawn<'_> {
    /// What is drawn as renderers see it, with the clouds that it was chosen from.
    pub fn with<'b>(&'b self, whole: &'b Clouds) -> DrawnViews<'b> {
        let view = |held: &'b Held<'_>| match held {
            Held::Whole(cloud) => cloud.view(),
            Held::Part(cloud, object) => CloudView { object: *object, ..cloud.view() },
        };
        let clouds = self.clouds.iter().map(view).collect();
        let has_parts = !self.cuts.is_empty();
        let data = if has_parts { whole.views() } else { Vec::new() };
        DrawnViews { clouds, data, objects: &self.objects, has_parts }
    }

    /// Nodes that would be drawn, and are not in memory.
    pub fn n_missing(&self) -> usize {
        self.cuts.iter().map(|(_, cut)| cut.missing.len()).sum()
    }

    /// Whether the next picture of the view may be drawn from other nodes.
    pub fn is_provisional(&self) -> bool {
        self.is_provisional || self.n_missing() > 0
    }

    /// What is drawn of each pyramid.
    pub fn pyramids(&self) -> Vec<PyramidUse> {
        let of = |(pyramid, cut): &(&OpenPyramid, Cut)| {
            let file = pyramid.pyramid();
            PyramidUse {
                file: file.path().display().to_string(),
                nodes_drawn: cut.nodes.len(),
                nodes: file.nodes().len(),
                surfels_drawn: cut.n_surfels,
                surfels: file.directory().n_surfels,
                nodes_hidden: cut.hidden.len(),
                coarsest_px: Some(cut.coarsest_px).filter(|px| px.is_finite()),
                memory: pyramid.nodes().in_memory(),
                in_place: file.is_in_place(),
            }
        };
        self.cuts.iter().map(of).collect()
    }
}

/// What a view is drawn from as renderers see it.
pub struct DrawnViews<'a> {
    clouds: Vec<CloudView<'a>>,
    data: Vec<CloudView<'a>>,
    objects: &'a [PartOf],
    has_parts: bool,
}

impl DrawnViews<'_> {
    /// The clouds and parts.
    pub fn clouds(&self) -> &[CloudView<'_>] {
        &self.clouds
    }

    /// What they are parts of; nothing where all of them are whole.
    pub fn parts(&self) -> Option<Parts<'_>> {
        self.has_parts.then_some(Parts { objects: self.objects, data: &self.data })
    }
}

/// Says where memory did not hold what the detail asks for.
pub fn note(drawn: &Drawn<'_>, detail_px: f32) {
    let coarsest = drawn.cuts.iter().map(|(_, cut)| cut.coarsest_px).fold(0.0, f64::max);
    if coarsest <= f64::from(detail_px) {
        return;
    }
    let size = match coarsest.is_finite() {
        true => format!("of {coarsest:.1} pixels"),
        false => "close to the eye".to_owned(),
    };
    terminal::warn_once(format!(
        "the picture has surfels {size}, coarser than the {detail_px} pixels that were asked \
         for: there is no memory for finer ones; --memory gives more"
    ));
}

/// Which nodes are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// All that the view needs, read where they are missing: for pictures that are written or measured.
    ForAll,
    /// Those in memory; parents stand for children that are not.
    ForNone,
    /// The same where the view is not the same for long: what is hidden is not found out.
    ForNoneInMotion,
}

impl Clouds {
    /// The pyramid that a cloud stands for, where it is one.
    pub fn pyramid_of(&self, cloud: &Cloud) -> Option<&Arc<OpenPyramid>> {
        self.pyramids.iter().find(|pyramid| pyramid.is_seen_as(cloud))
    }

    /// What a view is drawn from: clouds as they are, and of pyramids the nodes that are as fine as `detail_px` asks.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub fn drawn(
        &self,
        view: &View,
        surface: &SurfaceSettings,
        detail_px: f32,
        wait: Wait,
    ) -> Result<Drawn<'_>, PyramidError> {
        let mut drawn = Drawn::default();
        for (object, Loaded { cloud, .. }) in (0..).zip(&self.loaded) {
            let Some(pyramid) = self.pyramid_of(cloud) else {
                drawn.clouds.push(Held::Whole(cloud));
                drawn.objects.push(PartOf { object, is_part: false, is_merged: false });
                continue;
            };
            let at_hand = |node: u32| wait == Wait::ForAll || pyramid.nodes().has(node);
            // One step a picture, so that whoever draws is not held up.
            let (cut, needed) = cut(pyramid, (view, surface), detail_px, (wait, at_hand), 1)?;
            drawn.is_provisional |= needed.is_some();
            let frame = cloud.object();
            let nodes = pyramid.pyramid().nodes();
            for (part, &node) in pyramid.shown(&cut.nodes)?.into_iter().zip(&cut.nodes) {
                drawn.clouds.push(Held::Part(part, frame));
                let is_merged = !nodes[node as usize].is_leaf();
                drawn.objects.push(PartOf { object, is_part: true, is_merged });
            }
            drawn.cuts.push((pyramid, cut));
        }
        Ok(drawn)
    }

    /// Wishes for the nodes that a view would be drawn from and that are not in memory, the coarsest first, and behind
    /// them, in motion, for those of a view that may come next. They are read by threads of their own; returns at once.
    pub fn wish(
        &self,
        (view, next): (&View, Option<&View>),
        surface: &SurfaceSettings,
        detail_px: f32,
        wait: Wait,
    ) {
        for Loaded { cloud, .. } in &self.loaded {
            let Some(pyramid) = self.pyramid_of(cloud) else { continue };
            let at_hand = |node| pyramid.nodes().has(node);
            let cut = cut(pyramid, (view, surface), detail_px, (wait, at_hand), 0);
            // Whoever draws says what cannot be read.
            let Ok((cut, needed)) = cut else { continue };
            let (mut in_use, mut wishes) = (cut.nodes, cut.missing);
            in_use.extend(needed.into_iter().flatten());
            if let Some(next) = next {
                let later = pyramid.cut((next, surface), detail_px, at_hand);
                wishes.extend(later.missing.into_iter().take(PREFETCHED));
            }
            pyramid.wish(&in_use, wishes);
        }
    }

    /// Whether nodes that were wished for are still to come.
    pub fn is_waited_for(&self) -> bool {
        self.pyramids.iter().any(|pyramid| pyramid.nodes().is_loading())
    }

    /// Waits until nodes that were wished for have arrived, there are no more to come, or so much time has passed;
    /// whether some have arrived.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub fn wait(&self, longest: Duration) -> Result<bool, PyramidError> {
        let mut has_arrived = false;
        let n = self.pyramids.len().max(1) as u32;
        for pyramid in &self.pyramids {
            has_arrived |= pyramid.nodes().wait(longest / n)?;
        }
        Ok(has_arrived)
    }
}

/// The nodes of a view, of those `at_hand`; where it is not known what of them is hidden, also those by which that is found
/// out. So many steps are taken towards it.
fn cut(
    pyramid: &OpenPyramid,
    view: (&View, &SurfaceSettings),
    detail_px: f32,
    (wait, at_hand): (Wait, impl Fn(u32) -> bool),
    steps: usize,
) -> Result<(Cut, Option<Vec<u32>>), PyramidError> {
    match wait {
        Wait::ForNoneInMotion => Ok((pyramid.cut(view, detail_px, at_hand), None)),
        Wait::ForAll => pyramid.visible_cut(view, detail_px, at_hand, usize::MAX),
        Wait::ForNone => pyramid.visible_cut(view, detail_px, at_hand, steps),
    }
}
