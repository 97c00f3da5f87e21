//! Normals, radii and tangents.

use super::position::Positions;
use super::side_guide::SideGuide;
use super::sides::Scanners;
use super::vectors::{flat, take_vectors};
use super::{mesh, sides};
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::source::Source;
use crate::error::ReadFault;
use crate::options::ReadOptions;
use crate::summary::Summary;
use crate::table::{NORMALS, RADII, Table};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use surfelshop_api::columns::{NORMAL_FIELD, PLANARITY, TANGENT_U, TANGENT_V};
use surfelshop_geometry::{Cancelled, Neighbours, Progress, normals, part, radii};

pub(super) struct Shape {
    pub(super) normals: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
    /// Tangents, and planarity where some of the cloud is no surface.
    pub(super) others: Vec<Column>,
}

/// Squared length by which a normal may differ from 1 and keep its bits, so that files survive
/// round trips: twice the error of components with four decimals, which text files have.
pub(super) const UNIT_TOLERANCE: f64 = 1e-4;

/// From where on, of the work on normals, those of no surface become soft.
const SOFTENING: f64 = 0.98;

/// Points between two questions whether to stop.
const BLOCK: usize = 4096;

/// Takes normals, radii and tangents out of the table and makes what is missing.
pub(super) fn take(
    table: &mut Table,
    placed: &Positions,
    (source, guide): (&Source, Option<&SideGuide>),
    options: &ReadOptions<'_>,
    summary: &mut Summary,
) -> Result<Shape, ReadFault> {
    let FileShape { normals: mut given_normals, radii: given_radii, of_triangles } =
        file_shape(table, placed, options);
    let given_tangents = take_tangents(table);
    let needs_radii =
        given_radii.as_ref().is_none_or(|radii| !radii.iter().all(|&radius| usable(radius)));
    // To estimate takes a hundred times as long as to look at what is given.
    let look = if needs_radii { 0.01 } else { 0.99 };
    let looked = match &mut given_normals {
        Some(found) => look * normalise(found, &part(options.progress, 0.0..look), summary)?,
        None => 0.0,
    };
    let needs_normals = given_normals.is_none() || summary.normals.repaired > 0;
    report(options.progress, looked)?;
    let [searching, orienting, covering] =
        shares(looked, needs_normals || needs_radii, needs_radii);
    let searching = part(options.progress, searching);
    let mut search =
        Search { positions: &placed.positions, progress: &searching, neighbours: None };
    let progress = part(options.progress, orienting);
    let are_estimated = given_normals.is_none();
    let scanners = if are_estimated { Scanners::of(table, placed, source) } else { None };
    let looks_around =
        are_estimated && !table.is_part && sides::looks_around(table, scanners.as_ref(), summary);
    // About half of the time goes into which side a plane faces.
    let fitted = if looks_around { 0.5 } else { SOFTENING };
    let [fitting, turning] = [part(&progress, 0.0..fitted), part(&progress, fitted..SOFTENING)];
    let (mut normals, planarity) = finish_normals(
        given_normals,
        &mut search,
        options.n_neighbours,
        needs_radii,
        &fitting,
        summary,
    )?;
    if are_estimated {
        let seen = if looks_around {
            sides::face_what_is_seen(placed, source, &mut normals, &turning, summary)?
        } else {
            guide.map_or_else(Vec::new, |guide| guide.face(placed, &mut normals, summary))
        };
        normals::soften(
            search.neighbours()?,
            &mut normals,
            &planarity,
            &part(&progress, SOFTENING..1.0),
        )?;
        // What is known of a side counts last, for soft normals too.
        if let Some(scanners) = &scanners {
            sides::face_scanners(table, placed, scanners, &planarity, &seen, &mut normals, summary);
        }
    }
    let progress = part(options.progress, covering);
    let estimates = if needs_radii {
        radii::estimate_with(search.neighbours()?, &normals, &planarity, &progress)?
    } else {
        Vec::new()
    };
    // Few splats may be larger than the box of their centres: one can stand for a whole wall. What has
    // fields of normals was made to be so.
    let are_splats = table.names().any(|name| name.starts_with(NORMAL_FIELD));
    let diagonal = match placed.bounds {
        Some(bounds) if !are_splats => bounds.diagonal(),
        _ => 0.0,
    };
    let radii = finish_radii(given_radii, estimates, diagonal, summary);
    of_triangles.count(summary);
    let mut others = given_tangents
        .map(|[u, v]| finish_tangents([u, v], &normals, &radii, diagonal, summary))
        .unwrap_or_default();
    let n_scattered = planarity.par_iter().filter(|planarity| **planarity < radii::PLANAR).count();
    summary.normals.scattered = n_scattered as u64;
    if n_scattered > 0 && others.is_empty() && !table.names().any(|name| name == PLANARITY) {
        others.push(Column::new(PLANARITY, 1, Buffer::F32(planarity)));
    }
    Ok(Shape { normals, radii, others })
}

/// What a file says of the shape of its surface.
struct FileShape {
    normals: Option<Vec<Vec3>>,
    radii: Option<Vec<f32>>,
    of_triangles: FromTriangles,
}

/// What follows from triangles where the file does not say it.
struct FromTriangles {
    normals: bool,
    radii: bool,
}

impl FromTriangles {
    /// Gives what was counted as if it were of the file its right name.
    fn count(&self, summary: &mut Summary) {
        let (normals, radii) = (&mut summary.normals, &mut summary.radii);
        if self.normals {
            normals.from_triangles = normals.given + normals.normalised;
            normals.estimated = normals.repaired;
            (normals.given, normals.normalised, normals.repaired) = (0, 0, 0);
        }
        if self.radii {
            radii.from_triangles = std::mem::take(&mut radii.given);
        }
    }
}

/// Takes normals and radii out of the table, or from its triangles: they say more of a surface than
/// points nearby, which may lie on another sheet of it.
fn file_shape(table: &mut Table, placed: &Positions, options: &ReadOptions<'_>) -> FileShape {
    let positions = &placed.positions;
    let normals = NORMALS.iter().find_map(|names| take_vectors(table, *names));
    // Some programs write zeros for normals that they do not have.
    let normals = normals.filter(|given| given.iter().any(|&normal| normals::is_valid(normal)));
    let radii = table.take_any(&RADII).map(|[radius]| radius.into_f32());
    let radii = radii.filter(|radii| radii.iter().any(|&radius| usable(radius)));
    let chosen = options.radius.filter(|&radius| usable(radius));
    let radii = radii.or_else(|| Some(vec![chosen?; positions.len()]));
    let (has_normals, has_radii) = (normals.is_some(), radii.is_some());
    let normals = normals.or_else(|| mesh::normals(table, positions));
    let radii = radii.or_else(|| mesh::radii(table, positions, normals.as_deref()));
    let of_triangles = FromTriangles {
        normals: !has_normals && normals.is_some(),
        radii: !has_radii && radii.is_some(),
    };
    FileShape { normals, radii, of_triangles }
}

/// The shares of the work, from `done` on, of building the search structure, of normals and of
/// radii: about what they take on four cores. What is not needed has none.
fn shares(done: f64, needs_normals: bool, needs_radii: bool) -> [Range<f64>; 3] {
    let needed = |weight: f64, needed: bool| if needed { weight } else { 0.0 };
    let weights = [
        needed(0.1, needs_normals || needs_radii),
        needed(1.0, needs_normals),
        needed(1.0, needs_radii),
    ];
    let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut end = done;
    weights.map(|weight| {
        let start = end;
        end = (start + (1.0 - done) * weight / total).min(1.0);
        start..end
    })
}

/// The search structure, built when it is first needed.
struct Search<'a> {
    positions: &'a [Vec3],
    progress: Progress<'a>,
    neighbours: Option<Neighbours>,
}

impl Search<'_> {
    fn neighbours(&mut self) -> Result<&Neighbours, Cancelled> {
        match &mut self.neighbours {
            Some(neighbours) => Ok(neighbours),
            none => Ok(none.insert(Neighbours::build(self.positions, self.progress)?)),
        }
    }
}

/// Gives normals unit length and counts those that have to be repaired, which are left alone; ones
/// that have unit length are kept bit by bit. The progress reported: from the first normal
/// that has to be repaired on, nearly all of the work is still to come.
fn normalise(
    normals: &mut [Vec3],
    progress: Progress<'_>,
    summary: &mut Summary,
) -> Result<f64, ReadFault> {
    let counts = &mut summary.normals;
    let is_unit =
        |normal: &Vec3| (normal.as_dvec3().length_squared() - 1.0).abs() <= UNIT_TOLERANCE;
    let n_blocks = normals.len().div_ceil(BLOCK);
    let mut reported = 0.0;
    for (i, block) in normals.chunks_mut(BLOCK).enumerate() {
        if counts.repaired == 0 {
            reported = i as f64 / n_blocks as f64;
        }
        report(progress, reported)?;
        let n_units: u64 = block.iter().map(|normal| u64::from(is_unit(normal))).sum();
        counts.given += n_units;
        if n_units == block.len() as u64 {
            continue;
        }
        for normal in block.iter_mut().filter(|normal| !is_unit(normal)) {
            if normals::is_valid(*normal) {
                *normal = normals::normalised(*normal);
                counts.normalised += 1;
            } else {
                counts.repaired += 1;
            }
        }
    }
    Ok(if counts.repaired == 0 { 1.0 } else { reported })
}

/// Normals that are estimated where none are given, and repaired where some have no direction; and how flat the
/// surroundings of points are, where normals or radii are estimated.
fn finish_normals(
    given: Option<Vec<Vec3>>,
    search: &mut Search<'_>,
    k: usize,
    needs_radii: bool,
    progress: Progress<'_>,
    summary: &mut Summary,
) -> Result<(Vec<Vec3>, Vec<f32>), ReadFault> {
    let counts = &mut summary.normals;
    let Some(mut found) = given else {
        let estimate = normals::estimate_with(search.neighbours()?, k, progress)?;
        counts.estimated = estimate.normals.len() as u64;
        counts.degenerate = estimate.n_degenerate as u64;
        summary.normal_error_deg = median(estimate.errors).map(f32::to_degrees);
        return Ok((estimate.normals, estimate.planarity));
    };
    let repairing = if needs_radii { 0.5 } else { 1.0 };
    if counts.repaired > 0 {
        let progress = part(progress, 0.0..repairing);
        normals::repair(search.neighbours()?, &mut found, k, &progress)?;
    }
    let planarity = match needs_radii {
        true => normals::planarity(search.neighbours()?, k, &part(progress, repairing..1.0))?,
        false => Vec::new(),
    };
    Ok((found, planarity))
}

/// The middle one of numbers that are not NaN; `None` where there are none.
fn median(mut values: Vec<f32>) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Reports progress; a request to stop becomes an error.
pub(super) fn report(progress: Progress<'_>, fraction: f64) -> Result<(), ReadFault> {
    if progress(fraction).is_break() { Err(ReadFault::Cancelled) } else { Ok(()) }
}

/// Whether a radius can be drawn.
fn usable(radius: f32) -> bool {
    radius.is_finite() && radius > 0.0
}

/// Radii that are positive, finite and no larger than the cloud (its `diagonal`, where above 0); there are no estimates where all
/// given ones can be drawn.
fn finish_radii(
    given: Option<Vec<f32>>,
    estimates: Vec<f32>,
    diagonal: f64,
    summary: &mut Summary,
) -> Vec<f32> {
    let counts = &mut summary.radii;
    let Some(mut found) = given else {
        counts.estimated = estimates.len() as u64;
        return estimates;
    };
    let diagonal = diagonal.min(f64::from(f32::MAX)) as f32;
    for (radius, estimate) in found.iter_mut().zip(estimates) {
        if !usable(*radius) {
            *radius = estimate;
            counts.estimated += 1;
        }
    }
    // A cloud of one place has no size to compare with.
    if diagonal > 0.0 {
        for radius in found.iter_mut().filter(|radius| **radius > diagonal) {
            *radius = diagonal;
            counts.clamped += 1;
        }
    }
    counts.given = found.len() as u64 - counts.estimated - counts.clamped;
    found
}

/// Both tangents; one alone stays a foreign column.
pub(super) fn take_tangents(table: &mut Table) -> Option<[Vec<Vec3>; 2]> {
    let names = [
        ["tangent_u_x", "tangent_u_y", "tangent_u_z"],
        ["tangent_v_x", "tangent_v_y", "tangent_v_z"],
    ];
    let has = |name: &str| table.names().any(|own| own.eq_ignore_ascii_case(name));
    if !names.as_flattened().iter().all(|name| has(name)) {
        return None;
    }
    let [u, v] = names.map(|names| take_vectors(table, names));
    Some([u?, v?])
}

/// Tangent columns; pairs that span no ellipse become the circle of the radius.
fn finish_tangents(
    [mut u, mut v]: [Vec<Vec3>; 2],
    normals: &[Vec3],
    radii: &[f32],
    diagonal: f64,
    summary: &mut Summary,
) -> Vec<Column> {
    let (mut replaced, mut shortened) = (0u64, 0u64);
    for (((u, v), normal), radius) in u.iter_mut().zip(&mut v).zip(normals).zip(radii) {
        if !(normals::is_valid(*u) && normals::is_valid(*v)) {
            let (first, second) = normal.any_orthonormal_pair();
            (*u, *v) = (first * *radius, second * *radius);
            replaced += 1;
        }
        for tangent in [u, v] {
            // As for radii; squares of what a file may hold overflow in f32.
            let length = tangent.as_dvec3().length();
            if diagonal > 0.0 && length > diagonal {
                *tangent = (tangent.as_dvec3() * (diagonal / length)).as_vec3();
                shortened += 1;
            }
        }
    }
    if shortened > 0 {
        summary.warnings.push(format!(
            "{shortened} tangents were longer than the cloud and became as long as its diagonal"
        ));
    }
    if replaced > 0 {
        summary.warnings.push(format!(
            "{replaced} tangents were zero or not finite and became circles of the radius"
        ));
    }
    tangent_columns(u, v)
}

pub(super) fn tangent_columns(u: Vec<Vec3>, v: Vec<Vec3>) -> Vec<Column> {
    vec![Column::new(TANGENT_U, 3, flat(u)), Column::new(TANGENT_V, 3, flat(v))]
}
