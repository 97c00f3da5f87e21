//! Discs for samples: radii that reach the corners between neighbours, and additional samples where
//! rays would still pass.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::field::step;
use crate::figure::Figure;
use crate::grid::Grid;
use crate::portable::sin_cos;
use crate::sample::{GRID_CELL, Sample, project};

/// The least and the greatest radius on flat ground, in spacings. Samples that lie as densely as
/// they may are at most a spacing away from every point, so that most discs need little more.
const LEAST: f64 = 1.15;
const MOST: f64 = 1.6;
/// What a disc reaches beyond the points it is to cover, since rays also come aslant.
const BEYOND: f64 = 1.1;
/// Gaps are closed with this share of each radius, so that discs overlap where renderers round.
const MARGIN: f64 = 0.97;
/// A disc is widened by no more than this to close a gap; more would be seen between its likes.
const WIDEN: f64 = 1.25;
/// Radius in spacings of a sample that closes a gap; it only has to reach the discs around it.
const PATCH: f64 = 0.8;

/// Cosine between normals below which a sample lies on the far side of a thin sheet.
const FAR_SIDE: f64 = -0.3;
/// Directions besides the normal that gaps are looked for from, and cosines that they take in turn.
const SLANTED: u32 = 24;
const SLANTS: [f64; 3] = [0.85, 0.3, 0.6];
/// Cosine below which a disc is seen edge-on and covers nothing.
const EDGE_ON: f64 = 0.1;

/// Samples as discs, found by place.
struct Discs {
    samples: Vec<Sample>,
    radii: Vec<f64>,
    grid: Grid,
}

/// Gives each sample a radius and adds samples where gaps remain. `seen` are surface points that
/// shall be covered besides the corners between neighbours.
#[must_use]
pub fn fill(figure: &Figure, samples: Vec<Sample>, seen: &[Sample]) -> Vec<(Sample, f64)> {
    let mut grid = Grid::new(GRID_CELL);
    for (index, sample) in samples.iter().enumerate() {
        grid.insert(sample.position, index);
    }
    let mut discs = Discs { radii: vec![0.0; samples.len()], samples, grid };
    let corners: Vec<_> = (0..discs.samples.len())
        .into_par_iter()
        .flat_map_iter(|i| discs.corners(figure, i))
        .collect();
    discs.radii = discs.covering(corners.iter().chain(seen));
    let points: Vec<&Sample> = corners.iter().chain(seen).collect();
    let open: Vec<&Sample> =
        points.into_par_iter().filter(|point| discs.gap(figure, point).is_some()).collect();
    for point in open {
        // What closed a gap before may have closed this one too.
        while let Some(away) = discs.gap(figure, point) {
            discs.close(point, away);
        }
    }
    discs.samples.into_iter().zip(discs.radii).collect()
}

impl Discs {
    /// The corners of a sample's Voronoi cell on the surface. Each is shared by three samples, the
    /// first of which finds it.
    fn corners(&self, figure: &Figure, index: usize) -> Vec<Sample> {
        let sample = self.samples[index];
        let u = sample.normal.any_orthonormal_vector();
        let v = sample.normal.cross(u);
        let near = self.laid_out(index, u, v);
        let later: Vec<DVec2> =
            near.iter().filter(|(other, _)| *other > index).map(|(_, place)| *place).collect();
        let widest = sample.spacing * MOST;
        let mut corners = Vec::new();
        for (number, a) in later.iter().enumerate() {
            for b in &later[number + 1..] {
                let Some(corner) = middle_of_circle(*a, *b) else { continue };
                // The two neighbours themselves lie on the circle but for rounding.
                let free = corner.length_squared() * (1.0 - 1e-9);
                let is_empty = || near.iter().all(|(_, c)| c.distance_squared(corner) >= free);
                if free < widest * widest && is_empty() {
                    corners.extend(project(figure, sample.position + u * corner.x + v * corner.y));
                }
            }
        }
        corners
    }

    /// Neighbours in a sample's tangent plane, at their distances in space.
    fn laid_out(&self, index: usize, u: DVec3, v: DVec3) -> Vec<(usize, DVec2)> {
        let sample = self.samples[index];
        // A neighbour twice as far away as the farthest corner still bounds that corner.
        let reach = 2.0 * MOST * sample.spacing;
        let place = |other: usize| {
            let offset = self.samples[other].position - sample.position;
            let distance = offset.length();
            let is_near =
                distance < reach && self.samples[other].normal.dot(sample.normal) > FAR_SIDE;
            let flat = DVec2::new(offset.dot(u), offset.dot(v)).try_normalize()?;
            (other != index && is_near).then_some((other, flat * distance))
        };
        self.grid.near(sample.position, reach).filter_map(place).collect()
    }

    fn same_side(&self, other: usize, sample: &Sample) -> bool {
        self.samples[other].normal.dot(sample.normal) > 0.5
    }

    /// The radius that lets each disc reach every point it is nearest to; at least 1.15 and at most
    /// 1.6 spacings where the surface is flat.
    fn covering<'a>(&self, points: impl Iterator<Item = &'a Sample>) -> Vec<f64> {
        let nearest = |point: &Sample| {
            let same_side = self
                .grid
                .near(point.position, point.spacing * MOST)
                .filter(|&index| self.same_side(index, point))
                .map(|index| (index, self.samples[index].position.distance(point.position)));
            same_side.min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let points: Vec<_> = points.collect();
        let nearest: Vec<_> = points.into_par_iter().filter_map(nearest).collect();
        let mut farthest = vec![0.0_f64; self.samples.len()];
        for (index, distance) in nearest {
            farthest[index] = farthest[index].max(distance);
        }
        let bounded = |(sample, farthest): (&Sample, f64)| {
            let covering = (farthest * BEYOND).clamp(sample.spacing * LEAST, sample.spacing * MOST);
            covering * self.flatness(sample)
        };
        self.samples.par_iter().zip(farthest).map(bounded).collect()
    }

    /// 1 on flat ground and in hollows, down to 0.55 where the surface turns away within one disc,
    /// as at the edge of a leaf: a full disc would stand out there like a scale, and its neighbours'
    /// discs, which lie along the surface, cover the gap.
    fn flatness(&self, sample: &Sample) -> f64 {
        let reach = sample.spacing * 1.4;
        let (mut sum, mut count) = (0.0, 0.0);
        for index in self.grid.near(sample.position, reach) {
            let other = &self.samples[index];
            let alike = other.normal.dot(sample.normal);
            let offset = other.position - sample.position;
            // The far side of a thin sheet says nothing about the turning of this side.
            let turns_away = offset.dot(sample.normal) <= 0.0;
            if turns_away && alike > FAR_SIDE && offset.length() < reach {
                sum += alike;
                count += 1.0;
            }
        }
        // At the bottom of a hollow nothing turns away.
        if count > 0.0 { 0.55 + 0.45 * step(0.2, 0.9, sum / count) } else { 1.0 }
    }

    /// The direction of a ray that reaches a surface point from outside through no disc: the normal
    /// or one of some around it. At edges only the normal is looked along: what others pass there is
    /// the outline of a leaf, which more discs would fray.
    fn gap(&self, figure: &Figure, point: &Sample) -> Option<DVec3> {
        let near = self.near(point);
        if near.iter().any(|&index| self.is_amid(index, point)) {
            return None;
        }
        let is_free = |away: &DVec3| {
            !near.iter().any(|&index| self.miss(index, point, *away) <= MARGIN)
                && sees_out(figure, point.position, *away, point.spacing)
        };
        let u = point.normal.any_orthonormal_vector();
        let v = point.normal.cross(u);
        let aslant = |number: u32| {
            let (sin, cos) = sin_cos(f64::from(number) / f64::from(SLANTED) * TAU);
            let height = SLANTS[number as usize % SLANTS.len()];
            point.normal * height + (u * cos + v * sin) * (1.0 - height * height).sqrt()
        };
        Some(point.normal).filter(is_free).or_else(|| {
            let slanted = (0..SLANTED).map(aslant).find(is_free)?;
            (self.flatness(point) > 0.9).then_some(slanted)
        })
    }

    /// Discs that a line through a point may meet within a spacing of it.
    fn near(&self, point: &Sample) -> Vec<usize> {
        let reach = point.spacing * (1.0 + MOST);
        let is_near = |&index: &usize| {
            self.samples[index].position.distance_squared(point.position) < reach * reach
        };
        self.grid.near(point.position, reach).filter(is_near).collect()
    }

    /// Whether a point lies in the inner half of a disc, which every ray meets then that is not
    /// aslant by more than the least of the slants.
    fn is_amid(&self, index: usize, point: &Sample) -> bool {
        let (disc, radius) = (&self.samples[index], self.radii[index]);
        let offset = disc.position - point.position;
        offset.length_squared() < 0.25 * radius * radius
            && disc.normal.dot(offset).abs() < 0.1 * radius
            && disc.normal.dot(point.normal) > 0.98
    }

    /// Distance in radii at which a line through a point passes the middle of a disc that faces it
    /// within a spacing of the point; infinite for others.
    fn miss(&self, index: usize, point: &Sample, away: DVec3) -> f64 {
        let disc = &self.samples[index];
        let offset = disc.position - point.position;
        let facing = disc.normal.dot(away);
        let along = disc.normal.dot(offset) / facing;
        if facing > EDGE_ON && along.abs() < point.spacing {
            (away * along - offset).length() / self.radii[index]
        } else {
            f64::INFINITY
        }
    }

    /// Closes a gap: widens the disc that needs it least where that may grow so far, else adds one.
    fn close(&mut self, point: &Sample, away: DVec3) {
        let near = self.near(point);
        let missed = near.into_iter().map(|index| (index, self.miss(index, point, away)));
        let closest = missed.min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((index, missed)) = closest {
            // A little more than needed, so that rounding does not leave the gap open.
            let wanted = self.radii[index] * missed / MARGIN * 1.001;
            let sample = self.samples[index];
            if missed < WIDEN && wanted < MOST * sample.spacing * self.flatness(&sample) {
                self.radii[index] = wanted;
                return;
            }
        }
        self.grid.insert(point.position, self.samples.len());
        self.samples.push(*point);
        self.radii.push(PATCH * point.spacing * self.flatness(point));
    }
}

/// Whether the way out of the surface is free for some spacings.
fn sees_out(figure: &Figure, point: DVec3, away: DVec3, spacing: f64) -> bool {
    [0.3, 0.6, 1.0, 1.6, 2.4, 3.6]
        .iter()
        .all(|far| figure.distance(point + away * spacing * *far) > 0.0)
}

/// The middle of the circle through the origin and two points; `None` where they are in line.
fn middle_of_circle(a: DVec2, b: DVec2) -> Option<DVec2> {
    let twice_area = a.perp_dot(b);
    let scaled = (a.length_squared() * b.perp() - b.length_squared() * a.perp()) / -2.0;
    (twice_area.abs() > 1e-3 * a.length() * b.length()).then(|| scaled / twice_area)
}
