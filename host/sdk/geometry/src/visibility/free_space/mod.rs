//! Places in a scan where one can stand.

mod cells;

use super::surfels::{Choice, Surfels};
use crate::discs::Discs;
use crate::hashing;
use crate::normals;
use crate::progress::{Cancelled, Progress, map, part, report};
use cells::Cells;
use glam::Vec3;
use std::collections::BTreeMap;

/// A free place and what there is to see.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where it is, scene units.
    pub position: Vec3,
    /// Radius of the largest ball around it without points, scene units.
    pub clearance: f32,
    /// Share of the directions in which there is surface, in [0, 1].
    pub enclosure: f32,
    /// Share of the scan's surface that can be seen from here, in [0, 1]; of its front, where normals
    /// tell which that is.
    pub sees: f32,
    /// The same share of what is seen from far outside, from all sides together.
    pub from_outside: f32,
}

impl Place {
    /// How good it is to stand here: much to see, all around, and room.
    fn worth(&self, room: f32) -> f32 {
        let roomy = self.clearance / (self.clearance + 0.3 * room);
        self.sees * (0.25 + 0.75 * self.enclosure) * roomy
    }
}

/// How one stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// The direction that is up, any length; +z where it has none.
    pub up: Vec3,
    /// Height of the eyes above the floor, scene units, above 0; `None` for places in mid-air, where
    /// the units are not known.
    pub eye_height: Option<f32>,
}

/// Surfels that stand for the cloud where one looks around.
const SURFELS: usize = 40_000;

/// Blocks along the longest side of the cloud: of each one place is looked at.
const BLOCKS: f32 = 12.0;

/// Directions in which one looks around.
const DIRECTIONS: usize = 192;

/// Places outside from which one looks at everything, and their distance, half sides of the box around it.
const SIDES: usize = 26;
const OUTSIDE: f32 = 6.0;

/// Surfels that say how much is seen: an error of 2 %.
const SAMPLES: usize = 600;

/// The largest free places within a scan, at most `wanted`, the best to stand at first; none where there
/// are fewer than three points or no room.
///
/// With an eye height each is at that height above what lies below it. `normals` that face free space
/// make a hollow body different from a room: without them (or with fewer than positions) its inside
/// is as good a place. Places are found in cubes a few spacings wide, at least 1/512 of the scan, so
/// that narrower gaps are none. O(n) time, and at most 40 MB beside 16 bytes a position.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn viewpoints(
    positions: &[Vec3],
    normals: Option<&[Vec3]>,
    standing: Standing,
    wanted: usize,
    progress: Progress<'_>,
) -> Result<Vec<Place>, Cancelled> {
    let up = standing.up.try_normalize().unwrap_or(Vec3::Z);
    let eyes = standing.eye_height.filter(|height| height.is_finite() && *height > 0.0);
    let above = f64::from(eyes.unwrap_or(0.0)) * 1.5;
    let Some(cells) = Cells::of(positions, up, above, &part(progress, 0.0..0.2))? else {
        report(progress, 1.0)?;
        return Ok(Vec::new());
    };
    let clearances = cells.clearances(&part(progress, 0.2..0.4))?;
    let candidates = one_per_block(&cells, &clearances, eyes);
    let scan = Scan::of(positions, normals, &part(progress, 0.4..0.6))?;
    let from_outside = scan.seen_outside();
    let looked = map(candidates.len(), &part(progress, 0.6..0.95), |i| {
        let (place, clearance) = candidates[i];
        let seen = scan.look(cells.middle(place), clearance * cells.edge as f32);
        Place { from_outside, ..seen }
    })?;
    let room = eyes.unwrap_or(4.0 * cells.edge as f32);
    let mut places: Vec<Place> = looked.into_iter().filter(|place| place.sees > 0.0).collect();
    places.sort_by(|a, b| b.worth(room).total_cmp(&a.worth(room)));
    let mut taken: Vec<Place> = Vec::new();
    for place in places {
        let is_apart = |other: &Place| {
            other.position.distance(place.position) > other.clearance.max(place.clearance)
        };
        if taken.len() < wanted && taken.iter().all(is_apart) {
            taken.push(place);
        }
    }
    report(progress, 1.0)?;
    Ok(taken)
}

/// Whether most of a scan is seen from within, as rooms, tunnels, streets and woods are, rather than
/// from outside, as things, and land from the air: by the places that [`viewpoints`] found in it.
#[must_use]
pub fn is_seen_from_within(places: &[Place]) -> bool {
    /// Flat ground fills half of the directions, hills a few more.
    const ENCLOSED: f32 = 0.62;
    /// Of a scan of many rooms one is seen.
    const SEEN: f32 = 0.15;
    /// Between the coils of a body (the Stanford dragon: 0.2) one sees less than this share of what is seen from
    /// outside; in a wood, of which all is seen from outside too, 0.4.
    const OF_OUTSIDE: f32 = 0.3;
    places.iter().any(|place| {
        place.enclosure > ENCLOSED && place.sees > SEEN.max(OF_OUTSIDE * place.from_outside)
    })
}

/// A cube and its clearance, in edges.
type Candidate = ([usize; 3], f32);

/// The roomiest cube of each block of space, where one can stand.
fn one_per_block(cells: &Cells, clearances: &[f32], eyes: Option<f32>) -> Vec<Candidate> {
    let candidates: Vec<Candidate> = match eyes {
        Some(eyes) => above_floors(cells, clearances, f64::from(eyes) / cells.edge),
        None => in_mid_air(cells, clearances),
    };
    let longest = cells.size.into_iter().max().unwrap_or(1) as f32;
    let block = (longest / BLOCKS).max(1.0);
    let mut blocks: BTreeMap<[u32; 3], Vec<Candidate>> = BTreeMap::new();
    for candidate in candidates {
        let key = candidate.0.map(|along| (along as f32 / block) as u32);
        blocks.entry(key).or_default().push(candidate);
    }
    blocks.into_values().filter_map(|inside| roomiest(&inside)).collect()
}

/// Of cubes with about the most room the one in their middle.
fn roomiest(inside: &[Candidate]) -> Option<Candidate> {
    let most = inside.iter().map(|candidate| candidate.1).fold(0.0, f32::max);
    let best: Vec<&Candidate> =
        inside.iter().filter(|candidate| candidate.1 >= 0.95 * most).collect();
    let place = |candidate: &Candidate| Vec3::from_array(candidate.0.map(|along| along as f32));
    let mean =
        best.iter().map(|candidate| place(candidate)).sum::<Vec3>() / best.len().max(1) as f32;
    let distance = |candidate: &Candidate| place(candidate).distance_squared(mean);
    best.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
}

/// Cubes at eye height above filled ones, with nothing between and room for a head.
fn above_floors(cells: &Cells, clearances: &[f32], eyes: f64) -> Vec<Candidate> {
    let mut found = Vec::new();
    let [nx, ny, nz] = cells.size;
    // From the middle of the floor's cube.
    let height = (eyes.round() as usize).max(1);
    let ground = ground(cells, (GROUND_REACH * eyes).ceil() as usize);
    let rise = (GROUND_RISE * eyes).ceil() as usize;
    for (x, y) in (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))) {
        let mut floor = None;
        let highest = ground[y * nx + x].saturating_add(rise);
        for z in 0..nz {
            if cells.filled[cells.index([x, y, z])] {
                floor = Some(z).filter(|z| *z <= highest);
            } else if floor.is_some_and(|floor| z == floor + height) {
                let clearance = clearances[cells.index([x, y, z])];
                // A head's width, of a person's height of 1.07 eye heights.
                if f64::from(clearance) >= (0.12 * eyes).max(1.0) {
                    found.push(([x, y, z], clearance));
                }
            }
        }
    }
    found
}

/// How far around one the ground is looked for, in eye heights, and how much higher a floor may be, so that slopes of 30
/// degrees are floors, and roofs, tables and crowns of trees are none.
const GROUND_REACH: f64 = 2.0;
const GROUND_RISE: f64 = 1.15;

/// For each column of cubes the lowest filled one within so many columns along both axes; `usize::MAX` without any.
fn ground(cells: &Cells, reach: usize) -> Vec<usize> {
    let [nx, ny, nz] = cells.size;
    let lowest = |i: usize| {
        let filled = (0..nz).find(|&z| cells.filled[cells.index([i % nx, i / nx, z])]);
        filled.unwrap_or(usize::MAX)
    };
    let lowest: Vec<usize> = (0..nx * ny).map(lowest).collect();
    let around = |at: usize, n: usize| at.saturating_sub(reach)..(at + reach + 1).min(n);
    let least = |all: &mut dyn Iterator<Item = usize>| all.min().unwrap_or(usize::MAX);
    let along: Vec<usize> = (0..nx * ny)
        .map(|i| least(&mut around(i % nx, nx).map(|x| lowest[i / nx * nx + x])))
        .collect();
    (0..nx * ny).map(|i| least(&mut around(i / nx, ny).map(|y| along[y * nx + i % nx]))).collect()
}

/// Cubes with more room than those around them.
fn in_mid_air(cells: &Cells, clearances: &[f32]) -> Vec<Candidate> {
    let mut found = Vec::new();
    let [nx, ny, nz] = cells.size;
    for z in 1..nz.saturating_sub(1) {
        for (x, y) in (1..ny.saturating_sub(1)).flat_map(|y| (1..nx - 1).map(move |x| (x, y))) {
            let here = clearances[cells.index([x, y, z])];
            let beside = [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z]];
            let all = beside.into_iter().chain([[x, y, z - 1], [x, y, z + 1]]);
            let mut around = all.map(|place| clearances[cells.index(place)]);
            if here >= 2.0 && around.all(|other| other <= here) {
                found.push(([x, y, z], here));
            }
        }
    }
    found
}

/// A scan that one looks around in.
struct Scan {
    surfels: Surfels,
    discs: Discs,
    samples: Vec<u32>,
    /// For each sample its normal, where it faces free space.
    faces: Option<Vec<Vec3>>,
}

impl Scan {
    fn of(
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        // Signs and noise of normals are no matter: the planes are fitted anew.
        let any = vec![Vec3::Z; positions.len()];
        let choice = Choice { count: SURFELS, refit: true };
        let surfels = Surfels::choose(positions, &any, choice, &part(progress, 0.0..0.8))?;
        let discs = surfels.discs(&part(progress, 0.8..1.0))?;
        let n = surfels.members.len();
        let sample = |i: usize| ((hashing::unit(7, i as u64) * n as f64) as usize).min(n - 1);
        let chosen: Vec<(u32, u32)> =
            (0..SAMPLES.min(n)).map(|i| surfels.members[sample(i)]).collect();
        let faces = normals.filter(|normals| normals.len() >= positions.len()).map(|normals| {
            chosen.iter().map(|&(index, _)| normals::normalised(normals[index as usize])).collect()
        });
        let samples = chosen.into_iter().map(|(_, surfel)| surfel).collect();
        Ok(Self { surfels, discs, samples, faces })
    }

    /// What is seen from a place.
    fn look(&self, position: Vec3, clearance: f32) -> Place {
        let here = self.surfels.frame.inside(position);
        let hits = (0..DIRECTIONS)
            .filter(|&i| self.discs.is_hit(here, evenly(i, DIRECTIONS), 0.0..f32::MAX, |_| true));
        let enclosure = hits.count() as f32 / DIRECTIONS as f32;
        let sees = self.share(|i| self.is_seen(i, here));
        Place { position, clearance, enclosure, sees, from_outside: 0.0 }
    }

    /// The share of samples that is seen from far away, from any side.
    fn seen_outside(&self) -> f32 {
        let away = |i: usize| OUTSIDE * evenly(i, SIDES);
        self.share(|i| (0..SIDES).any(|side| self.is_seen(i, away(side))))
    }

    /// Whether the front of a sample is seen from a place, in the frame of the surfels.
    fn is_seen(&self, i: usize, here: Vec3) -> bool {
        let surfel = &self.surfels.all[self.samples[i] as usize];
        let faces = self.faces.as_ref();
        faces.is_none_or(|faces| faces[i].dot(here - surfel.position) > 0.0)
            && surfel.is_visible(here, &self.discs)
    }

    /// The share of samples of which this holds.
    fn share(&self, holds: impl Fn(usize) -> bool) -> f32 {
        let n = (0..self.samples.len()).filter(|&i| holds(i)).count();
        n as f32 / self.samples.len().max(1) as f32
    }
}

/// Directions of a spiral that covers the sphere evenly.
fn evenly(i: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2.0 * i as f32 + 1.0) / count as f32;
    let turns = i as f32 * 2.399_963_3;
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * turns.cos(), r * turns.sin(), z)
}

#[cfg(test)]
mod tests;
