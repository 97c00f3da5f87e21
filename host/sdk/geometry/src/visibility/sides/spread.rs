//! Signs of all points from those of the surfels.

use super::couplings::{NOISE, agreement};
use super::labels::Labels;
use crate::grid::Grid;
use crate::normals;
use crate::progress::{Cancelled, Progress, map, part};
use glam::{DVec3, Vec3};

/// Distance at which surfels say something of a point, in edges of the cubes: the surfel of a point's
/// own cube is within 1.74.
const REACH: f64 = 1.75;

/// What is found for a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) turn: bool,
    /// In [0, 1].
    pub(super) confidence: f32,
}

/// Whether each normal is to be turned; `None` where it has no direction or no position.
pub(super) fn to_all(
    labels: &Labels,
    positions: &[Vec3],
    cloud_normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<Option<Found>>, Cancelled> {
    let surfels = &labels.surfels;
    let mut found: Vec<Option<Found>> = vec![None; positions.len()];
    for &(index, surfel) in &surfels.members {
        let normal = normals::normalised(cloud_normals[index as usize]);
        let alike = normal.dot(surfels.all[surfel as usize].normal) >= 0.0;
        let confidence = labels.confidence[surfel as usize];
        let turn = alike != labels.signs[surfel as usize];
        found[index as usize] = Some(Found { turn, confidence });
    }
    if surfels.edge <= 0.0 {
        return Ok(found);
    }
    let places: Vec<DVec3> = surfels.all.iter().map(|surfel| surfel.position.as_dvec3()).collect();
    let reach = REACH * surfels.edge;
    let grid = Grid::build(&places, reach, &part(progress, 0.0..0.2))?;
    let others = map(positions.len(), &part(progress, 0.2..1.0), |index| {
        let normal = cloud_normals.get(index).copied().filter(|&n| normals::is_valid(n))?;
        if found[index].is_some() || !positions[index].is_finite() {
            return found[index];
        }
        let place = surfels.frame.inside(positions[index]);
        Some(vote(labels, &grid, reach, place, normals::normalised(normal)))
    })?;
    Ok(others)
}

/// What the surfels near a point say of it.
fn vote(labels: &Labels, grid: &Grid, reach: f64, place: Vec3, normal: Vec3) -> Found {
    let (mut sum, mut total, mut sure) = (0.0, 0.0, 0.0);
    grid.near(place.as_dvec3(), reach, |index, squared| {
        let surfel = &labels.surfels.all[index as usize];
        let (here, there) = ((place, normal), (surfel.position, surfel.normal));
        let agreement = agreement(here, there, NOISE * surfel.radius);
        // Those that coincide count for a few others.
        let weight = 1.0 / (0.1 + squared / (reach * reach));
        let sign = if labels.signs[index as usize] { 1.0 } else { -1.0 };
        sum += weight * sign * agreement * agreement.abs();
        sure += weight * f64::from(labels.confidence[index as usize]);
        total += weight;
    });
    let total = f64::max(total, f64::MIN_POSITIVE);
    let confidence = (sum.abs() / total).sqrt() * sure / total;
    Found { turn: sum < 0.0, confidence: confidence.min(1.0) as f32 }
}
