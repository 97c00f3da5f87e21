//! Clouds larger than memory: pyramids that are open, as they are placed, edited and displayed.

use crate::input::budget::Budget;
use crate::input::clouds::Clouds;
use crate::input::formats::SessionFormats;
use crate::input::pyramid_cut::VisibleNodes;
use crate::input::tinted_nodes::TintedNodes;
use crate::output::terminal;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
use std::time::Instant;
use surfelshop_api::columns::POSITION;
use surfelshop_cloud::display::{Display, Look};
use surfelshop_cloud::selection::{Ball, EditLayer, HiddenOnes, RegionSelection, StrokeTools};
use surfelshop_cloud::{Cloud, Column, Loaded, Summary, Transform, memory};
use surfelshop_pyramid::{NodeLook, Nodes, Pyramid, PyramidError};

/// Surfels that stand for the whole: what frames it, traces it, and is given to graphs as data.
const OVERVIEW: u64 = 500_000;

/// The same of files that are read in place, whose normals have to be estimated first.
const OVERVIEW_IN_PLACE: u64 = 100_000;

/// Radius of merged surfels of pyramids in pixels, where nobody says another.
pub const DETAIL_PX: f32 = 1.0;

/// Whether files are read in place that memory would hold, too.
static IN_PLACE: OnceLock<bool> = OnceLock::new();

/// Reads files in place wherever that can be done; the first call counts.
pub fn use_in_place(wanted: bool) {
    // A second call changes nothing.
    let _second = IN_PLACE.set(wanted);
}

/// Bytes that a point takes while a file is read into memory and what it lacks is estimated: 160 were measured of
/// points with colours, and those of scanners have more columns.
const READ_BYTES: u64 = 400;

/// How files are called that say they can be read in place, COPC and Potree; of others only who asks for it finds out.
const IN_PLACE_ENDINGS: [&str; 2] = [".copc.laz", "metadata.json"];

/// Surfels that stand for what edits have left, at least, where there are as many.
const LEAST_OVERVIEW: u64 = 20_000;

/// Leaves that are looked at, at most, for how many surfels are selected: they lie where one looks at them, and are in
/// memory for that.
const COUNTED_LEAVES: usize = 8;

/// A pyramid that is open, as a scene places, edits and displays it. A clone shares its nodes.
#[derive(Clone)]
pub struct OpenPyramid {
    transform: Transform,
    /// The whole as the file has it, as one cloud.
    whole: Cloud,
    layer: Arc<KnownLayer>,
    /// The whole with the edits, where they hide nothing.
    edited: Option<Cloud>,
    /// What does strokes of edits, where tools are run.
    tools: Option<Arc<dyn StrokeTools>>,
    nodes: Arc<Nodes>,
    look: Arc<NodeLook>,
    /// Which cloud stands for the whole: the generation of its positions.
    overview: u64,
    pub(super) budget: Budget,
    /// Discs are drawn no larger, scene units.
    pub(super) largest_radius: f64,
    /// Whether some surfels are not shown for their attributes.
    pub(super) has_filters: bool,
    /// What is visible in the last views of it as it is.
    pub(super) visible: VisibleNodes,
    /// What is selected.
    selected: Option<Arc<TintedNodes>>,
    /// About which share of its surfels edits leave, 0 to 1.
    left: f64,
    /// The nodes of displays: an edit leaves those it does not reach as they are.
    displays: Arc<Mutex<Vec<KnownDisplay>>>,
}

/// Edits, with what is known of nodes by now: what edits make of each, and whether they leave nothing of it.
#[derive(Default)]
struct KnownLayer {
    edits: EditLayer,
    known: Mutex<HashMap<u32, (u64, bool)>>,
}

/// A display, with the nodes that are shown by it as long as somebody needs them.
type KnownDisplay = (Arc<Display>, Weak<Nodes>);

/// Opens a file whose points lie in an octree as a pyramid, where that was asked for, or memory would not hold it.
/// Edits that belong to a file ask for it.
pub fn open_in_place(
    (path, has_edits): (&Path, bool),
    formats: Option<&SessionFormats>,
    budget: Budget,
) -> Result<Option<(Loaded, OpenPyramid)>, PyramidError> {
    let Some(formats) = formats else { return Ok(None) };
    let is_typed = IN_PLACE.get().copied().unwrap_or_default();
    let is_asked = is_typed || has_edits;
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let says_so = IN_PLACE_ENDINGS.iter().any(|ending| name.ends_with(ending)) || path.is_dir();
    if !is_asked && !says_so {
        return Ok(None);
    }
    let started = Instant::now();
    let in_place = match Pyramid::in_place(path, Arc::new(formats.clone())) {
        // Whoever reads the file as a whole says what can be read of it.
        Err(_) if !is_asked => return Ok(None),
        in_place => in_place?,
    };
    let Some(pyramid) = in_place else {
        if is_typed {
            terminal::warn(format!(
                "{}: its points lie in no octree that could be read in place; `surfelshop index` makes a pyramid",
                path.display()
            ));
        }
        return Ok(None);
    };
    let bytes = pyramid.directory().n_surfels.saturating_mul(READ_BYTES);
    if !is_asked && memory::available().is_none_or(|free| bytes <= free) {
        return Ok(None);
    }
    match opened(pyramid, budget, started) {
        Err(_) if !is_asked => Ok(None),
        open => open.map(Some),
    }
}

/// Opens a pyramid: a cloud that stands for the whole, and what is drawn instead.
pub fn open(path: &Path, budget: Budget) -> Result<(Loaded, OpenPyramid), PyramidError> {
    let started = Instant::now();
    opened(Pyramid::open(path)?, budget, started)
}

fn opened(
    pyramid: Pyramid,
    budget: Budget,
    started: Instant,
) -> Result<(Loaded, OpenPyramid), PyramidError> {
    let pyramid = Arc::new(pyramid);
    let overview = if pyramid.is_in_place() { OVERVIEW_IN_PLACE } else { OVERVIEW };
    let cloud = pyramid.overview_cloud(overview)?;
    let directory = pyramid.directory();
    let summary = Summary {
        file: pyramid.path().display().to_string(),
        format: match pyramid.is_in_place() {
            true => format!(
                "{} in {} cells, read in place, seen as a whole by {} points",
                directory.generator,
                directory.n_nodes,
                cloud.len()
            ),
            false => format!(
                "pyramid of {} surfels in {} nodes, seen as a whole by {} merged ones",
                directory.n_surfels,
                directory.n_nodes,
                cloud.len()
            ),
        },
        n_in_file: directory.n_surfels,
        n_surfels: directory.n_surfels,
        origin: cloud.origin().to_array(),
        columns: directory.columns.iter().map(|column| column.name.clone()).collect(),
        comments: directory.notes.clone(),
        seconds: started.elapsed().as_secs_f64(),
        ..Summary::default()
    };
    let (transform, layer) = (Transform::default(), Arc::<KnownLayer>::default());
    let pyramid = OpenPyramid {
        look: look(&pyramid, transform, &layer, None),
        nodes: Arc::new(Nodes::new(pyramid, budget.kept())),
        whole: cloud.clone(),
        transform,
        layer,
        edited: Some(cloud.clone()),
        tools: None,
        overview: generation(&cloud),
        budget,
        largest_radius: f64::INFINITY,
        has_filters: false,
        visible: VisibleNodes::default(),
        selected: None,
        left: 1.0,
        displays: Arc::default(),
    };
    Ok((Loaded { cloud, summary }, pyramid))
}

/// The largest radius that anything is drawn with.
fn largest_radius(display: &Display) -> f64 {
    let splats = display.splats();
    let largest = match splats.look {
        Look::Points { radius } => Some(radius).filter(|&radius| radius > 0.0),
        Look::Surface => splats.largest_radius,
    };
    largest.map_or(f64::INFINITY, f64::from)
}

/// Tells clouds apart.
fn generation(cloud: &Cloud) -> u64 {
    cloud.column(POSITION).map_or(0, Column::generation)
}

impl OpenPyramid {
    /// Whether a cloud stands for it.
    pub fn is_seen_as(&self, cloud: &Cloud) -> bool {
        self.overview == generation(cloud)
    }

    /// The same pyramid where a scene places it; `overview` stands for it there.
    pub fn placed(&self, transform: &Transform, overview: &Cloud) -> Self {
        let (pyramid, transform) = (self.nodes.pyramid(), *transform);
        Self {
            transform,
            look: look(pyramid, transform, &self.layer, None),
            nodes: Arc::new(Nodes::new(Arc::clone(pyramid), self.budget.kept())),
            overview: generation(overview),
            displays: Arc::default(),
            visible: VisibleNodes::default(),
            ..self.clone()
        }
    }

    /// The same with tools that do strokes of edits.
    #[must_use]
    pub fn with_tools(self, tools: Option<&Arc<dyn StrokeTools>>) -> Self {
        Self { tools: tools.cloned(), ..self }
    }

    /// The edits of it.
    pub fn layer(&self) -> &EditLayer {
        &self.layer.edits
    }

    /// How it stands in the world.
    pub fn transform(&self) -> &Transform {
        &self.transform
    }

    /// The same pyramid with other edits, not displayed; and the cloud that stands for it then.
    ///
    /// # Errors
    /// Where nothing would be left, an edit does not fit its columns, or a node cannot be read.
    pub fn edited(&self, layer: EditLayer) -> anyhow::Result<(Cloud, Self)> {
        let layer = match &self.tools {
            Some(tools) => layer.with_tools(Arc::clone(tools)),
            None => layer,
        };
        layer.check(&self.whole)?;
        let pyramid = self.nodes.pyramid();
        let layer = Arc::new(KnownLayer { edits: layer, known: Mutex::default() });
        let (cloud, left, edited) = self.overview_of(&layer)?;
        // It is told apart from the one before even where it is the same.
        let positions =
            cloud.column(POSITION).map(|old| Column::new(POSITION, 3, old.values().clone()));
        let cloud = cloud.with_columns(positions.into_iter().collect())?;
        let cloud = cloud.transformed(&self.transform)?;
        let edited = Self {
            edited: edited.filter(|_| !layer.edits.hides()),
            look: look(pyramid, self.transform, &layer, None),
            overview: generation(&cloud),
            layer,
            visible: VisibleNodes::default(),
            selected: None,
            left,
            ..self.clone()
        };
        Ok((cloud, edited))
    }

    /// The cloud that stands for what edits leave, about which share that is, and the whole with the edits where this is it.
    fn overview_of(&self, layer: &KnownLayer) -> anyhow::Result<(Cloud, f64, Option<Cloud>)> {
        let pyramid = self.nodes.pyramid();
        // Mostly one edit follows those that are there.
        let since = layer.edits.since(&self.layer.edits);
        let cloud = match self.edited.clone().zip(since) {
            Some((edited, rest)) => rest.applied(edited, None, HiddenOnes::LeftOut)?,
            None => layer.edits.applied(self.whole.clone(), None, HiddenOnes::LeftOut)?,
        };
        let left = cloud.len() as f64 / self.whole.len().max(1) as f64;
        if cloud.len() as u64 >= LEAST_OVERVIEW.min(self.whole.len() as u64) {
            return Ok((cloud.clone(), left, Some(cloud)));
        }
        // Of a small part the whole says too little.
        let most = if pyramid.is_in_place() { OVERVIEW_IN_PLACE } else { OVERVIEW };
        let is_there = |node| !layer.of(pyramid, node).1;
        let change = |node: u32, part: Cloud| {
            let edited = layer.edits.applied(part, pyramid.ball(node), HiddenOnes::LeftOut);
            edited.map_err(|error| error.to_string())
        };
        let found = pyramid.changed_overview((LEAST_OVERVIEW, most), is_there, change)?;
        let Some(cloud) = found else {
            let n_nodes = u32::try_from(pyramid.nodes().len()).unwrap_or(u32::MAX);
            let is_left = |node: u32| pyramid.nodes()[node as usize].is_leaf() && is_there(node);
            if !(0..n_nodes).any(is_left) {
                let n = pyramid.directory().n_surfels;
                anyhow::bail!("the edits would leave none of {n} surfels");
            }
            // Few surfels may be left anywhere, which merged ones do not show.
            return Ok((self.whole.clone(), left, None));
        };
        let cloud = cloud.with_source(self.whole.source().clone());
        Ok((cloud.with_object(self.whole.object()), left, None))
    }

    /// The same pyramid coloured and filtered; `overview` stands for it then.
    pub fn displayed(&self, display: &Arc<Display>, overview: &Cloud) -> Self {
        let pyramid = self.nodes.pyramid();
        let mut displays = self.displays.lock().unwrap_or_else(PoisonError::into_inner);
        displays.retain(|(_, nodes)| nodes.strong_count() > 0);
        let known = displays.iter().find(|(known, _)| known == display);
        let nodes = known.and_then(|(_, nodes)| nodes.upgrade()).unwrap_or_else(|| {
            let nodes = Arc::new(Nodes::new(Arc::clone(pyramid), self.budget.kept()));
            displays.push((Arc::clone(display), Arc::downgrade(&nodes)));
            nodes
        });
        Self {
            largest_radius: largest_radius(display),
            has_filters: !display.filters().is_empty(),
            visible: VisibleNodes::default(),
            look: look(pyramid, self.transform, &self.layer, Some(Arc::clone(display))),
            nodes,
            overview: generation(overview),
            ..self.clone()
        }
    }

    /// The same pyramid with what is selected tinted.
    pub fn selecting(&self, selection: &Arc<RegionSelection>) -> Self {
        Self { selected: Some(Arc::new(TintedNodes::new(selection))), ..self.clone() }
    }

    /// How many surfels it has: exact where nothing is edited, else about as merged ones tell it.
    pub fn n_about(&self) -> u64 {
        (self.pyramid().directory().n_surfels as f64 * self.left).round() as u64
    }

    /// The share of these surfels that is selected, 0 to 1: exact where few leaves are concerned, else that of the merged
    /// surfels of `overview`. Nothing where the selection does not come near any.
    ///
    /// # Errors
    /// Where it asks for an attribute that is not there, or a node cannot be read.
    pub fn selected_share(
        &self,
        selection: &RegionSelection,
        overview: &Cloud,
    ) -> anyhow::Result<Option<f64>> {
        let pyramid = self.nodes.pyramid();
        let leaves = pyramid.leaves_reached((&self.layer.edits, selection), COUNTED_LEAVES);
        if leaves.is_empty() {
            return Ok(None);
        }
        if leaves.len() > COUNTED_LEAVES {
            let n = selection.select_in_world(overview)?.count();
            return Ok(Some(n as f64 / overview.len().max(1) as f64));
        }
        let mut n = 0;
        for leaf in self.nodes.get(&leaves, &self.look)? {
            n += selection.select_in_world(&leaf)?.count();
        }
        Ok((n > 0).then(|| (n as f64 / self.n_about().max(1) as f64).min(1.0)))
    }

    /// The nodes that are read and kept.
    pub fn nodes(&self) -> &Nodes {
        &self.nodes
    }

    /// Nodes as they are shown, read where they are not in memory.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub fn shown(&self, nodes: &[u32]) -> Result<Vec<Arc<Cloud>>, PyramidError> {
        let parts = self.nodes.get(nodes, &self.look)?;
        match &self.selected {
            None => Ok(parts),
            Some(tinted) => tinted.of(self.nodes.pyramid(), parts, nodes),
        }
    }

    /// What is shown of the leaves that `reaches` says yes of, by balls around them in the world; of more than `most`
    /// surfels merged ones, the coarsest refined first. What is selected is not tinted.
    ///
    /// # Errors
    /// Where a node cannot be read.
    pub fn within(
        &self,
        reaches: impl Fn(DVec3, f64) -> bool,
        most: u64,
    ) -> Result<Vec<Arc<Cloud>>, PyramidError> {
        let pyramid = self.nodes.pyramid();
        let Transform { translation, rotation, scale } = self.transform;
        let turn = rotation.quaternion().unwrap_or_default();
        let concerns = |node: u32| {
            let in_world = |(middle, radius): Ball| {
                reaches(turn * (middle * scale) + translation, radius * scale)
            };
            self.is_left(node) && pyramid.ball(node).is_some_and(in_world)
        };
        self.nodes.get(&pyramid.cut_of(concerns, most), &self.look)
    }

    /// Wishes for nodes; see [`Nodes::wish`].
    pub fn wish(&self, in_use: &[u32], wishes: Vec<u32>) {
        self.nodes.wish(in_use, wishes, &self.look);
    }

    /// The pyramid.
    pub fn pyramid(&self) -> &Pyramid {
        self.nodes.pyramid()
    }

    /// Whether edits leave something of a node.
    pub(super) fn is_left(&self, node: u32) -> bool {
        !self.layer.of(self.nodes.pyramid(), node).1
    }
}

impl KnownLayer {
    /// What edits make of a node, as [`EditLayer::version`] tells it, and whether they leave nothing of it.
    fn of(&self, pyramid: &Pyramid, node: u32) -> (u64, bool) {
        let Some(ball) = pyramid.ball(node).filter(|_| !self.edits.is_empty()) else {
            return (0, false);
        };
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        *known.entry(node).or_insert_with(|| {
            let version = self.edits.version(ball, |name| pyramid.has_column(name));
            (version, version != 0 && self.edits.removes(ball, HiddenOnes::LeftOut))
        })
    }
}

/// What is shown of nodes: edited, then placed, then coloured and filtered.
fn look(
    pyramid: &Arc<Pyramid>,
    transform: Transform,
    layer: &Arc<KnownLayer>,
    display: Option<Arc<Display>>,
) -> Arc<NodeLook> {
    let prepare = {
        let (pyramid, layer) = (Arc::clone(pyramid), Arc::clone(layer));
        move |node: u32, cloud: Cloud| {
            let edited = layer.edits.applied(cloud, pyramid.ball(node), HiddenOnes::LeftOut);
            let edited = edited.map_err(|error| error.to_string())?;
            let placed = edited.transformed(&transform).map_err(|error| error.to_string())?;
            match &display {
                None => Ok(placed),
                Some(display) => {
                    display.of(&placed).map(|shown| shown.cloud).map_err(|error| error.to_string())
                }
            }
        }
    };
    let (pyramid, layer) = (Arc::clone(pyramid), Arc::clone(layer));
    let version = move |node: u32| layer.of(&pyramid, node).0;
    Arc::new(NodeLook { prepare: Box::new(prepare), version: Box::new(version) })
}

/// Says what tracers see of pyramids.
pub fn note_traced(clouds: &Clouds) {
    for pyramid in &clouds.pyramids {
        let seen = clouds.loaded.iter().find(|loaded| pyramid.is_seen_as(&loaded.cloud));
        let n = seen.map_or(0, |loaded| loaded.cloud.len() as u64);
        if n < pyramid.pyramid().directory().n_surfels {
            terminal::note(format!(
                "{}: tracers see it as {n} surfels; renderers draw it as fine as --detail says",
                pyramid.pyramid().path().display()
            ));
        }
    }
}

/// Says that some work wants all surfels in memory.
///
/// # Errors
/// Where there is a pyramid among the clouds.
pub fn refuse(clouds: &Clouds, what: &str) -> anyhow::Result<()> {
    match clouds.pyramids.first() {
        None => Ok(()),
        Some(pyramid) => anyhow::bail!(
            "{}: {what} works on clouds in memory, and this is {}",
            pyramid.pyramid().path().display(),
            match pyramid.pyramid().is_in_place() {
                true => "read in place: leave out --in-place, or take a part that memory holds",
                false => "a pyramid: run it on the files that it was made of",
            }
        ),
    }
}
