//! Signs of all points from those of the surfels.

use super::couplings::{NOISE, agreement};
use super::labels::Labels;
use crate::grid::{Cube, Grid};
use crate::normals;
use crate::progress::{Cancelled, Progress, flat_map, map_with, part, sort};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Distance at which surfels say something of a point, in edges of the cubes: the surfel of a point's
/// own cube is within 1.74.
const REACH: f64 = 1.75;

/// Points that follow at a time: what is kept of them meanwhile takes 40 bytes each.
pub(super) const BLOCK: usize = 1 << 20;

/// What is found for a point, packed, since there is one for each: the confidence in [0, 1], with the sign that the normal
/// is to get.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found(f32);

impl Found {
    const NOTHING: Self = Self(f32::NAN);

    fn new(turn: bool, confidence: f32) -> Self {
        Self(if turn { -confidence } else { confidence })
    }

    /// Whether there is something.
    pub(super) fn is_known(self) -> bool {
        !self.0.is_nan()
    }

    /// Whether the normal is to be turned.
    pub(super) fn turn(self) -> bool {
        self.is_known() && self.0.is_sign_negative()
    }

    /// 0 where nothing is known.
    pub(super) fn confidence(self) -> f32 {
        if self.is_known() { self.0.abs() } else { 0.0 }
    }
}

/// Whether each normal is to be turned; nothing where it has no direction or no position.
pub(super) fn to_all(
    labels: &Labels,
    positions: &[Vec3],
    cloud_normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<Found>, Cancelled> {
    let surfels = &labels.surfels;
    let mut found = vec![Found::NOTHING; positions.len()];
    for &(index, surfel) in &surfels.members {
        let normal = normals::normalised(cloud_normals[index as usize]);
        let alike = normal.dot(surfels.all[surfel as usize].normal) >= 0.0;
        let confidence = labels.confidence[surfel as usize];
        let turn = alike != labels.signs[surfel as usize];
        found[index as usize] = Found::new(turn, confidence);
    }
    if surfels.edge <= 0.0 {
        // The others are strays, or few of many have a direction.
        let n = found.len().min(cloud_normals.len());
        for index in 0..n {
            let is_valid = positions[index].is_finite() && normals::is_valid(cloud_normals[index]);
            if is_valid && !found[index].is_known() {
                found[index] = Found::new(false, 0.0);
            }
        }
        return Ok(found);
    }
    let places: Vec<DVec3> = surfels.all.iter().map(|surfel| surfel.position.as_dvec3()).collect();
    let reach = REACH * surfels.edge;
    let grid = Grid::build(&places, reach, &part(progress, 0.0..0.2))?;
    let n_blocks = positions.len().div_ceil(BLOCK);
    for block in 0..n_blocks {
        let share = |block: usize| 0.2 + 0.8 * block as f64 / n_blocks as f64;
        let indices = block * BLOCK..((block + 1) * BLOCK).min(positions.len());
        let others = Others { labels, grid: &grid, reach, positions, normals: cloud_normals };
        others.follow(indices, &mut found, &part(progress, share(block)..share(block + 1)))?;
    }
    Ok(found)
}

/// Points that do not decide.
struct Others<'a> {
    labels: &'a Labels,
    grid: &'a Grid,
    reach: f64,
    positions: &'a [Vec3],
    normals: &'a [Vec3],
}

impl Others<'_> {
    /// Lets those of a range that have no side yet follow the surfels around. Points of one cube ask the same ones.
    fn follow(
        &self,
        range: Range<usize>,
        found: &mut [Found],
        progress: Progress<'_>,
    ) -> Result<(), Cancelled> {
        let Self { labels, grid, reach, positions, normals } = self;
        let follows = |index: usize| {
            let has_normal = normals.get(index).is_some_and(|&normal| normals::is_valid(normal));
            has_normal && !found[index].is_known() && positions[index].is_finite()
        };
        let place_of = |index: u32| labels.surfels.frame.inside(positions[index as usize]);
        let keys = flat_map(range.len(), &part(progress, 0.0..0.1), |i| {
            let index = u32::try_from(range.start + i).ok();
            let index = index.filter(|&index| follows(index as usize));
            index.map(|index| (grid.cube_of(place_of(index).as_dvec3()), index)).into_iter()
        })?;
        let sorted = sort(keys, &part(progress, 0.1..0.4))?;
        let sorted: Vec<(Cube, u32)> = sorted.into_iter().flatten().collect();
        let groups: Vec<&[(Cube, u32)]> = sorted.chunk_by(|a, b| a.0 == b.0).collect();
        let asked = map_with(groups.len(), &part(progress, 0.4..1.0), Vec::new, |near, group| {
            near.clear();
            if let Some((cube, _)) = groups[group].first() {
                grid.around(*cube, |index, place| near.push((index, place)));
            }
            let found = |&(_, index): &(Cube, u32)| {
                let normal = normals::normalised(normals[index as usize]);
                vote(labels, near, *reach, place_of(index), normal)
            };
            groups[group].iter().map(found).collect::<Vec<Found>>()
        })?;
        for ((_, index), of_point) in sorted.iter().zip(asked.into_iter().flatten()) {
            found[*index as usize] = of_point;
        }
        Ok(())
    }
}

/// What the surfels near a point say of it.
fn vote(labels: &Labels, near: &[(u32, DVec3)], reach: f64, place: Vec3, normal: Vec3) -> Found {
    let (mut sum, mut total, mut sure) = (0.0, 0.0, 0.0);
    for &(index, other) in near {
        let squared = other.distance_squared(place.as_dvec3());
        if squared > reach * reach {
            continue;
        }
        let surfel = &labels.surfels.all[index as usize];
        let (here, there) = ((place, normal), (surfel.position, surfel.normal));
        let agreement = agreement(here, there, NOISE * surfel.radius);
        // Those that coincide count for a few others.
        let weight = 1.0 / (0.1 + squared / (reach * reach));
        let sign = if labels.signs[index as usize] { 1.0 } else { -1.0 };
        sum += weight * sign * agreement * agreement.abs();
        sure += weight * f64::from(labels.confidence[index as usize]);
        total += weight;
    }
    let total = f64::max(total, f64::MIN_POSITIVE);
    let confidence = (sum.abs() / total).sqrt() * sure / total;
    // What is no number decides nothing.
    Found::new(sum < 0.0, if confidence > 0.0 { confidence.min(1.0) as f32 } else { 0.0 })
}
