//! The clouds that are shown, read from files.

use crate::input::budget::Budget;
use crate::input::formats::SessionFormats;
use crate::input::layers;
use crate::input::led_tools::LedTools;
use crate::input::pyramids::{self, OpenPyramid};
use crate::input::scenes::Source;
use crate::options::camera::{Extent, N_DIRECTIONS, directions};
use crate::output::terminal::{self, Progress};
use anyhow::{Context as _, bail};
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use surfelshop_api::columns::{TANGENT_U, TANGENT_V};
use surfelshop_api::{CloudFacts, CloudView};
use surfelshop_cloud::selection::StrokeTools;
use surfelshop_cloud::{Cloud, Loaded, ReadError};
use surfelshop_geometry::Bounds;
use surfelshop_pyramid::is_pyramid_file;

/// Clouds that are shown together.
#[derive(Clone)]
pub struct Clouds {
    /// Each cloud and how its load went.
    pub loaded: Vec<Loaded>,
    /// Facts of all together.
    pub facts: CloudFacts,
    /// Pyramids, of which a cloud above shows the whole.
    pub pyramids: Vec<Arc<OpenPyramid>>,
    /// Where one can stand and see much, where a place was looked for and found.
    pub standpoint: Option<Standpoint>,
}

/// A place in free space; see [`inside`](crate::input::inside).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standpoint {
    /// Where it is in the world.
    pub place: DVec3,
    /// Whether most is seen from within, as rooms are, rather than from outside, as things are.
    pub is_within: bool,
}

impl Clouds {
    /// Reads the files, with a progress bar where it takes long, and puts each cloud in its place.
    pub fn read(sources: &[Source], formats: &SessionFormats) -> anyhow::Result<Self> {
        let clouds = Self::read_with(sources, Some(formats), |file| read(file, formats))?;
        for loaded in &clouds.loaded {
            for line in doubts(loaded) {
                terminal::warn_once(format!("{}: {line}", loaded.summary.file));
            }
        }
        Ok(clouds)
    }

    /// The same with another way to read a file into memory; where `in_place` says how, large files that can be read
    /// in place are. A file that comes several times is read once, and
    /// its clouds share what their places leave alike.
    pub fn read_with(
        sources: &[Source],
        in_place: Option<&SessionFormats>,
        mut read: impl FnMut(&Path) -> Result<Loaded, ReadError>,
    ) -> anyhow::Result<Self> {
        let mut files: HashMap<&Path, Loaded> = HashMap::new();
        let mut loaded = Vec::with_capacity(sources.len());
        let mut pyramids = Vec::new();
        let n_pyramids = sources.iter().filter(|source| is_pyramid_file(&source.path)).count();
        let budget = Budget::default().divided(n_pyramids);
        let tools = in_place
            .map(|formats| -> Arc<dyn StrokeTools> { Arc::new(LedTools::new(formats.plugins())) });
        for source in sources {
            let Source { path, transform, place, .. } = source;
            let in_scene = || place.clone().unwrap_or_else(|| path.display().to_string());
            let mut pyramid = None;
            let mut cloud = match files.get(path.as_path()) {
                Some(known) => known.clone(),
                None => {
                    let opened = match is_pyramid_file(path) {
                        true => pyramids::open(path, budget).map(Some),
                        false => {
                            let has_edits = source.layer.is_some();
                            pyramids::open_in_place((path, has_edits), in_place, budget)
                        }
                    };
                    let opened = match place {
                        Some(_) => opened.with_context(in_scene)?,
                        None => opened?,
                    };
                    match (opened, place) {
                        (Some((whole, opened)), _) => {
                            pyramid = Some(opened.with_tools(tools.as_ref()));
                            whole
                        }
                        (None, Some(_)) => read(path).with_context(in_scene)?,
                        (None, None) => read(path)?,
                    }
                }
            };
            if pyramid.is_none() {
                files.entry(path).or_insert_with(|| cloud.clone());
            }
            if let Some(transform) = transform {
                cloud.cloud = cloud.cloud.transformed(transform).with_context(in_scene)?;
                cloud.summary.origin = cloud.cloud.origin().to_array();
                pyramid = pyramid.map(|pyramid| pyramid.placed(transform, &cloud.cloud));
            }
            if let Some(layer) = &source.layer {
                (cloud.cloud, pyramid) = edited(layer, pyramid.as_ref()).with_context(in_scene)?;
            }
            pyramids.extend(pyramid.map(Arc::new));
            loaded.push(cloud);
        }
        Ok(Self { pyramids, ..Self::of(loaded) })
    }

    /// Clouds that are at hand.
    pub fn of(loaded: Vec<Loaded>) -> Self {
        let facts = together(loaded.iter().map(|loaded| loaded.cloud.facts()));
        Self { loaded, facts, pyramids: Vec::new(), standpoint: None }
    }

    /// Metres of a scene unit, where all clouds say the same.
    pub fn metres_per_unit(&self) -> Option<f64> {
        let mut all = self.loaded.iter().map(|loaded| loaded.cloud.source().metres_per_unit);
        let first = all.next().filter(|metres| *metres > 0.0 && metres.is_finite())?;
        all.all(|other| other.to_bits() == first.to_bits()).then_some(first)
    }

    /// The clouds as renderers see them.
    pub fn views(&self) -> Vec<CloudView<'_>> {
        self.loaded.iter().map(|loaded| loaded.cloud.view()).collect()
    }

    /// A sphere around all surfels whose radii are scaled by a factor, and about their hull, for framing.
    ///
    /// Its centre is that of the bounds, which moves little when surfels are added; it reaches to
    /// the farthest edge of a surfel, which is nearer than the corner of the bounds. Strays that lie so far apart that
    /// nothing else would be seen are left out.
    pub fn extent(&self, radius_scale: f32) -> Extent {
        let of: Vec<(&Cloud, Option<Bounds>)> = self
            .loaded
            .iter()
            .map(|loaded| (&loaded.cloud, without_strays(&loaded.cloud)))
            .collect();
        let (mut min, mut max) = (self.facts.bounds_min, self.facts.bounds_max);
        if of.iter().any(|(_, core)| core.is_some()) {
            let own = |(cloud, core): &(&Cloud, Option<Bounds>)| {
                let facts = cloud.facts();
                core.unwrap_or(Bounds { min: facts.bounds_min, max: facts.bounds_max })
            };
            let drawn = of.iter().filter(|(cloud, _)| !cloud.is_empty()).map(own);
            let all = drawn.reduce(|a, b| Bounds { min: a.min.min(b.min), max: a.max.max(b.max) });
            (min, max) = all.map_or((min, max), |all| (all.min, all.max));
        }
        let center = 0.5 * (min + max);
        let scale = f64::from(radius_scale);
        let reach = |(cloud, core): &(&Cloud, _)| reach(cloud, center, scale, *core);
        let radius = of.iter().map(reach).fold(0.0, f64::max);
        let n: usize = of.iter().map(|(cloud, _)| cloud.len()).sum();
        let extent = Extent::new(center, radius);
        if n == 0 {
            return extent;
        }
        let stride = n.div_ceil(HULL_SURFELS);
        let none = [(f32::NEG_INFINITY, Vec3::NAN); N_DIRECTIONS];
        let found = of.iter().fold(none, |found, (cloud, core)| {
            let own = farthest(cloud, center, (radius_scale, *core), stride);
            farther(found, own)
        });
        extent.reaching(found.map(|(_, place)| place))
    }
}

/// A pyramid with the edits of a file, and the cloud that stands for it then.
fn edited(
    layer: &Path,
    pyramid: Option<&OpenPyramid>,
) -> anyhow::Result<(Cloud, Option<OpenPyramid>)> {
    let Some(pyramid) = pyramid else {
        bail!(
            "{}: expected a pyramid that these edits belong to, found a cloud that memory holds; remove `layer`",
            layer.display()
        );
    };
    let edits = layers::read(layer, pyramid.pyramid().directory().n_surfels)?;
    let edited = pyramid.edited(edits).with_context(|| format!("{}", layer.display()))?;
    Ok((edited.0, Some(edited.1)))
}

/// Surfels of which the hull is made; of more, so many of them.
const HULL_SURFELS: usize = 1 << 16;

/// The box of a cloud's points but for strays that would hide all others; `None` where there are none such.
fn without_strays(cloud: &Cloud) -> Option<Bounds> {
    let facts = cloud.facts();
    let all = Bounds { min: facts.bounds_min, max: facts.bounds_max };
    let (origin, positions) = (cloud.origin(), cloud.positions());
    let core = all.without_strays(positions.len(), |i| origin + positions[i].as_dvec3());
    (core != all).then_some(core)
}

/// How far something reaches along each of the directions, and its place.
type Farthest = [(f32, Vec3); N_DIRECTIONS];

fn farther(a: Farthest, b: Farthest) -> Farthest {
    std::array::from_fn(|i| if b[i].0 > a[i].0 { b[i] } else { a[i] })
}

/// What of each `stride`th surfel of a cloud is farthest from a point in world space, by directions; of those in a box.
fn farthest(
    cloud: &Cloud,
    from: DVec3,
    (radius_scale, core): (f32, Option<Bounds>),
    stride: usize,
) -> Farthest {
    let is_left_out = left_out(cloud, core);
    let from = (from - cloud.origin()).as_vec3();
    let radius = radius_of(cloud);
    let directions = directions();
    let positions = cloud.positions();
    // Numbers and no vectors, and no branch: so that several directions are compared at a time.
    let of = |axis: usize| directions.map(|towards| towards[axis]);
    let [x, y, z] = [of(0), of(1), of(2)];
    let mut most = [f32::NEG_INFINITY; N_DIRECTIONS];
    let mut which = [u32::MAX; N_DIRECTIONS];
    for (n, i) in (0..positions.len()).step_by(stride).enumerate() {
        if is_left_out(positions[i]) {
            continue;
        }
        let (offset, radius) = (positions[i] - from, radius(i) * radius_scale);
        for k in 0..N_DIRECTIONS {
            let along = offset.x * x[k] + offset.y * y[k] + offset.z * z[k] + radius;
            let is_farther = along > most[k];
            most[k] = if is_farther { along } else { most[k] };
            which[k] = if is_farther { n as u32 } else { which[k] };
        }
    }
    std::array::from_fn(|k| match positions.get((which[k] as usize).saturating_mul(stride)) {
        Some(position) => {
            let radius = radius((which[k] as usize) * stride) * radius_scale;
            (most[k], *position - from + radius * directions[k])
        }
        None => (f32::NEG_INFINITY, Vec3::NAN),
    })
}

/// The longest half axis of a surfel, scene units.
fn radius_of(cloud: &Cloud) -> impl Fn(usize) -> f32 + '_ {
    let radii = cloud.radii();
    let tangents = [TANGENT_U, TANGENT_V].map(|name| cloud.vectors(name));
    move |i| {
        let tangents = tangents.iter().filter_map(|vectors| vectors.get(i));
        let longest = tangents.map(|tangent| tangent.length()).fold(0.0, f32::max);
        longest.max(radii.get(i).copied().unwrap_or(0.0))
    }
}

/// Which positions lie outside of a box in world space, where there is one.
fn left_out(cloud: &Cloud, core: Option<Bounds>) -> impl Fn(Vec3) -> bool + '_ {
    move |position| core.is_some_and(|core| !core.holds(cloud.origin() + position.as_dvec3()))
}

/// Distance from a point in world space to the farthest edge of a surfel; of those in a box.
fn reach(cloud: &Cloud, from: DVec3, radius_scale: f64, core: Option<Bounds>) -> f64 {
    let is_left_out = left_out(cloud, core);
    let from = from - cloud.origin();
    let radius = radius_of(cloud);
    let edge = |(i, offset): (usize, &Vec3)| {
        (offset.as_dvec3() - from).length() + f64::from(radius(i)) * radius_scale
    };
    let drawn = cloud.positions().iter().enumerate().filter(|(_, place)| !is_left_out(**place));
    drawn.map(edge).fold(0.0, f64::max)
}

/// Reads one file, with a progress bar where it takes long.
pub fn read(file: &Path, formats: &SessionFormats) -> Result<Loaded, ReadError> {
    let progress = Progress::new(format!("reading {}", file.display()));
    let tell = |fraction| progress.tell(fraction);
    surfelshop_cloud::read(file, &formats.reading(&tell))
}

/// What was odd in a file: what its format says, and points that have no place. Organised clouds have places without
/// a point.
#[must_use]
pub fn doubts(loaded: &Loaded) -> Vec<String> {
    let Loaded { cloud, summary } = loaded;
    let mut lines = summary.warnings.clone();
    if summary.n_dropped > 0 && cloud.source().grid_up.is_none() {
        let (n, all) = (summary.n_dropped, summary.n_in_file);
        lines.push(format!("{n} of {all} points are left out, {}", summary.why_dropped()));
    }
    lines
}

/// Facts of several clouds as of one.
///
/// A column counts as there when one cloud has it, since facts tell a renderer what it may leave
/// out; what all share is what every cloud that has surfels shares.
fn together<'a>(clouds: impl Iterator<Item = &'a CloudFacts>) -> CloudFacts {
    let mut whole = CloudFacts::default();
    for facts in clouds {
        for column in &facts.columns {
            if let Err(place) = whole.columns.binary_search(column) {
                whole.columns.insert(place, column.clone());
            }
        }
        whole.objects.extend(&facts.objects);
        whole.colored.extend(&facts.colored);
        whole.clouds.extend(facts.clouds.iter().cloned());
        if facts.n_surfels == 0 {
            continue;
        }
        if whole.n_surfels == 0 {
            let CloudFacts { columns, objects, colored, clouds, .. } = whole;
            whole = CloudFacts { columns, objects, colored, clouds, ..facts.clone() };
            continue;
        }
        whole.n_surfels += facts.n_surfels;
        whole.bounds_min = whole.bounds_min.min(facts.bounds_min);
        whole.bounds_max = whole.bounds_max.max(facts.bounds_max);
        whole.equal_radius = whole.equal_radius.filter(|own| facts.equal_radius == Some(*own));
        whole.equal_color = whole.equal_color.filter(|own| facts.equal_color == Some(*own));
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::ObjectFrame;
    use surfelshop_cloud::{Buffer, Column, Summary};

    fn facts(n_surfels: u64, at: f64, columns: &[&str]) -> CloudFacts {
        CloudFacts {
            n_surfels,
            bounds_min: DVec3::splat(at),
            bounds_max: DVec3::splat(at + 1.0),
            columns: columns.iter().map(|&name| name.to_owned()).collect(),
            equal_radius: Some(0.5),
            equal_color: Some([0.1; 3]),
            objects: vec![ObjectFrame { size: at, ..ObjectFrame::default() }],
            colored: vec![false],
            clouds: vec![surfelshop_api::CloudInfo { n_surfels, ..Default::default() }],
        }
    }

    #[test]
    fn facts_of_several_clouds_cover_all() {
        let clouds = [
            CloudFacts::default(),
            facts(2, 5.0, &["ao", "position"]),
            CloudFacts { equal_color: None, ..facts(3, -1.0, &["color", "position"]) },
        ];
        let whole = together(clouds.iter());
        assert_eq!(whole.n_surfels, 5);
        assert_eq!(whole.clouds.iter().map(|cloud| cloud.n_surfels).collect::<Vec<_>>(), [2, 3]);
        assert_eq!(whole.bounds_min, DVec3::splat(-1.0));
        assert_eq!(whole.bounds_max, DVec3::splat(6.0));
        assert_eq!(whole.columns, ["ao", "color", "position"]);
        assert_eq!((whole.equal_radius, whole.equal_color), (Some(0.5), None));
    }

    #[test]
    fn empty_clouds_do_not_stretch_the_bounds() {
        let whole = together([facts(1, 5.0, &[]), CloudFacts::default()].iter());
        assert_eq!(whole.bounds_min, DVec3::splat(5.0));
        assert_eq!(whole.equal_radius, Some(0.5));
    }

    /// A line of points a unit long, and some far away.
    fn line_with(strays: &[f32]) -> Clouds {
        let line = (0..200).map(|i| i as f32 / 199.0).chain(strays.iter().copied());
        let positions = Buffer::F32(line.flat_map(|x| [x, 0.0, 0.0]).collect());
        let columns = vec![Column::new("position", 3, positions)];
        let cloud = Cloud::new(DVec3::ZERO, columns).unwrap();
        Clouds::of(vec![Loaded { cloud, summary: Summary::default() }])
    }

    #[test]
    fn views_of_all_leave_out_strays_that_would_hide_the_rest() {
        let reach = |clouds: &Clouds| clouds.extent(1.0).radius();
        assert!((reach(&line_with(&[])) - 0.5).abs() < 1e-6);
        let far = line_with(&[1e6, -1e9, 1e6]);
        assert!((reach(&far) - 0.5).abs() < 1e-6, "{}", reach(&far));
        // What makes a picture of all a few times smaller is in it.
        let near = line_with(&[30.0, -20.0]);
        assert!(reach(&near) > 20.0);
    }
}
