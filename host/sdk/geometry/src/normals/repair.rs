//! Repair of single normals.

use super::{estimate_with, is_valid, normalised};
use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, map, part, report};
use glam::{DVec3, Vec3};

/// What [`repair`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repair {
    /// Normals replaced by the mean of valid ones nearby.
    pub n_from_neighbours: usize,
    /// Normals estimated from positions, since no valid one was near.
    pub n_estimated: usize,
}

impl Repair {
    /// All normals that were replaced.
    #[must_use]
    pub fn total(&self) -> usize {
        self.n_from_neighbours + self.n_estimated
    }
}

/// Rounds in which repaired normals serve their neighbours in turn. Each bridges one neighbourhood;
/// what is farther than this from every valid normal is estimated, so that the work stays linear.
const ROUNDS: usize = 8;

/// Replaces normals that are zero or not finite, leaving all others as they are bit by bit.
///
/// A replaced normal is the mean of the valid ones among the `k` nearest points, weighted by inverse
/// distance; where they cancel out or there are none, it is estimated as in [`super::estimate`].
/// `normals` beyond the number of positions are left alone.
///
/// # Errors
/// Where `progress` asks to stop; `normals` are then unchanged.
pub fn repair(
    neighbours: &Neighbours,
    normals: &mut [Vec3],
    k: usize,
    progress: Progress<'_>,
) -> Result<Repair, Cancelled> {
    let mut open: Vec<usize> = (0..normals.len().min(neighbours.len()))
        .filter(|&index| !is_valid(normals[index]))
        .collect();
    let mut done = Repair::default();
    if open.is_empty() {
        return Ok(done);
    }
    let mut repaired = normals.to_vec();
    let rounds = if open.len() == normals.len() { 0 } else { ROUNDS };
    for round in 0..rounds {
        let step = 0.5 / rounds as f64;
        let progress = part(progress, round as f64 * step..(round + 1) as f64 * step);
        let found = map(open.len(), &progress, |i| blend(neighbours, &repaired, open[i], k))?;
        let before = open.len();
        for (&index, normal) in open.iter().zip(&found) {
            repaired[index] = normal.unwrap_or(repaired[index]);
        }
        open.retain(|&index| !is_valid(repaired[index]));
        done.n_from_neighbours += before - open.len();
        if open.is_empty() || open.len() == before {
            break;
        }
    }
    if !open.is_empty() {
        let estimate = estimate_with(neighbours, k, &part(progress, 0.5..1.0))?;
        done.n_estimated = open.len();
        for index in open {
            repaired[index] = estimate.normals[index];
        }
    }
    report(progress, 1.0)?;
    normals.copy_from_slice(&repaired);
    Ok(done)
}

/// Length of a weighted mean of unit normals below which they cancel out: half of them would have
/// to lie at more than 150 degrees to the rest.
const CANCELLED: f64 = 0.25;

/// The weighted mean of the valid normals near a position.
fn blend(neighbours: &Neighbours, normals: &[Vec3], index: usize, k: usize) -> Option<Vec3> {
    let near = neighbours.nearest(index, k);
    let nearest = near.first()?.distance;
    let (sum, weights) = near
        .iter()
        .filter(|n| normals.get(n.index).is_some_and(|&normal| is_valid(normal)))
        .map(|n| (nearest / n.distance, normalised(normals[n.index]).as_dvec3()))
        .fold((DVec3::ZERO, 0.0), |(sum, weights), (w, n)| (sum + w * n, weights + w));
    let mean = sum / weights;
    (weights > 0.0 && mean.length() > CANCELLED).then(|| mean.normalize_or(DVec3::Z).as_vec3())
}
