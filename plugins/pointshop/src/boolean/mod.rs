//! # `boolean`: union, intersection and difference of two closed clouds
//!
//! | parameter   | type   | default | meaning                                                        |
//! |-------------|--------|---------|----------------------------------------------------------------|
//! | `with`      | file   |         | the second cloud, a PLY file                                   |
//! | `operation` | choice | `union` | `union`, `intersection` or `difference`, the first less the second |
//!
//! Method. Winding numbers tell what of a cloud is inside the other, far from its surface; near it, planes
//! and spheres fitted to the other's surfels. A surfel that the other's surface crosses stays, and is cut
//! where the surfaces meet by clip lines, two of them at edges; so that seams are crisp wherever renderers
//! draw these, as `phong-splatting` does. Where the two share a surface the first one's surfels stay.
//! Shared is what both have in one place, up to rounding, and where surfaces fitted to either are less
//! than a tenth of the spacing apart; differences smaller than that are not seen.
//! Surfels of the second that come to line a hole are turned round.
//!
//! The result has the columns of the first cloud, with tangents and clip lines. What the second lacks
//! of them is 0, and its colours are grey.
//!
//! Limits: both clouds must be closed, with normals outwards; holes make a surface that bulges in. A seam's
//! line is straight within a surfel. Of corners where three faces of a solid meet, two cut a surfel.
//! Renderers that draw no clip lines show whole discs, which stand out by their radii. Triangles of a mesh
//! are left out.
//!
//! Source: Adams and Dutré, "Interactive Boolean operations on surfel-bounded solids", SIGGRAPH 2003.
//!
//! ```text
//! surfelshop bake block.ply -t boolean --set with=drill.ply --set operation=difference -o part.ply
//! ```

pub(crate) mod seam;
mod shared;
mod winding;

use crate::boolean::seam::{Fate, Pair, Side, Solid, UNCUT, cut_again, cuts_nothing};
use crate::boolean::shared::twins;
use crate::boolean::winding::Winding;
use crate::columns::{Column, rows_of_file};
use crate::ply::PlyFile;
use crate::search::Search;
use crate::surfels::{Surfels, progress_of, spacings};
use std::ops::Range;
use surfelshop_api::columns::{CLIP, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::areas;

choices! {
    /// What of two solids stays.
    pub enum Operation {
        /// What is in either.
        Union = "union",
        /// What is in both.
        Intersection = "intersection",
        /// What is in the first alone.
        Difference = "difference",
    }
}

params! {
    /// Settings of `boolean`.
    pub struct Settings {
        /// The second cloud: a PLY file of a closed surface.
        with: FilePath { default: FilePath::default(), endings: &["ply"] },
        /// What stays: what is in either cloud (union), in both (intersection), or in the first
        /// alone (difference).
        operation: Operation { default: Operation::Union },
    }
}

/// Why cases of checks, which have one cloud, are refused.
pub(crate) const NEEDS_SECOND: &str = "it needs a second cloud, and the case has one";

/// The tool.
pub(crate) struct Boolean;

impl Tool for Boolean {
    const INFO: UnitInfo = UnitInfo::new(
        "boolean",
        "Boolean operation",
        "Joins, intersects or subtracts two closed clouds.",
    );
    type Params = Settings;
    const LIMITS: &'static [LimitInfo] = &[
        LimitInfo::new("outputs", NEEDS_SECOND),
        LimitInfo::new("threads", NEEDS_SECOND),
        LimitInfo::new("again", NEEDS_SECOND),
        LimitInfo::new("reordered", NEEDS_SECOND),
    ];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let surfels = Surfels::of(cloud)?;
        if params.with.is_empty() {
            return Err(Error::new("expected a second cloud in `with`, found no file"));
        }
        job.progress(0.0, "reading the second cloud");
        let file = PlyFile::read(params.with.as_path())?;
        let others = file.surfels(cloud.origin, job, 0.0..0.1)?;
        let tangents = axes(cloud.vectors(TANGENT_U), cloud.vectors(TANGENT_V), &surfels);
        let first = Solid::of(surfels, tangents, job, 0.1..0.25)?;
        first.check_closed("the first cloud")?;
        let tangents = file.tangents().unwrap_or_else(|| discs(&others));
        let second = Solid::of(others, tangents, job, 0.25..0.4)?;
        second.check_closed(&params.with.0)?;
        let result = Outcome::of(&first, &second, params.operation, job)?;
        result.stage(cloud, (&first, &second), &file, job)
    }
}

/// Half axes of surfels from columns; of discs any two.
fn axes(
    us: impl ExactSizeIterator<Item = Vec3>,
    vs: impl ExactSizeIterator<Item = Vec3>,
    surfels: &Surfels,
) -> Vec<[DVec3; 2]> {
    if us.len() == surfels.places.len() && vs.len() == us.len() {
        return us.zip(vs).map(|(u, v)| [u.as_dvec3(), v.as_dvec3()]).collect();
    }
    discs(surfels)
}

fn discs(surfels: &Surfels) -> Vec<[DVec3; 2]> {
    let of = |(i, normal): (usize, &DVec3)| {
        let (u, v) = normal.any_orthonormal_pair();
        let radius = surfels.radii.get(i).copied().unwrap_or(0.0);
        [radius * u, radius * v]
    };
    surfels.normals.iter().enumerate().map(of).collect()
}

/// Openness from which on a cloud has no inside to speak of.
const OPEN: f64 = 0.1;

impl Solid {
    fn of(
        surfels: Surfels,
        tangents: Vec<[DVec3; 2]>,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<Self> {
        let at = |part: f64| share.start + part * (share.end - share.start);
        job.progress(share.start, "measuring the surface");
        let search = Search::build(&surfels.places, job)?;
        let apart = spacings(&search, &surfels.places, job, at(0.2)..at(0.4))?;
        let positions: Vec<Vec3> = surfels.places.iter().map(|place| place.as_vec3()).collect();
        let normals: Vec<Vec3> = surfels.normals.iter().map(|normal| normal.as_vec3()).collect();
        let progress = progress_of(job, at(0.4)..at(0.9), "measuring the surface");
        let areas = areas::effective(&positions, &normals, &progress)?;
        let winding = Winding::build(&surfels.places, &surfels.normals, &areas, job)?;
        job.progress(share.end, "measuring the surface");
        Ok(Self { surfels, search, apart, winding, tangents })
    }

    fn check_closed(&self, name: &str) -> Result<()> {
        if self.winding.openness <= OPEN {
            return Ok(());
        }
        Err(Error::new(format!(
            "{name}: expected a closed cloud with normals outwards, found one that is open by {:.0} % \
             of its surface; the tools `fill-holes` and `normals` may close it",
            100.0 * self.winding.openness
        )))
    }
}

/// What stays of both clouds: indices and lines that cut.
struct Outcome {
    first: Vec<(usize, [f32; 7])>,
    second: Vec<(usize, [f32; 7])>,
    /// Whether surfels of the second face the other way.
    turned: bool,
    n_cut: usize,
}

impl Outcome {
    fn of(first: &Solid, second: &Solid, operation: Operation, job: &Job<'_>) -> Result<Self> {
        let (of_first, of_second) = match operation {
            Operation::Union => (Side::Outside, Side::Outside),
            Operation::Intersection => (Side::Inside, Side::Inside),
            Operation::Difference => (Side::Outside, Side::Inside),
        };
        let turned = operation == Operation::Difference;
        job.progress(0.4, "comparing the clouds");
        let own_twins = &twins(first, second, job, 0.4..0.44)?;
        let other_twins = &twins(second, first, job, 0.44..0.48)?;
        let pair = Pair { own: first, other: second, own_twins, other_twins };
        job.progress(0.48, "cutting the first cloud");
        let first_fates = job.map(first.surfels.places.len(), 0.48..0.7, |i| {
            pair.fate(i, of_first, |same_way| same_way != turned)
        })?;
        let pair = pair.swapped();
        job.progress(0.7, "cutting the second cloud");
        let second_fates =
            job.map(second.surfels.places.len(), 0.7..0.9, |i| pair.fate(i, of_second, |_| false))?;
        let all = first_fates.iter().chain(&second_fates);
        let n_cut = all.filter(|fate| matches!(fate, Fate::Cut(_))).count();
        let stay = |fates: Vec<Fate>| -> Vec<(usize, [f32; 7])> {
            let lines = |(i, fate)| match fate {
                Fate::Whole => Some((i, UNCUT)),
                Fate::Gone => None,
                Fate::Cut(lines) => Some((i, lines)),
            };
            fates.into_iter().enumerate().filter_map(lines).collect()
        };
        let (first, second) = (stay(first_fates), stay(second_fates));
        if first.is_empty() && second.is_empty() {
            return Err(Error::new(match operation {
                Operation::Intersection => "expected clouds that meet, found nothing in both",
                _ => "expected something that stays, found the first cloud inside the second",
            }));
        }
        Ok(Self { first, second, turned, n_cut })
    }

    /// The new cloud.
    fn stage(
        &self,
        cloud: &CloudView<'_>,
        (first, second): (&Solid, &Solid),
        file: &PlyFile,
        job: &Job<'_>,
    ) -> Result<()> {
        job.progress(0.9, "writing columns");
        let [rows, file_rows] = [&self.first, &self.second]
            .map(|list| list.iter().map(|(i, _)| *i).collect::<Vec<_>>());
        let has_axes = cloud.floats(TANGENT_U, 3).is_some() && cloud.floats(TANGENT_V, 3).is_some();
        let was_cut = [cloud.column(CLIP).is_some(), file.values("clip_6").is_some()];
        let mut columns: Vec<(&str, u32, Column)> = Vec::new();
        let mut lacking = Vec::new();
        for column in &cloud.columns {
            job.check()?;
            if [CLIP, TANGENT_U, TANGENT_V].contains(&column.name) {
                continue;
            }
            let mut values = Column::rows(column, &rows);
            let turn = if self.turned { -1.0 } else { 1.0 };
            let vectors = |of: &dyn Fn(usize) -> DVec3| -> Vec<f64> {
                file_rows.iter().flat_map(|&i| of(i).to_array()).collect()
            };
            let numbers = match column.name {
                POSITION => vectors(&|i| second.surfels.places[i]),
                NORMAL => vectors(&|i| turn * second.surfels.normals[i]),
                RADIUS => file_rows.iter().map(|&i| second.surfels.radii[i]).collect(),
                _ => {
                    let (numbers, is_there) = rows_of_file(file, column, &file_rows);
                    if !is_there {
                        lacking.push(column.name);
                    }
                    numbers
                }
            };
            values.extend(numbers.into_iter());
            columns.push((column.name, column.components, values));
        }
        if has_axes || self.n_cut > 0 || file.tangents().is_some() {
            for (axis, name) in [TANGENT_U, TANGENT_V].into_iter().enumerate() {
                let own = rows.iter().map(|&i| first.tangents[i][axis]);
                let all = own.chain(file_rows.iter().map(|&i| second.tangents[i][axis]));
                let values = all.flat_map(|tangent| tangent.as_vec3().to_array()).collect();
                columns.push((name, 3, Column::F32(values)));
            }
        }
        if self.n_cut > 0 || was_cut.contains(&true) {
            columns.push((CLIP, 7, Column::F32(self.lines(cloud, file))));
        }
        job.check()?;
        let (n_first, n_second, n_cut) = (rows.len(), file_rows.len(), self.n_cut);
        let n = n_first + n_second;
        let mut said = format!(
            "{n} surfels, {n_first} of the first cloud and {n_second} of the second, {n_cut} cut \
             at the seam"
        );
        if !lacking.is_empty() {
            said += &format!("; the second has no {}", lacking.join(", "));
        }
        if !cloud.faces.is_empty() {
            said += &format!("; {} triangles are left out", cloud.faces.len());
        }
        job.progress(1.0, &said);
        let columns =
            columns.iter().map(|(name, components, column)| column.named(name, *components));
        job.edit(&Edit::NewCloud { origin: cloud.origin, columns: columns.collect() })
    }

    /// The lines that cut, with those that cut before.
    fn lines(&self, cloud: &CloudView<'_>, file: &PlyFile) -> Vec<f32> {
        let own = cloud.floats(CLIP, 7);
        let of_file: Option<Vec<Vec<f64>>> =
            (0..7).map(|i| file.values(&format!("{CLIP}_{i}"))).collect();
        let with = |new: [f32; 7], before: Option<[f32; 7]>| match before {
            Some(before) if cuts_nothing(&new) => before,
            Some(before) => cut_again(&before, new),
            None => new,
        };
        let first = self.first.iter().map(|&(i, new)| {
            let before = own.and_then(|own| own[7 * i..].first_chunk::<7>().copied());
            with(new, before)
        });
        let second = self.second.iter().map(|&(i, new)| {
            let row = |columns: &Vec<Vec<f64>>| std::array::from_fn(|c| columns[c][i] as f32);
            with(new, of_file.as_ref().map(row))
        });
        first.chain(second).flatten().collect()
    }
}
