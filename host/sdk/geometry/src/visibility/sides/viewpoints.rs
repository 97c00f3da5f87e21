//! Places that see much of a scan: where its scanner may have been.

use super::rays::{Ray, STRAIGHT};
use crate::Bounds;
use crate::discs::Discs;
use crate::hashing;
use crate::progress::{Cancelled, Progress, flat_map, map, part};
use crate::visibility::surfels::Surfels;
use glam::Vec3;

/// Places along each edge of the grid that is searched first: a box twice as large as the scan's.
const GRID: usize = 7;

/// Surfels that say how much a place sees.
const SAMPLES: usize = 300;

/// Places from which a climb starts.
const STARTS: usize = 8;

/// Places taken.
const MOST: usize = 6;

/// Share of the samples that a further place must add.
const GAIN: f32 = 0.02;

/// Cosine between a surface and a line of sight below which noise decides on its side.
const GRAZING: f32 = 0.1;

/// A place and what it sees.
#[derive(Clone, Debug)]
pub(super) struct Viewpoint {
    pub(super) position: Vec3,
    /// How good it is: the share of the samples that it sees; where signs are known, of those whose
    /// front it sees less those whose back it sees.
    pub(super) worth: f32,
    /// What of the samples counts for it.
    views: Vec<bool>,
}

/// What a search looks at.
pub(super) struct Search<'a> {
    surfels: &'a Surfels,
    discs: &'a Discs,
    /// Signs of surfels; `None` before they are known.
    signs: Option<&'a [bool]>,
    samples: Vec<u32>,
}

impl<'a> Search<'a> {
    pub(super) fn new(surfels: &'a Surfels, discs: &'a Discs, signs: Option<&'a [bool]>) -> Self {
        let n = surfels.all.len();
        let sample =
            |i: usize| ((hashing::unit(5, i as u64) * n as f64) as usize).min(n - 1) as u32;
        Self { surfels, discs, signs, samples: (0..SAMPLES.min(n)).map(sample).collect() }
    }

    /// What a place sees.
    pub(super) fn look(&self, position: Vec3) -> Viewpoint {
        let (mut worth, mut views) = (0.0, Vec::with_capacity(self.samples.len()));
        for &sample in &self.samples {
            let surfel = &self.surfels.all[sample as usize];
            let visible = surfel.is_visible(position, self.discs);
            let Some(signs) = self.signs else {
                worth += f32::from(u8::from(visible));
                views.push(visible);
                continue;
            };
            let cosine = (position - surfel.position).normalize_or_zero().dot(surfel.normal);
            let cosine = if signs[sample as usize] { cosine } else { -cosine };
            if visible && cosine.abs() > GRAZING {
                worth += cosine.signum();
            }
            views.push(visible && cosine > GRAZING);
        }
        Viewpoint { position, worth: worth / self.samples.len().max(1) as f32, views }
    }

    /// The best place near a start, in steps that grow smaller.
    fn climb(&self, start: &Viewpoint, step: f32) -> Viewpoint {
        const LEAST: f32 = 0.02;
        let (mut best, mut step) = (start.clone(), step);
        while step > LEAST {
            let ways = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]);
            let around = ways.map(|way| self.look(best.position + step * way));
            // The first of those that are equally good.
            let next = around.reduce(|a, b| if b.worth > a.worth { b } else { a });
            match next.filter(|next| next.worth > best.worth) {
                Some(next) => best = next,
                None => step *= 0.5,
            }
        }
        best
    }

    /// Places from good to bad, each the best of its surroundings.
    pub(super) fn find(&self, progress: Progress<'_>) -> Result<Vec<Viewpoint>, Cancelled> {
        let Some(bounds) = Bounds::of(self.surfels.all.iter().map(|s| s.position.as_dvec3()))
        else {
            return Ok(Vec::new());
        };
        let extent = bounds.extent() as f32;
        // A sheet is looked at from above and below.
        let size = bounds.size().as_vec3().max(Vec3::splat(0.3 * extent));
        let centre = bounds.centre().as_vec3();
        let grid = map(GRID * GRID * GRID, &part(progress, 0.0..0.5), |i| {
            let at = |place: usize| 2.0 * (place as f32 + 0.5) / GRID as f32 - 1.0;
            let offset = Vec3::new(at(i % GRID), at(i / GRID % GRID), at(i / GRID / GRID));
            self.look(centre + offset * size)
        })?;
        let mut order: Vec<&Viewpoint> = grid.iter().collect();
        order.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        let step = 2.0 * size.max_element() / GRID as f32;
        let mut starts: Vec<&Viewpoint> = Vec::new();
        for place in order {
            let is_apart =
                |start: &&Viewpoint| start.position.distance(place.position) > 1.8 * step;
            if starts.len() < STARTS && starts.iter().all(is_apart) {
                starts.push(place);
            }
        }
        let climb = |i: usize| self.climb(starts[i], 0.5 * step);
        let mut found = map(starts.len(), &part(progress, 0.5..1.0), climb)?;
        found.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        Ok(found)
    }
}

/// A few of the places that together see most.
pub(super) fn covering(found: &[Viewpoint]) -> Vec<Vec3> {
    let n = found.first().map_or(0, |place| place.views.len());
    let mut covered = vec![false; n];
    let mut taken = Vec::new();
    while taken.len() < MOST {
        let gain = |place: &Viewpoint| {
            place.views.iter().zip(&covered).filter(|&(&views, &covered)| views && !covered).count()
        };
        // The first, which is the better, of those that add equally much.
        let best = found.iter().rev().max_by_key(|place| gain(place));
        let Some(best) = best.filter(|best| gain(best) as f32 > GAIN * n as f32) else { break };
        for (covered, views) in covered.iter_mut().zip(&best.views) {
            *covered |= views;
        }
        taken.push(best.position);
    }
    taken
}

/// Rays from surfels to the places that see them, so many times as heavy as between surfels; the
/// places are numbered from `first`.
pub(super) fn rays(
    surfels: &Surfels,
    discs: &Discs,
    (places, first): (&[Vec3], usize),
    weight: f32,
    progress: Progress<'_>,
) -> Result<Vec<Ray>, Cancelled> {
    flat_map(surfels.all.len(), progress, |from| {
        places.iter().enumerate().filter_map(move |(k, &place)| {
            let surfel = &surfels.all[from];
            let cosine = (place - surfel.position).normalize_or_zero().dot(surfel.normal);
            if cosine.abs() < GRAZING || !surfel.is_visible(place, discs) {
                return None;
            }
            // The cast saturates.
            let weight = (weight * STRAIGHT * cosine.abs()).round().max(1.0) as u8;
            let (from, to) = (from as u32, (first + k) as u32);
            Some(Ray { from, to, weight, leaves_front: cosine > 0.0, arrives_front: true })
        })
    })
}
