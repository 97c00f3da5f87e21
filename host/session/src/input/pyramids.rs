//! Clouds larger than memory: pyramids that are open, and the nodes that a view is drawn from.

use crate::input::budget::Budget;
use crate::input::clouds::Clouds;
use crate::input::formats::SessionFormats;
use crate::output::terminal;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use surfelshop_api::columns::POSITION;
use surfelshop_api::{CloudView, ObjectFrame, SurfaceSettings, View};
use surfelshop_cloud::display::{Display, Look};
use surfelshop_cloud::{Cloud, Loaded, Summary, Transform, memory};
use surfelshop_pyramid::{Cut, CutView, Nodes, NodesInMemory, Prepare, Pyramid, PyramidError};
use surfelshop_render::{PartOf, Parts};

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

/// Nodes of a view that may come next, at most: so many that what is drawn now comes soon, too.
const PREFETCHED: usize = 32;

/// A pyramid that is open, as a scene places and displays it.
pub struct OpenPyramid {
    transform: Transform,
    nodes: Nodes,
    /// Which cloud stands for the whole: the generation of its positions.
    overview: u64,
    budget: Budget,
    /// Discs are drawn no larger, scene units.
    largest_radius: f64,
}

/// What a view is drawn from.
#[derive(Default)]
pub struct Drawn<'a> {
    clouds: Vec<Held<'a>>,
    objects: Vec<PartOf>,
    /// The nodes of each pyramid.
    cuts: Vec<(&'a OpenPyramid, Cut)>,
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
    /// The largest radius of a merged surfel in pixels; none where one lies before the near plane.
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
            coarsest_px,
            memory,
            in_place,
        } = self;
        if *in_place {
            let (n, read) = (surfels_drawn.min(surfels), memory.nodes_read);
            return write!(
                out,
                "{file}: drawn in place from {nodes_drawn} of {nodes} cells, about {n} of {surfels} points; {read} cells \
                 were read"
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
            "{file}: drawn from {nodes_drawn} of {nodes} nodes, {surfels_drawn} of {surfels} surfels; {coarsest}; \
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
                coarsest_px: Some(cut.coarsest_px).filter(|px| px.is_finite()),
                memory: pyramid.nodes.in_memory(),
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

/// Opens a file whose points lie in an octree as a pyramid, where that was asked for, or memory would not hold it.
pub fn open_in_place(
    path: &Path,
    formats: Option<&SessionFormats>,
    budget: Budget,
) -> Result<Option<(Loaded, OpenPyramid)>, PyramidError> {
    let Some(formats) = formats else { return Ok(None) };
    let is_asked = IN_PLACE.get().copied().unwrap_or_default();
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
        if is_asked {
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
    let transform = Transform::default();
    let overview = generation(&cloud);
    let nodes = Nodes::new(pyramid, budget.kept(), Box::new(Ok));
    let largest_radius = f64::INFINITY;
    let pyramid = OpenPyramid { transform, nodes, overview, budget, largest_radius };
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
    cloud.column(POSITION).map_or(0, surfelshop_cloud::Column::generation)
}

impl OpenPyramid {
    /// Whether a cloud stands for it.
    pub fn is_seen_as(&self, cloud: &Cloud) -> bool {
        self.overview == generation(cloud)
    }

    /// The same pyramid where a scene places it; `overview` stands for it there.
    pub fn placed(&self, transform: &Transform, overview: &Cloud) -> Self {
        let transform = *transform;
        let place =
            move |cloud: Cloud| cloud.transformed(&transform).map_err(|error| error.to_string());
        self.prepared(transform, Box::new(place), overview)
    }

    /// The same pyramid coloured and filtered; `overview` stands for it then.
    pub fn displayed(&self, display: &Arc<Display>, overview: &Cloud) -> Self {
        let largest_radius = largest_radius(display);
        let (transform, display) = (self.transform, Arc::clone(display));
        let show = move |cloud: Cloud| {
            let placed = cloud.transformed(&transform).map_err(|error| error.to_string())?;
            let shown = display.of(&placed).map_err(|error| error.to_string())?;
            Ok(shown.cloud)
        };
        Self { largest_radius, ..self.prepared(transform, Box::new(show), overview) }
    }

    fn prepared(&self, transform: Transform, prepare: Prepare, overview: &Cloud) -> Self {
        let pyramid = Arc::clone(self.nodes.pyramid());
        let nodes = Nodes::new(pyramid, self.budget.kept(), prepare);
        let (overview, budget) = (generation(overview), self.budget);
        Self { transform, nodes, overview, budget, largest_radius: self.largest_radius }
    }

    /// The pyramid.
    pub fn pyramid(&self) -> &Pyramid {
        self.nodes.pyramid()
    }

    /// The nodes of a view, of those `at_hand`.
    pub fn cut(
        &self,
        (view, surface): (&View, &SurfaceSettings),
        detail_px: f32,
        at_hand: impl Fn(u32) -> bool,
    ) -> Cut {
        let view = CutView {
            largest_radius: self.largest_radius * f64::from(surface.radius_scale),
            ..CutView::new(view, surface, &self.transform, detail_px)
        };
        let pyramid = self.nodes.pyramid();
        Cut::of(pyramid.nodes(), &view, self.budget.drawn(pyramid.surfel_bytes()), at_hand)
    }
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
            let at_hand = |node: u32| wait == Wait::ForAll || pyramid.nodes.has(node);
            let cut = pyramid.cut((view, surface), detail_px, at_hand);
            let frame = cloud.object();
            let nodes = pyramid.nodes.pyramid().nodes();
            for (part, &node) in pyramid.nodes.get(&cut.nodes)?.into_iter().zip(&cut.nodes) {
                drawn.clouds.push(Held::Part(part, frame));
                let is_merged = !nodes[node as usize].is_leaf();
                drawn.objects.push(PartOf { object, is_part: true, is_merged });
            }
            drawn.cuts.push((pyramid, cut));
        }
        Ok(drawn)
    }

    /// Wishes for the nodes that a view would be drawn from and that are not in memory, the coarsest first, and behind
    /// them for those of a view that may come next. They are read by threads of their own; returns at once.
    pub fn wish(
        &self,
        (view, next): (&View, Option<&View>),
        surface: &SurfaceSettings,
        detail_px: f32,
    ) {
        for Loaded { cloud, .. } in &self.loaded {
            let Some(pyramid) = self.pyramid_of(cloud) else { continue };
            let at_hand = |node| pyramid.nodes.has(node);
            let cut = pyramid.cut((view, surface), detail_px, at_hand);
            let mut wishes = cut.missing;
            if let Some(next) = next {
                let later = pyramid.cut((next, surface), detail_px, at_hand);
                wishes.extend(later.missing.into_iter().take(PREFETCHED));
            }
            pyramid.nodes.wish(&cut.nodes, wishes);
        }
    }

    /// Whether nodes that were wished for are still to come.
    pub fn is_waited_for(&self) -> bool {
        self.pyramids.iter().any(|pyramid| pyramid.nodes.is_loading())
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
            has_arrived |= pyramid.nodes.wait(longest / n)?;
        }
        Ok(has_arrived)
    }
}
