//! Normals, radii and tangents.

use super::{flat, vectors};
use crate::buffer::Buffer;
use crate::column::Column;
use crate::error::ReadFault;
use crate::read::ReadOptions;
use crate::summary::Summary;
use crate::table::Table;
use glam::Vec3;
use surfelshop_api::columns::{TANGENT_U, TANGENT_V};
use surfelshop_geometry::{Bounds, Neighbours, Progress, normals, part, radii};

pub(super) struct Shape {
    pub(super) normals: Vec<Vec3>,
    pub(super) radii: Vec<f32>,
    pub(super) tangents: Vec<Column>,
}

/// Squared length by which a normal may differ from 1 and keep its bits, so that files survive
/// round trips: twice the error of components with four decimals, which text files have.
const UNIT_TOLERANCE: f64 = 1e-4;

const NORMAL_NAMES: [[&str; 3]; 3] =
    [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"], ["normalx", "normaly", "normalz"]];

/// Takes normals, radii and tangents out of the table and makes what is missing.
pub(super) fn take(
    table: &mut Table,
    positions: &[Vec3],
    options: &ReadOptions<'_>,
    summary: &mut Summary,
) -> Result<Shape, ReadFault> {
    let given_normals = table.take_any(&NORMAL_NAMES).map(|parts| vectors(&parts));
    let given_radii = table.take_any(&[["radius"], ["scalar_radius"]]);
    let given_tangents = tangent_parts(table);
    let mut search = Search { positions, neighbours: None };
    let progress = part(options.progress, 0.0..0.6);
    let normals =
        finish_normals(given_normals, &mut search, options.n_neighbours, &progress, summary)?;
    let progress = part(options.progress, 0.6..1.0);
    let radii = given_radii.map(|[radius]| radius.to_f32());
    let radii = finish_radii(radii, &mut search, &normals, &progress, summary)?;
    let tangents = given_tangents
        .map(|[u, v]| finish_tangents(u, v, &normals, &radii, summary))
        .unwrap_or_default();
    Ok(Shape { normals, radii, tangents })
}

/// The search structure, built when it is first needed.
struct Search<'a> {
    positions: &'a [Vec3],
    neighbours: Option<Neighbours>,
}

impl Search<'_> {
    fn neighbours(&mut self) -> &Neighbours {
        self.neighbours.get_or_insert_with(|| Neighbours::new(self.positions))
    }
}

/// Normals of unit length; given ones are kept bit by bit where they have it.
fn finish_normals(
    given: Option<Vec<Vec3>>,
    search: &mut Search<'_>,
    k: usize,
    progress: Progress<'_>,
    summary: &mut Summary,
) -> Result<Vec<Vec3>, ReadFault> {
    let counts = &mut summary.normals;
    // Some programs write zeros for normals that they do not have.
    let given = given.filter(|given| given.iter().any(|&normal| normals::is_valid(normal)));
    let Some(mut found) = given else {
        let estimate = normals::estimate_with(search.neighbours(), k, progress)?;
        counts.estimated = estimate.normals.len() as u64;
        counts.degenerate = estimate.n_degenerate as u64;
        return Ok(estimate.normals);
    };
    for normal in &mut found {
        let squared = normal.as_dvec3().length_squared();
        if (squared - 1.0).abs() <= UNIT_TOLERANCE {
            counts.given += 1;
        } else if normals::is_valid(*normal) {
            *normal = normals::normalised(*normal);
            counts.normalised += 1;
        } else {
            counts.repaired += 1;
        }
    }
    if counts.repaired > 0 {
        normals::repair(search.neighbours(), &mut found, k, progress)?;
    }
    Ok(found)
}

/// Radii that are positive, finite and no larger than the cloud.
fn finish_radii(
    given: Option<Vec<f32>>,
    search: &mut Search<'_>,
    normals: &[Vec3],
    progress: Progress<'_>,
    summary: &mut Summary,
) -> Result<Vec<f32>, ReadFault> {
    let counts = &mut summary.radii;
    let usable = |radius: f32| radius.is_finite() && radius > 0.0;
    let Some(mut found) = given.filter(|radii| radii.iter().any(|&radius| usable(radius))) else {
        counts.estimated = normals.len() as u64;
        return Ok(radii::estimate_with(search.neighbours(), normals, progress)?);
    };
    let diagonal = Bounds::of_positions(search.positions).map_or(0.0, |bounds| bounds.diagonal());
    let diagonal = diagonal.min(f64::from(f32::MAX)) as f32;
    if !found.iter().all(|&radius| usable(radius)) {
        let estimates = radii::estimate_with(search.neighbours(), normals, progress)?;
        for (radius, estimate) in found.iter_mut().zip(estimates) {
            if !usable(*radius) {
                *radius = estimate;
                counts.estimated += 1;
            }
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
    Ok(found)
}

/// Both tangents; one alone stays a foreign column.
fn tangent_parts(table: &mut Table) -> Option<[Vec<Vec3>; 2]> {
    let parts = table.take([
        "tangent_u_x",
        "tangent_u_y",
        "tangent_u_z",
        "tangent_v_x",
        "tangent_v_y",
        "tangent_v_z",
    ])?;
    let [ux, uy, uz, vx, vy, vz] = parts;
    Some([vectors(&[ux, uy, uz]), vectors(&[vx, vy, vz])])
}

/// Tangent columns; pairs that span no ellipse become the circle of the radius.
fn finish_tangents(
    mut u: Vec<Vec3>,
    mut v: Vec<Vec3>,
    normals: &[Vec3],
    radii: &[f32],
    summary: &mut Summary,
) -> Vec<Column> {
    let mut replaced = 0u64;
    for (((u, v), normal), radius) in u.iter_mut().zip(&mut v).zip(normals).zip(radii) {
        if !(normals::is_valid(*u) && normals::is_valid(*v)) {
            let (first, second) = normal.any_orthonormal_pair();
            (*u, *v) = (first * *radius, second * *radius);
            replaced += 1;
        }
    }
    if replaced > 0 {
        summary.warnings.push(format!(
            "{replaced} tangents were zero or not finite and became circles of the radius"
        ));
    }
    let column = |name: &str, values: &[Vec3]| -> Column {
        let buffer: Buffer = flat(values);
        Column::new(name, 3, buffer)
    };
    vec![column(TANGENT_U, &u), column(TANGENT_V, &v)]
}
