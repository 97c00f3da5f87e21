//! Samples the zero set of a figure evenly: no two samples of one side nearer than the wanted
//! spacing, save for those that close gaps, and none farther from its neighbours than its disc
//! reaches.
//!
//! Method: Poisson-disk sampling grown over the surface. Every accepted sample offers candidates
//! in its tangent plane, which Newton steps pull onto the surface; a candidate is taken when no
//! sample facing the same way is too near. Growing needs a start on every separate piece, which
//! a coarse grid of points supplies.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use crate::figure::Figure;
use crate::filling::fill;
use crate::grid::Grid;
use crate::noise::Random;
use crate::portable::sin_cos;

/// Half the distance over which gradients are taken. With f64 the difference keeps nine digits.
const PROBE: f64 = 2e-5;
/// A Newton step this short was the last: the next would be shorter than its square times the
/// curvature, which is below 1e-6 for every detail that the spacing can resolve.
const ARRIVED: f64 = 5e-5;
/// Side of the cells that starting points are tried in.
const START_CELL: f64 = 0.03;
/// Candidates offered by each sample.
const OFFERS: u32 = 14;
/// Samples that face less alike than this (cosine) do not crowd each other, so that both sides of
/// a thin sheet are sampled.
const SAME_SIDE: f64 = 0.1;

/// Side of the cells that samples are found by.
pub(crate) const GRID_CELL: f64 = 0.012;

/// A surfel in the making.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// On the surface.
    pub position: DVec3,
    /// Unit length, outwards.
    pub normal: DVec3,
    /// Wanted distance to the neighbours.
    pub spacing: f64,
}

/// The field at a point and its slope there, from four probes at the corners of a tetrahedron,
/// whose mean stands for the middle.
fn probe(figure: &Figure, point: DVec3) -> (f64, DVec3) {
    let corners = [
        DVec3::new(1.0, -1.0, -1.0),
        DVec3::new(-1.0, -1.0, 1.0),
        DVec3::new(-1.0, 1.0, -1.0),
        DVec3::new(1.0, 1.0, 1.0),
    ];
    let (mut mean, mut slope) = (0.0, DVec3::ZERO);
    for corner in corners {
        let distance = figure.distance(point + corner * PROBE);
        mean += distance / 4.0;
        slope += corner * (distance / (4.0 * PROBE));
    }
    (mean, slope)
}

/// Pulls a point onto the surface; `None` where Newton's steps do not arrive, as they do not at
/// sharp inner edges.
pub(crate) fn project(figure: &Figure, start: DVec3) -> Option<Sample> {
    let mut point = start;
    for _ in 0..10 {
        let (distance, slope) = probe(figure, point);
        let steepness = slope.length();
        if steepness < 0.05 {
            return None;
        }
        let normal = slope / steepness;
        let stride = (distance / steepness).clamp(-0.02, 0.02);
        point -= normal * stride;
        if stride.abs() < ARRIVED {
            let spacing = figure.part_at(point).spacing(point);
            return Some(Sample { position: point, normal, spacing });
        }
    }
    None
}

/// Points of a coarse grid near the surface, pulled onto it.
fn starts(figure: &Figure) -> Vec<Sample> {
    let (low, high) = figure.bounds();
    let cells = ((high - low) / START_CELL).ceil().as_u64vec3();
    let from_layer = |layer: u64| {
        let mut found = Vec::new();
        for index in 0..cells.x * cells.z {
            let cell = DVec3::new((index % cells.x) as f64, layer as f64, (index / cells.x) as f64);
            let point = low + (cell + DVec3::splat(0.5)) * START_CELL;
            if figure.distance(point).abs() < START_CELL {
                found.extend(project(figure, point));
            }
        }
        found
    };
    (0..cells.y).into_par_iter().flat_map_iter(from_layer).collect()
}

/// Samples taken so far, found by place.
struct SampleSet {
    samples: Vec<Sample>,
    grid: Grid,
}

impl SampleSet {
    /// Whether a sample facing the same way is nearer than `share` of the spacing that is
    /// wanted here.
    fn crowd(&self, candidate: &Sample, share: f64) -> bool {
        self.grid.near(candidate.position, candidate.spacing).any(|index| {
            let other = &self.samples[index];
            let apart = share * candidate.spacing;
            candidate.position.distance_squared(other.position) < apart * apart
                && candidate.normal.dot(other.normal) > SAME_SIDE
        })
    }

    /// What a sample offers: points of its tangent plane between one and two spacings away,
    /// pulled onto the surface unless they are plainly crowded already.
    fn offers(&self, figure: &Figure, index: usize) -> Vec<Sample> {
        let sample = self.samples[index];
        let mut random = Random::new((index as u64).wrapping_mul(0x5851_f42d_4c95_7f2d));
        let tangent = sample.normal.any_orthonormal_vector();
        let cotangent = sample.normal.cross(tangent);
        let first = random.unit();
        let offer = |number: u32| {
            let (sin, cos) = sin_cos((first + f64::from(number) / f64::from(OFFERS)) * TAU);
            let farthest = 1.1 + 0.4 * f64::from(number % 3);
            let reach = sample.spacing * random.between(1.0, farthest);
            let position = sample.position + (tangent * cos + cotangent * sin) * reach;
            let plainly_crowded = self.crowd(&Sample { position, ..sample }, 0.7);
            if plainly_crowded { None } else { project(figure, position) }
        };
        (0..OFFERS).filter_map(offer).collect()
    }
}

/// Samples and every candidate that was ever on the surface, which later measures coverage.
fn grow(figure: &Figure) -> (Vec<Sample>, Vec<Sample>) {
    let mut taken = SampleSet { samples: Vec::new(), grid: Grid::new(GRID_CELL) };
    let mut seen = Vec::new();
    let mut offered = starts(figure);
    while !offered.is_empty() {
        let first_new = taken.samples.len();
        for candidate in &offered {
            if !taken.crowd(candidate, 1.0) {
                taken.grid.insert(candidate.position, taken.samples.len());
                taken.samples.push(*candidate);
            }
        }
        seen.append(&mut offered);
        let fresh = first_new..taken.samples.len();
        offered =
            fresh.into_par_iter().flat_map_iter(|index| taken.offers(figure, index)).collect();
    }
    (taken.samples, seen)
}

/// Samples of a figure with their radii, in the order they were taken; last those that close gaps.
#[must_use]
pub fn sample(figure: &Figure) -> Vec<(Sample, f64)> {
    let (taken, seen) = grow(figure);
    fill(figure, taken, &seen)
}

/// How deep a surface point lies in a fold, from 0 (open or convex) to 1: the field grows slower
/// outwards than a plane's would where walls are near.
#[must_use]
pub fn cavity(figure: &Figure, sample: &Sample) -> f64 {
    let reach = 0.022;
    let clear = figure.distance(sample.position + sample.normal * reach);
    (1.0 - clear / reach).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::Pebble;

    fn pebble() -> Figure {
        let pebble = Pebble::new(DVec3::ZERO, 0.1, &mut Random::new(3));
        Figure::new(vec![Box::new(pebble)])
    }

    #[test]
    fn samples_lie_on_the_surface_and_keep_their_distance() {
        let figure = pebble();
        let (samples, _) = grow(&figure);
        assert!(samples.len() > 500, "only {} samples", samples.len());
        for (index, one) in samples.iter().enumerate() {
            // Twice the bound that the last Newton step guarantees.
            assert!(figure.distance(one.position).abs() < 2e-6);
            assert!((one.normal.length() - 1.0).abs() < 1e-12);
            for other in &samples[index + 1..] {
                let crowded =
                    one.position.distance(other.position) < one.spacing.min(other.spacing);
                assert!(!crowded || one.normal.dot(other.normal) <= SAME_SIDE);
            }
        }
    }

    #[test]
    fn discs_leave_no_hole() {
        let figure = pebble();
        let samples = sample(&figure);
        let mut random = Random::new(99);
        for _ in 0..5_000 {
            let Some(point) = project(&figure, random.in_cube() * 0.12) else { continue };
            // Seen along the surface's normal, some disc lies over or under the point, no farther
            // off than the surface bends away within a disc.
            let covered = samples.iter().any(|(disc, radius)| {
                let offset = point.position - disc.position;
                let facing = point.normal.dot(disc.normal);
                let off = disc.normal.dot(offset) / facing;
                let in_plane = offset - point.normal * off;
                facing > 0.3 && off.abs() < 0.5 * radius && in_plane.length() < *radius
            });
            assert!(covered, "hole at {}", point.position);
        }
    }

    #[test]
    fn fold_is_a_cavity_and_open_ground_is_not() {
        let figure = Figure::new(vec![
            Box::new(Pebble::new(DVec3::ZERO, 0.1, &mut Random::new(3))),
            Box::new(Pebble::new(DVec3::X * 0.19, 0.1, &mut Random::new(4))),
        ]);
        let samples = sample(&figure);
        let depths: Vec<_> = samples.iter().map(|(one, _)| cavity(&figure, one)).collect();
        assert!(depths.iter().any(|depth| *depth > 0.7), "no fold between two stones");
        let open = depths.iter().filter(|depth| **depth < 0.3).count();
        assert!(open * 2 > depths.len(), "most of two stones is open");
    }
}
