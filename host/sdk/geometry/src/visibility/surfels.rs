//! The surfels that decide for a cloud: all of a small one, one per cube of a large one.

use super::frame::Frame;
use super::strays;
use crate::Bounds;
use crate::discs::{Disc, Discs};
use crate::eigen;
use crate::neighbours::{Neighbours, Scratch};
use crate::normals;
use crate::progress::{Cancelled, Progress, map, map_with, part, sort};
use crate::thinning::one_per_cube;
use glam::{DMat3, DVec3, Vec3};

/// Neighbours of a surfel: random samples of a surface hang together with ten.
pub(super) const LINKS: usize = 10;

/// The neighbour whose distance is the radius of a disc. Of points that lie at random the discs leave
/// exp(-4) of the surface open; larger ones cover more of what lies behind edges.
const COVERING: usize = 4;

/// Distance up to which they may be part of its own surface, in radii.
const NEAR: f32 = 4.0;

/// Points among which each surfel is chosen, on the mean, where there are so many.
pub(super) const CANDIDATES: usize = 16;

/// No neighbour.
const NOBODY: u32 = u32::MAX;

/// What a surfel is for the choice of sides, in a box of unit size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surfel {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// About a spacing; 0 for a lone point.
    pub(super) radius: f32,
    /// Nearest others, nearest first; `NOBODY` where there are fewer.
    links: [u32; LINKS],
}

impl Surfel {
    /// Neighbours that exist.
    pub(super) fn linked(&self) -> impl Iterator<Item = u32> + '_ {
        self.links.iter().copied().filter(|&other| other != NOBODY)
    }

    /// Whether nothing lies between it and a place. Sheets nearer to it than a few radii do not
    /// count: noise of its own surface is more frequent.
    pub(super) fn is_visible(&self, place: Vec3, discs: &Discs) -> bool {
        let towards = place - self.position;
        let distance = towards.length();
        let reach = NEAR * self.radius..distance;
        reach.is_empty() || !discs.is_hit(self.position, towards / distance, reach, |_| true)
    }
}

/// The surfels of a cloud.
pub(super) struct Surfels {
    pub(super) all: Vec<Surfel>,
    /// Points that are surfels or coincide with one: index into the cloud and into the surfels, the
    /// first in ascending order.
    pub(super) members: Vec<(u32, u32)>,
    /// Edge of the cubes of which each has one, in units of the box; 0 where all points are surfels.
    pub(super) edge: f64,
    pub(super) frame: Frame,
}

/// How many surfels decide, and by which normals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    /// About how many, where there are more points.
    pub(super) count: usize,
    /// Whether normals are fitted to the surfels anew, rather than the cloud's.
    pub(super) refit: bool,
}

impl Surfels {
    /// Chooses and measures surfels among the positions that are finite, no strays and have a direction.
    pub(super) fn choose(
        positions: &[Vec3],
        cloud_normals: &[Vec3],
        choice: Choice,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let thinning = part(progress, 0.0..0.3);
        let (kept, edge) = chosen(positions, cloud_normals, choice.count, &thinning)?;
        let points: Vec<Vec3> = kept.iter().map(|&index| positions[index as usize]).collect();
        let neighbours = Neighbours::build(&points, &part(progress, 0.3..0.5))?;
        let frame = Frame::of(neighbours.bounds());
        let measuring = part(progress, 0.5..0.9);
        let mut all =
            map_with(neighbours.n_distinct(), &measuring, Scratch::default, |room, place| {
                let index = neighbours.index(place);
                let normal = normals::normalised(cloud_normals[kept[index] as usize]);
                let (links, distance) = around(&neighbours, place, room);
                let radius = (distance * neighbours.scale() / frame.scale) as f32;
                Surfel { position: frame.inside(points[index]), normal, radius, links }
            })?;
        if choice.refit {
            let fitted = map(all.len(), &part(progress, 0.9..1.0), |place| fitted(&all, place))?;
            for (surfel, normal) in all.iter_mut().zip(fitted) {
                surfel.normal = normal;
            }
        }
        let member = |(place, &index): (usize, &u32)| {
            neighbours.place_of(place).map(|surfel| (index, surfel as u32))
        };
        let members = kept.iter().enumerate().filter_map(member).collect();
        Ok(Self { all, members, edge: edge / frame.scale, frame })
    }

    /// The discs of the surfels, to trace rays at.
    pub(super) fn discs(&self, progress: Progress<'_>) -> Result<Discs, Cancelled> {
        let disc = |surfel: &Surfel| Disc {
            centre: surfel.position,
            normal: surfel.normal,
            radius: surfel.radius,
        };
        let discs: Vec<Disc> = self.all.iter().map(disc).collect();
        Discs::build(&discs, progress)
    }
}

/// What a surfel is linked to, and the distance that covers it, units of the search.
fn around(neighbours: &Neighbours, place: usize, room: &mut Scratch) -> ([u32; LINKS], f64) {
    let near = neighbours.around_in_order(place, LINKS, room);
    let mut links = [NOBODY; LINKS];
    for (link, found) in links.iter_mut().zip(near) {
        *link = found.place;
    }
    let covering = near.get(COVERING - 1).or(near.last());
    (links, covering.map_or(0.0, |found| found.distance))
}

/// The normal of the plane through a surfel and its neighbours; its own where there is none.
fn fitted(all: &[Surfel], place: usize) -> Vec3 {
    let surfel = &all[place];
    if surfel.radius <= 0.0 {
        return surfel.normal;
    }
    let near = surfel.linked().map(|other| all[other as usize].position);
    let offsets: Vec<DVec3> = std::iter::once(surfel.position)
        .chain(near)
        .map(|point| ((point - surfel.position) / surfel.radius).as_dvec3())
        .collect();
    let mean = offsets.iter().sum::<DVec3>() / offsets.len() as f64;
    let covariance = offsets.iter().fold(DMat3::ZERO, |sum, &offset| {
        let d = offset - mean;
        sum + DMat3::from_cols(d * d.x, d * d.y, d * d.z)
    });
    eigen::symmetric(covariance).vectors[0].as_vec3()
}

/// Indices of the positions that decide, strays left out, in ascending order, and the edge of their cubes, scene units.
fn chosen(
    positions: &[Vec3],
    cloud_normals: &[Vec3],
    count: usize,
    progress: Progress<'_>,
) -> Result<(Vec<u32>, f64), Cancelled> {
    let n = u32::try_from(positions.len().min(cloud_normals.len())).unwrap_or(u32::MAX);
    let is_valid = |index: &u32| {
        let index = *index as usize;
        positions[index].is_finite() && normals::is_valid(cloud_normals[index])
    };
    // Of very many points some do: nearly every cube has some of them, and what it takes does not grow with the rest.
    let stride = (n as usize / (CANDIDATES * count.max(1))).max(1);
    let mut valid: Vec<u32> = (0..n).step_by(stride).filter(is_valid).collect();
    strays::leave_out(positions, &mut valid);
    if valid.len() <= count + count / 4 {
        return Ok((valid, 0.0));
    }
    let points: Vec<Vec3> = valid.iter().map(|&index| positions[index as usize]).collect();
    let edge = edge_for(&points, count, &part(progress, 0.0..0.5))?;
    let kept = one_per_cube(&points, edge, &part(progress, 0.5..1.0))?;
    let kept = valid.into_iter().zip(kept).filter(|&(_, kept)| kept);
    Ok((kept.map(|(index, _)| index).collect(), edge))
}

/// The edge of cubes of which about `count` hold points, a fifth more or less: what
/// `thinning::edge_for` finds more exactly in several times the time.
fn edge_for(points: &[Vec3], count: usize, progress: Progress<'_>) -> Result<f64, Cancelled> {
    const TRIES: usize = 5;
    let bounds = Bounds::of_positions(points);
    let bounds = bounds.unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
    let mut edge = bounds.extent() / (count.max(1) as f64).sqrt();
    for attempt in 0..TRIES {
        let share = |step: usize| step as f64 / TRIES as f64;
        // One number sorts faster than three. Casts saturate; so far off there are next to no points.
        let cube = |point: &Vec3| {
            let place = ((point.as_dvec3() - bounds.min) / edge).to_array();
            place.iter().fold(0, |all, place| all << 21 | (*place as u64).min((1 << 21) - 1))
        };
        let cubes: Vec<u64> = points.iter().map(cube).collect();
        let sorted = sort(cubes, &part(progress, share(attempt)..share(attempt + 1)))?;
        let found: usize = sorted.iter().map(|piece| piece.chunk_by(|a, b| a == b).count()).sum();
        let ratio = found as f64 / count.max(1) as f64;
        if (0.8..1.2).contains(&ratio) || edge <= 0.0 {
            break;
        }
        edge *= ratio.clamp(0.01, 100.0).sqrt();
    }
    Ok(edge)
}
