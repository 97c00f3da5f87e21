//! Rounds of pairing surfels with the nearest of another cloud and moving them onto the planes of these.

use crate::search::Search;
use crate::surfels::Surfels;
use std::ops::Range;
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::prelude::*;

/// A rigid motion: turned first, then moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    pub(crate) turn: DQuat,
    pub(crate) translation: DVec3,
}

impl Default for Motion {
    fn default() -> Self {
        Self { turn: DQuat::IDENTITY, translation: DVec3::ZERO }
    }
}

/// The cloud that stays.
pub(crate) struct Target<'a> {
    pub(crate) surfels: &'a Surfels,
    pub(crate) search: &'a Search,
    /// How far its surfels are apart.
    pub(crate) spacing: f64,
}

/// How a fit ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit {
    pub(crate) motion: Motion,
    /// Root mean square of the pairs' distances from planes.
    pub(crate) residual: f64,
    pub(crate) n_pairs: usize,
    pub(crate) rounds: usize,
    /// Whether the last round moved nothing any more.
    pub(crate) settled: bool,
}

/// Cosine of the angle between normals up to which surfels make a pair.
const FACING: f64 = 0.5;

/// Nearest surfels among which a partner that faces the same way is looked for.
const COMPARED: usize = 4;

/// Share of a spacing below which a round is the last.
const SETTLED: f64 = 1e-3;

/// A surfel and its partner.
#[derive(Clone, Copy)]
struct Pair {
    squared: f64,
    place: DVec3,
    partner: DVec3,
    normal: DVec3,
}

/// Fits some surfels to a cloud.
///
/// # Errors
/// Where the job is to stop.
pub(crate) fn rounds(
    surfels: &Surfels,
    chosen: &[u32],
    target: &Target<'_>,
    start: Motion,
    (overlap, most): (f64, u32),
    job: &Job<'_>,
    share: Range<f64>,
) -> Result<Fit> {
    let mut motion = start;
    let width = (share.end - share.start) / f64::from(most.max(1));
    let mut fit = Fit { motion, residual: f64::INFINITY, n_pairs: 0, rounds: 0, settled: false };
    for round in 0..most.max(1) {
        let from = share.start + width * f64::from(round);
        let pairs = paired(surfels, chosen, target, motion, overlap, job, from..from + width)?;
        fit.n_pairs = pairs.len();
        fit.motion = motion;
        fit.residual = residual(&pairs);
        if pairs.len() < 6 || fit.settled {
            // No plane says anything of a motion, or this was to measure where the last one led.
            return Ok(fit);
        }
        let (next, moved) = step(&pairs, motion);
        motion = next;
        fit.rounds = round as usize + 1;
        fit.settled = moved < SETTLED * target.spacing;
    }
    let pairs = paired(surfels, chosen, target, motion, overlap, job, share.end..share.end)?;
    let (residual, n_pairs) = (residual(&pairs), pairs.len());
    Ok(Fit { motion, residual, n_pairs, ..fit })
}

fn paired(
    surfels: &Surfels,
    chosen: &[u32],
    target: &Target<'_>,
    motion: Motion,
    overlap: f64,
    job: &Job<'_>,
    share: Range<f64>,
) -> Result<Vec<Pair>> {
    let pairs = job.map(chosen.len(), share, |i| {
        let i = chosen[i] as usize;
        let place = motion.turn * surfels.places[i] + motion.translation;
        let facing = motion.turn * surfels.normals[i];
        let near = target.search.nearest(place, COMPARED, f64::INFINITY);
        let fits = near.into_iter().find_map(|found| {
            let j = found.index as usize;
            let normal = target.surfels.normals[j];
            let is_pair = normal.dot(facing) > FACING;
            let partner = target.surfels.places[j];
            is_pair.then_some(Pair { squared: found.squared, place, partner, normal })
        });
        fits.filter(|pair| pair.squared.is_finite())
    })?;
    let mut pairs: Vec<Pair> = pairs.into_iter().flatten().collect();
    let room = (overlap * chosen.len() as f64).ceil() as usize;
    if pairs.len() > room.max(1) {
        let mut distances: Vec<f64> = pairs.iter().map(|pair| pair.squared).collect();
        let (_, most, _) = distances.select_nth_unstable_by(room.max(1) - 1, f64::total_cmp);
        let most = *most;
        pairs.retain(|pair| pair.squared <= most);
    }
    Ok(pairs)
}

fn residual(pairs: &[Pair]) -> f64 {
    let off = |pair: &Pair| (pair.place - pair.partner).dot(pair.normal).powi(2);
    (pairs.iter().map(off).sum::<f64>() / pairs.len().max(1) as f64).sqrt()
}

/// The motion after a round, and how far it moves what it moves most.
fn step(pairs: &[Pair], motion: Motion) -> (Motion, f64) {
    // Turns are about the middle and lengths in shares of the size, so that the numbers are alike.
    let n = pairs.len() as f64;
    let middle = pairs.iter().map(|pair| pair.place).sum::<DVec3>() / n;
    let size = pairs.iter().map(|pair| pair.place.distance(middle)).fold(0.0, f64::max);
    if size <= 0.0 {
        return (motion, 0.0);
    }
    let (mut matrix, mut right) = ([[0.0; 6]; 6], [0.0; 6]);
    for pair in pairs {
        let arm = ((pair.place - middle) / size).cross(pair.normal);
        let row = [arm.x, arm.y, arm.z, pair.normal.x, pair.normal.y, pair.normal.z];
        let off = (pair.partner - pair.place).dot(pair.normal) / size;
        for i in 0..6 {
            right[i] += row[i] * off;
            for j in 0..6 {
                matrix[i][j] += row[i] * row[j];
            }
        }
    }
    // Motions that no plane says anything of, such as sliding, are left at nothing.
    let trace: f64 = (0..6).map(|i| matrix[i][i]).sum();
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += 1e-9 * trace;
    }
    let Some([x, y, z, u, v, w]) = solved(matrix, right) else { return (motion, 0.0) };
    let (arc, shift) = (DVec3::new(x, y, z), size * DVec3::new(u, v, w));
    let turn = DQuat::from_scaled_axis(arc);
    let translation = turn * (motion.translation - middle) + middle + shift;
    let next = Motion { turn: (turn * motion.turn).normalize(), translation };
    (next, shift.length() + size * arc.length())
}

/// The solution of a symmetric positive definite system, by Cholesky's method; `None` where it is none.
fn solved(mut m: [[f64; 6]; 6], mut x: [f64; 6]) -> Option<[f64; 6]> {
    for i in 0..6 {
        for j in 0..=i {
            let sum = m[i][j] - (0..j).map(|k| m[i][k] * m[j][k]).sum::<f64>();
            m[i][j] = if i == j {
                if sum <= 0.0 || !sum.is_finite() {
                    return None;
                }
                sum.sqrt()
            } else {
                sum / m[j][j]
            };
        }
        x[i] = (x[i] - (0..i).map(|k| m[i][k] * x[k]).sum::<f64>()) / m[i][i];
    }
    for i in (0..6).rev() {
        x[i] = (x[i] - (i + 1..6).map(|k| m[k][i] * x[k]).sum::<f64>()) / m[i][i];
    }
    Some(x)
}
