//! # `fill-holes`: closes holes with new surfels
//!
//! | parameter | type  | default | meaning                                                        |
//! |-----------|-------|---------|----------------------------------------------------------------|
//! | `largest` | float | 0       | holes wider than this stay, scene units; 0: a third of the cloud's diagonal |
//!
//! Method. Surfels are at a border where those around leave out an angle of 110 degrees in their plane.
//! Each border is looked at in the plane of its mean normal: what discs do not cover and cannot be
//! reached from outside is a hole. A sphere or plane is fitted to the surface four spacings around, and
//! a thin plate, the surface of least bending, to what is left; new surfels lie on both together, as far apart as
//! those around, with radii that cover. Colours and other floats are blended, by the inverse cube of distances from
//! surfels around; whole numbers are those of the nearest. The column `filled` is 1 of new surfels.
//!
//! Limits: what is missing is guessed, smoothly. Holes that need more than one plane to be shown whole,
//! such as one around an edge or more than a half sphere, are left, and counted; so are outer borders.
//! Triangles of a mesh are left out.
//!
//! ```text
//! surfelshop bake scan.ply -t fill-holes --set largest=0.2 -o whole.ply
//! ```

mod patch;
mod rims;
mod thin_plate;

use crate::boolean::seam::UNCUT;
use crate::columns::{Column, from_linear, to_linear};
use crate::holes::patch::{NewSurfel, Outcome, filled};
use crate::holes::rims::{at_borders, borders};
use crate::search::Search;
use crate::surfels::{Surfels, finite, spacings};
use surfelshop_api::columns::{
    CLIP, COLOR, Element, NORMAL, NORMAL_FIELD, POSITION, RADIUS, SPLAT_SCALE, TANGENT_U, TANGENT_V,
};
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;
use surfelshop_geometry::Bounds;

params! {
    /// Settings of `fill-holes`.
    pub struct Settings {
        /// Holes wider than this stay; 0: a third of the cloud's diagonal.
        largest: f64 { default: 0.0, range: 0.0..=1e30, unit: "scene units" },
    }
}

/// The tool.
pub(crate) struct FillHoles;

/// The column of new surfels.
const FILLED: &str = "filled";

/// Fewer surfels enclose nothing.
const LEAST: usize = 4;

impl Tool for FillHoles {
    const INFO: UnitInfo =
        UnitInfo::new("fill-holes", "Fill holes", "Closes holes with smooth patches of surfels.");
    type Params = Settings;
    const LIMITS: &'static [LimitInfo] = &[LimitInfo::new(
        "reordered",
        "which surfels a patch is fitted to depends on their numbers",
    )];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let surfels = Surfels::of(cloud)?;
        let largest = finite("largest", params.largest)?;
        if cloud.column(SPLAT_SCALE).is_some() {
            return Err(Error::new("expected a cloud of surfels, found Gaussian splats"));
        }
        let bounds = Bounds::of(surfels.places.iter().copied());
        let diagonal = bounds.map_or(0.0, |bounds| bounds.diagonal());
        let largest = if largest > 0.0 { largest } else { diagonal / 3.0 };
        job.progress(0.0, "looking for borders");
        let search = Search::build(&surfels.places, job)?;
        let apart = spacings(&search, &surfels.places, job, 0.02..0.15)?;
        let is_border = at_borders(&surfels, &search, &apart, job, 0.15..0.4)?;
        let all = borders(&surfels, &is_border, &apart, job)?;
        let width = |border: &&Vec<usize>| {
            let places = border.iter().map(|&i| surfels.places[i]);
            Bounds::of(places).map_or(0.0, |bounds| bounds.extent())
        };
        let all: Vec<Vec<usize>> = all.into_iter().filter(|border| border.len() >= LEAST).collect();
        let (small, wide): (Vec<_>, Vec<_>) =
            all.iter().partition(|border| width(border) <= largest);
        job.progress(0.4, "filling holes");
        let outcomes =
            job.map(small.len(), 0.4..0.9, |i| filled(small[i], &surfels, &search, &apart))?;
        let n_folded = outcomes.iter().filter(|found| matches!(found, Outcome::Folded)).count();
        let patches: Vec<Vec<NewSurfel>> = outcomes
            .into_iter()
            .filter_map(|found| match found {
                Outcome::Filled(patch) => Some(patch),
                Outcome::NoHole | Outcome::Folded => None,
            })
            .collect();
        let n_holes = patches.len();
        let new = once(patches, job)?;
        let holes = if n_holes == 1 { "hole" } else { "holes" };
        let mut said = format!("{n_holes} {holes} filled with {} surfels", new.len());
        if n_folded > 0 {
            said += &format!("; {n_folded} borders of folded or overlapping surfaces stay");
        }
        if !wide.is_empty() {
            said += &format!("; {} borders are wider than {largest:.6} and stay", wide.len());
        }
        if new.is_empty() {
            job.progress(1.0, &said);
            return Ok(());
        }
        if !cloud.faces.is_empty() {
            said += &format!("; {} triangles are left out", cloud.faces.len());
        }
        stage(cloud, &new, &said, job)
    }
}

/// New surfels, without those where another border's are already: a hole may have several borders.
fn once(patches: Vec<Vec<NewSurfel>>, job: &Job<'_>) -> Result<Vec<NewSurfel>> {
    let numbers = patches.iter().enumerate().flat_map(|(n, patch)| vec![n; patch.len()]);
    let numbers: Vec<usize> = numbers.collect();
    let all: Vec<NewSurfel> = patches.into_iter().flatten().collect();
    let places: Vec<DVec3> = all.iter().map(|surfel| surfel.place).collect();
    let search = Search::build(&places, job)?;
    let stays = |i: usize| {
        // Half a spacing is about 0.7 radii.
        let reach = 0.7 * all[i].radius;
        !search.any(places[i], reach, |found| numbers[found.index as usize] < numbers[i])
    };
    let stays = job.map(all.len(), 0.9..0.92, stays)?;
    Ok(all.into_iter().zip(stays).filter(|(_, stays)| *stays).map(|(new, _)| new).collect())
}

/// The values of new surfels in a column, component by component of each.
fn values(column: &ColumnView<'_>, new: &[NewSurfel]) -> Vec<f64> {
    let n = column.components as usize;
    let element = column.values.element();
    let known: Vec<f64> = column.values.iter_f64().collect();
    let is_color = column.name == COLOR && n >= 3;
    let is_blended = is_color || matches!(element, Element::F32 | Element::F64);
    let value = |surfel: &NewSurfel, c: usize| {
        let at = |i: u32| known[n * i as usize + c];
        if !is_blended {
            return surfel.shares.first().map_or(0.0, |(nearest, _)| at(*nearest));
        }
        let light = |i: u32| if is_color { to_linear(element, c, at(i)) } else { at(i) };
        let mean = surfel.shares.iter().map(|(i, share)| share * light(*i)).sum();
        if is_color { from_linear(element, c, mean) } else { mean }
    };
    new.iter().flat_map(|surfel| (0..n).map(move |c| value(surfel, c))).collect()
}

fn stage(cloud: &CloudView<'_>, new: &[NewSurfel], said: &str, job: &Job<'_>) -> Result<()> {
    job.progress(0.92, "writing columns");
    let rows: Vec<usize> = (0..cloud.len).collect();
    let axes: Vec<[DVec3; 2]> = new
        .iter()
        .map(|surfel| {
            let (u, v) = surfel.normal.any_orthonormal_pair();
            [surfel.radius * u, surfel.radius * v]
        })
        .collect();
    let flat = |vectors: &mut dyn Iterator<Item = DVec3>| -> Vec<f64> {
        vectors.flat_map(|vector| vector.to_array()).collect()
    };
    let mut columns: Vec<(&str, u32, Column)> = Vec::new();
    for column in &cloud.columns {
        job.check()?;
        let mut values_of = Column::rows(column, &rows);
        let numbers: Vec<f64> = match (column.name, column.components) {
            (POSITION, 3) => flat(&mut new.iter().map(|surfel| surfel.place)),
            (NORMAL, 3) => flat(&mut new.iter().map(|surfel| surfel.normal)),
            (RADIUS, 1) => new.iter().map(|surfel| surfel.radius).collect(),
            (TANGENT_U, 3) => flat(&mut axes.iter().map(|axes| axes[0])),
            (TANGENT_V, 3) => flat(&mut axes.iter().map(|axes| axes[1])),
            (CLIP, 7) => UNCUT.map(f64::from).repeat(new.len()),
            (NORMAL_FIELD, n) => vec![0.0; n as usize * new.len()],
            (FILLED, n) => vec![1.0; n as usize * new.len()],
            _ => values(column, new),
        };
        values_of.extend(numbers.into_iter());
        columns.push((column.name, column.components, values_of));
    }
    if cloud.column(FILLED).is_none() {
        let mut marks = vec![0u8; cloud.len];
        marks.resize(cloud.len + new.len(), 1);
        columns.push((FILLED, 1, Column::U8(marks)));
    }
    job.check()?;
    job.progress(1.0, said);
    let columns = columns.iter().map(|(name, components, column)| column.named(name, *components));
    job.edit(&Edit::NewCloud { origin: cloud.origin, columns: columns.collect() })
}
