//! Choosing points that lie apart: Poisson discs and sample elimination.
//!
//! Distances are straight lines in space: on a sheet thinner than the distance, points on one side
//! keep those on the other away.

use crate::bounds::Bounds;
use crate::grid::Grid;
use crate::hashing;
use crate::progress::{Cancelled, Progress, each, flat_map, map, part, report, sort};
use glam::{DVec3, Vec3};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Keeps points that are at least `distance` apart, so many that every other one is closer than
/// that to one of them: one entry per position.
///
/// The points take turns in a random order that follows from `seed`, which makes the choice that of
/// dart throwing with the points as darts. Positions that are not finite are not kept; of those that
/// coincide one is. Where `distance` is not above 0 all finite positions are kept.
///
/// Source: Cook, "Stochastic sampling in computer graphics", 1986.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn apart(
    positions: &[Vec3],
    distance: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    apart_by(positions, distance, &in_turn(seed), progress)
}

/// A random order that follows from a seed.
fn in_turn(seed: u64) -> impl Fn(u32) -> u64 {
    move |index| hashing::bits(seed, u64::from(index))
}

/// The same in another order: of two points the one with the smaller `turn` takes its turn first.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn apart_by(
    positions: &[Vec3],
    distance: f64,
    turn: &dyn Fn(u32) -> u64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    report(progress, 0.0)?;
    if distance.is_nan() || distance <= 0.0 {
        report(progress, 1.0)?;
        return Ok(positions.iter().map(|position| position.is_finite()).collect());
    }
    // Beyond the diagonal one point keeps all others away.
    let extent = Bounds::of_positions(positions).map_or(0.0, |bounds| bounds.diagonal());
    let distance = distance.min(4.0 * extent).max(f64::MIN_POSITIVE);
    let points: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
    let mut kept = vec![false; points.len()];
    for index in thrown(&points, distance, turn, progress)? {
        kept[index as usize] = true;
    }
    Ok(kept)
}

/// The indices that [`apart`] keeps, in ascending order.
fn thrown(
    points: &[DVec3],
    distance: f64,
    turn: &dyn Fn(u32) -> u64,
    progress: Progress<'_>,
) -> Result<Vec<u32>, Cancelled> {
    let grid = Grid::build(points, distance, &part(progress, 0.0..0.4))?;
    let count = u32::try_from(points.len()).unwrap_or(u32::MAX);
    let keys = (0..count).map(|index| (turn(index), index)).collect();
    let mut turns = sort(keys, &part(progress, 0.4..0.6))?.into_iter().flatten();
    let mut open: Vec<bool> = points.iter().map(|point| point.is_finite()).collect();
    let mut kept = Vec::new();
    each(count as usize, &part(progress, 0.6..1.0), |_| {
        let Some((_, index)) = turns.next() else { return };
        if !open[index as usize] {
            return;
        }
        kept.push(index);
        let limit = distance * distance;
        grid.near(points[index as usize], distance, |other, squared| {
            // Exactly `distance` is far enough, but nothing is where the square of it underflows.
            if squared < limit || squared == 0.0 {
                open[other as usize] = false;
            }
        });
    })?;
    kept.sort_unstable();
    Ok(kept)
}

/// The largest distance that `count` points on a surface of this area can keep from each other: on
/// a plane, in the corners of equilateral triangles.
#[must_use]
pub fn largest_distance(area: f64, count: usize) -> f64 {
    (2.0 * area / (3f64.sqrt() * count.max(1) as f64)).sqrt()
}

/// Keeps `count` points that lie as evenly on a surface of this `area` as can be had: one entry
/// per position.
///
/// Points are removed one after the other, the most crowded first, until `count` are left. One of
/// each is kept where there are no more than `count` different finite positions. `area`, squared
/// units of the positions, sets the distance at which points begin to crowd each other; where it is
/// too large for the points that are there, it is halved until it fits, so that a wrong one costs
/// evenness but neither the number nor time without bound. `seed` decides between points that are
/// equally crowded.
///
/// Source: Yuksel, "Sample Elimination for Generating Poisson Disk Sample Sets", Eurographics 2015,
/// with its weights (alpha 8, beta 0.65, gamma 1.5). Ours: points closer than a third of the
/// crowding distance are thinned by [`apart`] first, which bounds how many there are around each.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn evenly(
    positions: &[Vec3],
    count: usize,
    area: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    let mut kept = vec![false; positions.len()];
    let points: Vec<DVec3> = positions.iter().map(|position| position.as_dvec3()).collect();
    let (candidates, crowding) =
        candidates(positions, &points, count, area, seed, &part(progress, 0.0..0.4))?;
    let chosen: Vec<DVec3> = candidates.iter().map(|&index| points[index as usize]).collect();
    let stays = eliminated(&chosen, count, crowding, seed, &part(progress, 0.4..1.0))?;
    for (index, stays) in candidates.iter().zip(stays) {
        kept[*index as usize] = stays;
    }
    Ok(kept)
}

/// Share of the crowding distance within which one point stands for all.
const TOO_CLOSE: f64 = 1.0 / 3.0;

/// Halvings of the area after which points count as being nowhere near each other.
const HALVINGS: u32 = 64;

/// At least `count` different points where there are as many, and the distance at which they begin
/// to crowd each other.
fn candidates(
    positions: &[Vec3],
    points: &[DVec3],
    count: usize,
    area: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<(Vec<u32>, f64), Cancelled> {
    let extent = Bounds::of_positions(positions).map_or(0.0, |bounds| bounds.diagonal());
    // Nothing is farther apart than this, whatever the area is said to be.
    let mut crowding = largest_distance(area, count).min(2.0 * extent);
    let distinct = distinct(positions, &part(progress, 0.0..0.3))?;
    if distinct.len() <= count || crowding <= 0.0 || !crowding.is_finite() {
        report(progress, 1.0)?;
        return Ok((distinct, crowding.max(0.0)));
    }
    let mut done = 0.3;
    for _ in 0..HALVINGS {
        let next = done + 0.5 * (1.0 - done);
        let found =
            thrown(points, TOO_CLOSE * crowding, &in_turn(seed), &part(progress, done..next))?;
        if found.len() >= count {
            report(progress, 1.0)?;
            return Ok((found, crowding));
        }
        crowding *= std::f64::consts::FRAC_1_SQRT_2;
        done = next;
    }
    report(progress, 1.0)?;
    Ok((distinct, crowding))
}

/// The first of each of the different finite positions, in ascending order.
fn distinct(positions: &[Vec3], progress: Progress<'_>) -> Result<Vec<u32>, Cancelled> {
    let keys = flat_map(positions.len(), &part(progress, 0.0..0.2), |index| {
        // Adding zero makes the two zeros one.
        let key = (positions[index] + Vec3::ZERO).to_array().map(f32::to_bits);
        let index = u32::try_from(index).ok().filter(|_| positions[index].is_finite());
        index.map(|index| (key, index)).into_iter()
    })?;
    let mut sorted: Vec<([u32; 3], u32)> =
        sort(keys, &part(progress, 0.2..1.0))?.into_iter().flatten().collect();
    sorted.dedup_by_key(|(key, _)| *key);
    let mut indices: Vec<u32> = sorted.into_iter().map(|(_, index)| index).collect();
    indices.sort_unstable();
    Ok(indices)
}

/// A point that may be eliminated, in the order of removal: the most crowded first.
#[derive(Clone, Copy, PartialEq)]
struct Elimination {
    weight: f64,
    turn: u64,
    index: u32,
}

impl Eq for Elimination {}

impl Ord for Elimination {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_weight = self.weight.total_cmp(&other.weight);
        by_weight.then(self.turn.cmp(&other.turn)).then(self.index.cmp(&other.index))
    }
}

impl PartialOrd for Elimination {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Whether each point stays when the most crowded ones are removed until `count` are left.
fn eliminated(
    points: &[DVec3],
    count: usize,
    crowding: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    let n = points.len();
    let mut stays = vec![true; n];
    if n <= count || crowding <= 0.0 {
        for (index, stays) in stays.iter_mut().enumerate() {
            *stays = index < count;
        }
        report(progress, 1.0)?;
        return Ok(stays);
    }
    let grid = Grid::build(points, crowding, &part(progress, 0.0..0.1))?;
    // Closer than this makes no difference, so that the first removals do not all go to where
    // points happen to lie close together.
    let least = crowding * (1.0 - (count as f64 / n as f64).powf(1.5)) * 0.65;
    let weight = |squared: f64| (1.0 - squared.sqrt().max(least) / crowding).max(0.0).powi(8);
    let mut weights = map(n, &part(progress, 0.1..0.4), |index| {
        let mut sum = 0.0;
        grid.near(points[index], crowding, |other, squared| {
            sum += if other as usize == index { 0.0 } else { weight(squared) };
        });
        sum
    })?;
    let turn = |index: u32| hashing::bits(seed, u64::from(index));
    let entry = |index: u32, weight: f64| Elimination { weight, turn: turn(index), index };
    let entries = (0..n as u32).map(|index| entry(index, weights[index as usize]));
    let mut heap: BinaryHeap<Elimination> = entries.collect();
    each(n - count, &part(progress, 0.4..1.0), |_| {
        while let Some(top) = heap.pop() {
            let index = top.index as usize;
            // Weights only fall, and an entry that is out of date goes back where it belongs.
            if top.weight.to_bits() != weights[index].to_bits() {
                heap.push(entry(top.index, weights[index]));
                continue;
            }
            stays[index] = false;
            grid.near(points[index], crowding, |other, squared| {
                let other = other as usize;
                if stays[other] {
                    weights[other] = (weights[other] - weight(squared)).max(0.0);
                }
            });
            break;
        }
    })?;
    Ok(stays)
}

#[cfg(test)]
mod tests;
