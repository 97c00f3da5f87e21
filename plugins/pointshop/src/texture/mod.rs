//! # `texture`: lays a picture on the surface
//!
//! | parameter     | type  | default | meaning                                                                 |
//! |---------------|-------|---------|-------------------------------------------------------------------------|
//! | `image`       | file  |         | the picture: PNG or JPEG                                                |
//! | `pairs`       | text  |         | places of the surface and where of the picture they are, see below       |
//! | `opacity`     | float | 1       | how much of the colour the picture covers, times its own                |
//! | `reach`       | float | 0       | how far from the places the surface is looked at, scene units; 0: as far as the picture reaches |
//! | `rounds`      | int   | 60      | rounds of laying the surface flat                                       |
//! | `distortion`  | bool  | false   | makes the column `distortion`                                           |
//! | `coordinates` | bool  | false   | makes the column `texture_coordinate`                                   |
//!
//! `pairs` is two pairs or more, with semicolons between; each is x, y and z in world space and two shares of the picture,
//! from its left and from its top: `0 0 1 0 1; 0.5 0 1 1 1` lays its lower edge between two places. Two pairs say where it
//! lies and how large it is; more pull it into place.
//!
//! Method. The surface around the places is laid flat with as little stretch as can be, see `flatten`, and the picture is
//! laid on it, in two passes, the second with what is beneath the picture alone. A surfel takes the mean of the picture
//! over its width, in linear light. `distortion` is how many times longer or shorter lengths become in the worst
//! direction: 1 is none. `texture_coordinate` is two floats, as `pairs` has them. Both are 0 beyond the patch.
//!
//! Limits: normals of neighbours more than 72 degrees apart are a sharp edge, over which no surface hangs together; at
//! most three million surfels; a surfel has one colour, so that no more of a picture shows than there are surfels; a patch
//! that wraps around a body meets itself. Colours of Gaussian splats' harmonics stay.
//!
//! Source: Zwicker et al., "Pointshop 3D", SIGGRAPH 2002, for the tool; Sorkine and Alexa, "As-rigid-as-possible surface
//! modeling", SGP 2007; Liu et al., "A local/global approach to mesh parameterization", SGP 2008; Schmidt et al.,
//! "Interactive decal compositing with discrete exponential maps", SIGGRAPH 2006.
//!
//! ```text
//! surfelshop bake vase.ply -t texture --set image=label.png --set pairs="0 0 1 0 1; 0.5 0 1 1 1" -o labelled.ply
//! ```

pub(crate) mod flatten;
pub(crate) mod patch;
pub(crate) mod picture;

use crate::columns::{Column, from_linear};
use crate::search::Search;
use crate::surfels::{Surfels, finite, floats, spacings};
use crate::typed::rows;
use flatten::{Flat, Pin};
use patch::Patch;
use picture::Picture;
use surfelshop_api::columns::{COLOR, Element, NEUTRAL_ALBEDO, Values};
use surfelshop_api::glam::{DMat2, DVec2, DVec3, Vec3};
use surfelshop_api::params::PICTURE_PAIRS;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

params! {
    /// Settings of `texture`.
    pub struct Settings {
        /// The picture: PNG or JPEG.
        image: FilePath { default: FilePath::default(), endings: &["png", "jpg", "jpeg"] },
        /// Places and where of the picture they are, from its left and top: `x y z u v; x y z u v`.
        pairs: String { default: String::new(), unit: PICTURE_PAIRS },
        /// How much of the colour the picture covers.
        opacity: f32 { default: 1.0, range: 0.0..=1.0 },
        /// How far from the places the surface is looked at, scene units; 0: as far as the picture reaches.
        reach: f64 { default: 0.0, range: 0.0..=1e9 },
        /// Rounds of laying the surface flat.
        rounds: u32 { default: 60, range: 1..=2000, quality: true, logarithmic: true },
        /// Makes the column `distortion`: 1 where lengths are kept.
        distortion: bool { default: false },
        /// Makes the column `texture_coordinate`: shares of the picture, from its left and top.
        coordinates: bool { default: false },
    }
}

/// Column that says how lengths are distorted.
const DISTORTION: &str = "distortion";

/// Column of places of the picture.
const COORDINATE: &str = "texture_coordinate";

/// A place may be so many spacings away from the nearest surfel.
const NEAR: f64 = 3.0;

/// The surface is looked at so much farther than the picture reaches in a straight line: it is curved.
const BEYOND: f64 = 1.5;

/// Rounds that tell about where the picture lies.
const ABOUT: u32 = 5;

/// What is laid flat goes so many of the picture's heights and widths beyond it: what lies farther is not painted, and would
/// only pull.
const MARGIN: f64 = 0.15;

/// Why cases of `check` are left out.
const NEEDS_PICTURE: &str = "no case has a picture";

/// The tool.
pub(crate) struct Texture;

/// A place of the surface, from the cloud's origin, and of the picture, in shares from its left and top.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PlacePair {
    place: DVec3,
    share: DVec2,
}

/// What the picture becomes at a surfel.
struct Shown {
    /// In shares of the picture, from its left and top.
    share: DVec2,
    /// Linear light and how much it covers; none outside the picture.
    light: Option<(Vec3, f32)>,
    /// The map's larger and smaller stretch; 0 where it has none.
    stretch: [f64; 2],
}

impl Tool for Texture {
    const INFO: UnitInfo = UnitInfo::new(
        "texture",
        "Texture of a picture",
        "Lays a picture on the surface by pairs of places.",
    );
    type Params = Settings;
    const LIMITS: &'static [LimitInfo] = &[
        LimitInfo::new("outputs", NEEDS_PICTURE),
        LimitInfo::new("threads", NEEDS_PICTURE),
        LimitInfo::new("again", NEEDS_PICTURE),
        LimitInfo::new("reordered", NEEDS_PICTURE),
    ];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let surfels = Surfels::of(cloud)?;
        if params.image.is_empty() {
            return Err(Error::new("expected a picture in `image`, found no file"));
        }
        let reach = finite("reach", params.reach)?;
        let pairs = read_pairs(&params.pairs, cloud.origin)?;
        job.progress(0.0, "reading the picture");
        let picture = Picture::read(params.image.as_path(), job)?;
        let aspect = picture.aspect();
        let in_picture = |share: DVec2| DVec2::new(share.x * aspect, 1.0 - share.y);
        let search = Search::build(&surfels.places, job)?;
        let apart = spacings(&search, &surfels.places, job, 0.0..0.1)?;
        let nearest = nearest(&pairs, &search, &apart)?;
        job.progress(0.1, "finding the surface around the places");
        let reach = if reach > 0.0 { reach } else { BEYOND * reach_of(&pairs, in_picture) };
        let patch = Patch::around(&surfels, &search, &nearest, reach, job)?;
        let pins = |patch: &Patch| pins(&pairs, &nearest, &surfels, patch, in_picture);
        let about = Flat::of(&patch, &surfels.normals, &pins(&patch)?, ABOUT, job, 0.2..0.3)?;
        let beneath = beneath(&patch, &about, &pins(&patch)?, aspect);
        drop((patch, about));
        let patch = Patch::of(&surfels, &search, beneath, job, 0.3..0.35)?;
        let pins = pins(&patch)?;
        let flat = Flat::of(&patch, &surfels.normals, &pins, params.rounds, job, 0.35..0.8)?;
        job.progress(0.8, "painting");
        let shown = job.map(patch.surfels.len(), 0.8..0.95, |i| {
            let at = flat.lie.picture(flat.places[i]);
            let [larger, smaller] = flat.slope(&patch, i).map_or([0.0; 2], stretches);
            // What a surfel is as wide as, in heights of the picture.
            let surfel = patch.surfels[i] as usize;
            let radius = surfels.radii.get(surfel).copied().unwrap_or(apart[surfel]);
            let width = radius * larger / flat.lie.turn.length();
            let light = picture.at(at, width).filter(|_| at.is_finite());
            let share = DVec2::new(at.x / aspect, 1.0 - at.y);
            Shown {
                share: if share.is_finite() { share } else { DVec2::ZERO },
                light: light.map(|seen| (seen.truncate(), seen.w * params.opacity)),
                stretch: [larger, smaller],
            }
        })?;
        let off = pins.iter().map(|pin| flat.pinned(pin).distance(flat.lie.plane(pin.picture)));
        let off = off.fold(0.0, f64::max);
        let settled = if flat.settled { "" } else { ", not settled" };
        let words = format!("places are off by at most {off:.2e} in the scene's unit{settled}");
        stage(cloud, &patch, &shown, params, &words, job)
    }
}

/// The surfels beneath the picture and its places, and some around.
fn beneath(patch: &Patch, flat: &Flat, pins: &[Pin], aspect: f64) -> Vec<u32> {
    let corners = [DVec2::ZERO, DVec2::new(aspect, 1.0)].into_iter();
    let all = corners.chain(pins.iter().map(|pin| flat.lie.picture(flat.places[pin.surfel])));
    let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (low, high) = all.fold(start, |(low, high), at| (low.min(at), high.max(at)));
    let margin = MARGIN * (high - low);
    let is_beneath = |place: &DVec2| {
        let at = flat.lie.picture(*place);
        at.cmpge(low - margin).all() && at.cmple(high + margin).all()
    };
    let places = patch.surfels.iter().zip(&flat.places);
    places.filter(|(_, place)| is_beneath(place)).map(|(surfel, _)| *surfel).collect()
}

/// The larger and the smaller stretch of a map.
fn stretches(slope: DMat2) -> [f64; 2] {
    // The singular values: half the lengths of sum and difference of the similarity and the mirror that it is made of.
    let (a, b) = (slope.x_axis, slope.y_axis);
    let turned = DVec2::new(a.x + b.y, a.y - b.x).length();
    let mirrored = DVec2::new(a.x - b.y, a.y + b.x).length();
    [0.5 * (turned + mirrored), 0.5 * (turned - mirrored).abs()]
}

/// Reads pairs of places; those of the surface from the cloud's origin.
fn read_pairs(text: &str, origin: DVec3) -> Result<Vec<PlacePair>> {
    let form = "two pairs or more, `x y z u v` with semicolons between";
    let pair = |[x, y, z, u, v]: [f64; 5]| PlacePair {
        place: DVec3::new(x, y, z) - origin,
        share: DVec2::new(u, v),
    };
    let pairs: Vec<PlacePair> = rows("pairs", text, form)?.into_iter().map(pair).collect();
    match pairs.len() {
        0 | 1 => Err(Error::new(format!("`pairs`: expected {form}, found {}", pairs.len()))),
        _ => Ok(pairs),
    }
}

/// The surfel nearest to each place.
fn nearest(pairs: &[PlacePair], search: &Search, apart: &[f64]) -> Result<Vec<u32>> {
    let found = pairs.iter().enumerate().map(|(i, pair)| {
        let found = search.closest(pair.place);
        let away = found.map_or(f64::INFINITY, |found| found.squared.sqrt());
        let spacing = found.map_or(0.0, |found| apart[found.index as usize]);
        found.filter(|_| away <= NEAR * spacing).map(|found| found.index).ok_or_else(|| {
            let n = i + 1;
            Error::new(format!(
                "`pairs`: expected places on the surface, found place {n} {away:.3e} away from the nearest \
                 surfel, where these are {spacing:.3e} apart"
            ))
        })
    });
    found.collect()
}

/// How far the picture reaches from the places, by how far these are apart.
fn reach_of(pairs: &[PlacePair], in_picture: impl Fn(DVec2) -> DVec2) -> f64 {
    let of_pair = |(a, b): (&PlacePair, &PlacePair)| {
        a.place.distance(b.place) / in_picture(a.share).distance(in_picture(b.share))
    };
    let all =
        pairs.iter().enumerate().flat_map(|(i, a)| pairs[i + 1..].iter().map(move |b| (a, b)));
    let scale = all.map(of_pair).filter(|scale| scale.is_finite()).fold(0.0, f64::max);
    let corners = [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(&in_picture);
    let to_nearest = |corner: &DVec2| {
        let distances = pairs.iter().map(|pair| in_picture(pair.share).distance(*corner));
        distances.fold(f64::INFINITY, f64::min)
    };
    let between = pairs.iter().map(|pair| pair.place.distance(pairs[0].place)).fold(0.0, f64::max);
    (scale * corners.iter().map(to_nearest).fold(0.0, f64::max)).max(between)
}

fn pins(
    pairs: &[PlacePair],
    nearest: &[u32],
    surfels: &Surfels,
    patch: &Patch,
    in_picture: impl Fn(DVec2) -> DVec2,
) -> Result<Vec<Pin>> {
    let pins = pairs.iter().zip(nearest).map(|(pair, own)| {
        let surfel = patch.surfels.binary_search(own).ok()?;
        let away = pair.place - surfels.places[*own as usize];
        let offset = patch.axes[surfel].map(|axis| away.dot(axis));
        Some(Pin { surfel, offset: offset.into(), picture: in_picture(pair.share) })
    });
    pins.collect::<Option<_>>().ok_or_else(|| Error::new("expected finite places, found others"))
}

fn stage(
    cloud: &CloudView<'_>,
    patch: &Patch,
    shown: &[Shown],
    params: &Settings,
    words: &str,
    job: &Job<'_>,
) -> Result<()> {
    let albedos = cloud.albedos();
    let painted = patch.surfels.iter().zip(shown).filter_map(|(&i, shown)| {
        let (i, (light, cover)) = (i as usize, shown.light.filter(|(_, cover)| *cover > 0.0)?);
        Some((i, albedos.get(i)?.lerp(light, cover)))
    });
    let painted: Vec<(usize, Vec3)> = painted.collect();
    if painted.is_empty() {
        return Err(Error::new("expected a picture that covers surfels, found none beneath it"));
    }
    let whole = |components: usize, value: &dyn Fn(&Shown) -> [f32; 2]| {
        let mut values = vec![0.0; components * cloud.len];
        for (i, shown) in patch.surfels.iter().zip(shown) {
            let at = components * *i as usize;
            values[at..at + components].copy_from_slice(&value(shown)[..components]);
        }
        values
    };
    let worst =
        |[larger, smaller]: [f64; 2]| if smaller > 0.0 { larger.max(1.0 / smaller) } else { 0.0 };
    let distortions =
        params.distortion.then(|| whole(1, &|shown| [worst(shown.stretch) as f32, 0.0]));
    let shares = params.coordinates.then(|| whole(2, &|shown| shown.share.as_vec2().to_array()));
    let distortions = distortions.as_ref().map(|values| floats(DISTORTION, 1, values));
    let shares = shares.as_ref().map(|values| floats(COORDINATE, 2, values));
    let columns = distortions.into_iter().chain(shares);
    job.check()?;
    let seen = shown.iter().filter(|shown| shown.light.is_some());
    let stretches = seen.flat_map(|shown| shown.stretch).filter(|stretch| *stretch > 0.0);
    let mut stretches: Vec<f64> = stretches.collect();
    stretches.sort_by(f64::total_cmp);
    // Without those in the deepest folds.
    let at = |percent: usize| stretches.get(percent * stretches.len() / 100).copied();
    let [low, high] = [1, 99].map(|percent| at(percent).unwrap_or(0.0));
    let n = patch.surfels.len();
    job.progress(
        1.0,
        &format!(
            "{} of {n} surfels around the places painted; lengths become {low:.3} to {high:.3} times as \
             long (1 % to 99 %); {words}",
            painted.len()
        ),
    );
    stage_colors(cloud, &painted, columns, job)
}

/// Stages colours of some surfels, in order of their numbers, in the type that the cloud's have, and other columns; all else
/// stays.
pub(crate) fn stage_colors<'a>(
    cloud: &CloudView<'_>,
    painted: &[(usize, Vec3)],
    others: impl Iterator<Item = NewColumn<'a>>,
    job: &Job<'_>,
) -> Result<()> {
    let is_known = |column: &&ColumnView<'_>| {
        column.components >= 3
            && matches!(column.values, Values::F32(_) | Values::U16(_) | Values::U8(_))
    };
    let column = cloud.column(COLOR).filter(is_known);
    let components = column.map_or(3, |column| column.components);
    let element = column.map_or(Element::U8, |column| column.values.element());
    let n = components as usize;
    let painted = |(at, old): (usize, f64)| {
        let (i, component) = (at / n, at % n);
        let found = painted.binary_search_by_key(&i, |(surfel, _)| *surfel);
        match found.ok().filter(|_| component < 3) {
            Some(found) => from_linear(element, component, painted[found].1[component].into()),
            None => old,
        }
    };
    let mut values = column.map_or(Column::U8(Vec::new()), |column| Column::rows(column, &[]));
    match column {
        Some(column) => values.extend(column.values.iter_f64().enumerate().map(painted)),
        None => {
            let neutral = |c: usize| from_linear(element, c, NEUTRAL_ALBEDO[c].into());
            values.extend((0..n * cloud.len).map(|at| (at, neutral(at % n))).map(painted));
        }
    }
    let mut columns = vec![values.named(COLOR, components)];
    others.for_each(|other| columns.push(other));
    job.edit(&Edit::Columns(columns))
}
