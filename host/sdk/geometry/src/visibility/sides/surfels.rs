//! The surfels that decide for a cloud: all of a small one, one per cube of a large one.

use crate::discs::{Disc, Discs};
use crate::neighbours::Neighbours;
use crate::normals;
use crate::progress::{Cancelled, Progress, map, part, sort};
use crate::thinning::one_per_cube;
use crate::Bounds;
use glam::{DVec3, Vec3};

/// Up to so many points all decide; of more, a quarter does, but no fewer than this. Measured: the
/// search for neighbours and the rays cost 12 us of one processor each.
const ALL: usize = 250_000;

/// Neighbours of a surfel.
pub(super) const LINKS: usize = 10;

/// The neighbour whose distance is the radius of a disc: of points that lie at random with one per
/// square, the disc has an area of 7, so that a point of the surface is covered with 1 - exp(-7).
const COVERING: usize = 7;

/// No neighbour.
pub(super) const NOBODY: u32 = u32::MAX;

/// What a surfel is for the choice of sides, in a box of unit size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surfel {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// About 1.5 spacings; 0 for a lone point.
    pub(super) radius: f32,
    /// Nearest others, nearest first; `NOBODY` where there are fewer.
    pub(super) links: [u32; LINKS],
}

impl Surfel {
    /// Neighbours that exist.
    pub(super) fn linked(&self) -> impl Iterator<Item = u32> + '_ {
        self.links.iter().copied().filter(|&other| other != NOBODY)
    }
}

/// Surfels with the search for what is near them.
pub(super) struct Surfels {
    pub(super) surfels: Vec<Surfel>,
    /// For each surfel the index of its position in the cloud.
    pub(super) index: Vec<u32>,
}

impl Surfels {
    /// Chooses and measures surfels among the positions that are finite and have a direction.
    pub(super) fn choose(
        positions: &[Vec3],
        cloud_normals: &[Vec3],
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let kept = chosen(positions, cloud_normals, &part(progress, 0.0..0.2))?;
        let points: Vec<Vec3> = kept.iter().map(|&index| positions[index as usize]).collect();
        let neighbours = Neighbours::build(&points, &part(progress, 0.2..0.4))?;
        let index: Vec<u32> =
            neighbours.first().iter().map(|&first| kept[first as usize]).collect();
        let surfels = map(index.len(), &part(progress, 0.4..1.0), |place| {
            let near = neighbours.around(place, LINKS);
            let mut links = [NOBODY; LINKS];
            for (link, &(other, _)) in links.iter_mut().zip(&near) {
                *link = other;
            }
            let covering = near.get(COVERING - 1).or(near.last());
            Surfel {
                position: neighbours.distinct()[place].as_vec3(),
                normal: normals::normalised(cloud_normals[index[place] as usize]),
                radius: covering.map_or(0.0, |&(_, distance)| distance as f32),
                links,
            }
        })?;
        Ok(Self { surfels, index })
    }

    /// The discs of the surfels, to trace rays at.
    pub(super) fn discs(&self, progress: Progress<'_>) -> Result<Discs, Cancelled> {
        let disc = |surfel: &Surfel| Disc {
            centre: surfel.position,
            normal: surfel.normal,
            radius: surfel.radius,
        };
        let discs: Vec<Disc> = self.surfels.iter().map(disc).collect();
        Discs::build(&discs, progress)
    }
}

/// Indices of the positions that decide, in ascending order.
fn chosen(
    positions: &[Vec3],
    cloud_normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<u32>, Cancelled> {
    let count = u32::try_from(positions.len().min(cloud_normals.len())).unwrap_or(u32::MAX);
    let valid: Vec<u32> = (0..count)
        .filter(|&index| {
            let index = index as usize;
            positions[index].is_finite() && normals::is_valid(cloud_normals[index])
        })
        .collect();
    let wanted = ALL.max(valid.len() / 4);
    if valid.len() <= wanted + wanted / 4 {
        return Ok(valid);
    }
    let points: Vec<Vec3> = valid.iter().map(|&index| positions[index as usize]).collect();
    let edge = edge_for(&points, wanted, &part(progress, 0.0..0.5))?;
    let kept = one_per_cube(&points, edge, &part(progress, 0.5..1.0))?;
    Ok(valid.into_iter().zip(kept).filter(|&(_, kept)| kept).map(|(index, _)| index).collect())
}

/// The edge of cubes of which about `wanted` hold points, a fifth more or less.
fn edge_for(points: &[Vec3], wanted: usize, progress: Progress<'_>) -> Result<f64, Cancelled> {
    const TRIES: usize = 5;
    let bounds = Bounds::of_positions(points).unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
    let mut edge = bounds.extent() / (wanted as f64).sqrt();
    for attempt in 0..TRIES {
        let share = |step: usize| step as f64 / TRIES as f64;
        let cube = |point: Vec3| ((point.as_dvec3() - bounds.min) / edge).to_array().map(|c| c as u32);
        let cubes: Vec<[u32; 3]> = points.iter().map(|&point| cube(point)).collect();
        let sorted = sort(cubes, &part(progress, share(attempt)..share(attempt + 1)))?;
        let found: usize = sorted.iter().map(|piece| piece.chunk_by(|a, b| a == b).count()).sum();
        let ratio = found as f64 / wanted as f64;
        if (0.8..1.2).contains(&ratio) || edge <= 0.0 {
            break;
        }
        edge *= ratio.clamp(0.01, 100.0).sqrt();
    }
    Ok(edge)
}
