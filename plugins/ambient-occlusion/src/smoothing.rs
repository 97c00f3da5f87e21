//! What surfels learn from the rays of those around them.
//!
//! Few rays err much, and what they err by has nothing to do with what their neighbours' do. So the
//! occlusion of the surfels of a bundle and of the bundles around it that face the same way is fitted
//! by a linear function of what is known of each without noise: its place, its normal and what the
//! octree found for it. The fit follows what single surfels differ by, as on rough ground, and
//! takes most of the noise away. Where it misses by more than the noise, at creases and contacts,
//! each surfel's own rays have the say instead.

use crate::bundles::{Bundle, Found};
use crate::passes::SkyCoverage;
use crate::surfels::Surfels;
use std::ops::{ControlFlow, Range};
use surfelshop_api::glam::Vec3;
use surfelshop_api::job::CANCELLED;
use surfelshop_api::prelude::*;
use surfelshop_geometry::{Cancelled, Neighbour, Neighbours};

/// Bundles around each that the function is fitted to.
const AROUND: usize = 12;

/// Distance between bundles, over the sum of their radii, at which they have nothing to do with each
/// other: on a surface the farthest of those around is some three of them away.
const FARTHEST: f32 = 8.0;

/// Cosine between the mean normals of bundles at which one stops to count for the other.
const ALIKE: f32 = 0.7;

/// What the occlusion is a function of: a constant, two of the place, two of the normal, two of the octree.
const N: usize = 10;

/// Surfels of a bundle that err as one, about: they look in the same directions.
const TOGETHER: f32 = 2.5;

type Row = [f32; N];

/// The fit's equations.
struct Equations {
    matrix: [Row; N],
    right: Row,
}

impl Equations {
    fn add(&mut self, x: &Row, y: f32, weight: f32) {
        for ((row, right), own) in self.matrix.iter_mut().zip(&mut self.right).zip(x) {
            let scaled = weight * own;
            for (sum, other) in row.iter_mut().zip(x) {
                *sum += scaled * other;
            }
            *right += scaled * y;
        }
    }

    /// The function's coefficients, by Cholesky's method.
    fn solve(mut self) -> Option<Row> {
        for i in 0..N {
            for j in 0..=i {
                let dot: f32 = (0..j).map(|k| self.matrix[i][k] * self.matrix[j][k]).sum();
                let rest = self.matrix[i][j] - dot;
                self.matrix[i][j] = if i == j {
                    if rest <= 0.0 {
                        return None;
                    }
                    rest.sqrt()
                } else {
                    rest / self.matrix[j][j]
                };
            }
        }
        let mut y = self.right;
        for i in 0..N {
            let dot: f32 = (0..i).map(|k| self.matrix[i][k] * y[k]).sum();
            y[i] = (y[i] - dot) / self.matrix[i][i];
        }
        for i in (0..N).rev() {
            let dot: f32 = (i + 1..N).map(|k| self.matrix[k][i] * y[k]).sum();
            y[i] = (y[i] - dot) / self.matrix[i][i];
        }
        y.iter().all(|value| value.is_finite()).then_some(y)
    }
}

/// Bundles and what is known of them.
pub(crate) struct Smoothing<'a> {
    pub(crate) surfels: &'a Surfels,
    /// Radii of the discs.
    pub(crate) radii: &'a [f32],
    pub(crate) coverage: &'a SkyCoverage,
    pub(crate) bundles: &'a [Bundle],
    pub(crate) found: &'a [Found],
}

/// The occlusion of a bundle's surfels, and the variance of its noise.
pub(crate) type Smooth = ([f32; crate::beams::WIDTH], f32);

impl Smoothing<'_> {
    pub(crate) fn run(&self, share: Range<f64>, job: &Job<'_>) -> Result<Vec<Smooth>> {
        let mean = |bundle: &Bundle, values: &[Vec3]| {
            bundle.places().map(|place| values[place]).sum::<Vec3>() / bundle.n as f32
        };
        let centres: Vec<Vec3> =
            self.bundles.iter().map(|bundle| mean(bundle, &self.surfels.positions)).collect();
        let normals: Vec<Vec3> = (self.bundles.iter())
            .map(|bundle| mean(bundle, &self.surfels.normals).normalize_or_zero())
            .collect();
        let radius = |(bundle, centre): (&Bundle, &Vec3)| {
            let to_edge = |p: usize| self.surfels.positions[p].distance(*centre) + self.radii[p];
            bundle.places().map(to_edge).fold(0.0, f32::max)
        };
        let sizes: Vec<f32> = self.bundles.iter().zip(&centres).map(radius).collect();
        let go_on =
            |_| if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        let search =
            Neighbours::build(&centres, &go_on).map_err(|Cancelled| Error::new(CANCELLED))?;
        job.map(self.bundles.len(), share, |i| {
            let is_near = |near: &Neighbour| {
                near.distance as f32 <= FARTHEST * (sizes[i] + sizes[near.index])
            };
            let around: Vec<Neighbour> =
                search.nearest(i, AROUND).into_iter().filter(is_near).collect();
            self.bundle(&centres, &normals, &around, i)
        })
    }

    fn bundle(&self, centres: &[Vec3], normals: &[Vec3], around: &[Neighbour], i: usize) -> Smooth {
        let own = &self.found[i];
        let raw = (own.occlusion, own.variance);
        let Some(last) = around.last() else { return raw };
        let scale = 1.0 / (last.distance as f32).max(f32::MIN_POSITIVE);
        let (u, v) = normals[i].any_orthonormal_pair();
        let row = |place: usize| -> Row {
            let offset = (self.surfels.positions[place] - centres[i]) * scale;
            let normal = self.surfels.normals[place];
            let share = |sum: f32| 1.0 - (-sum).exp();
            [
                1.0,
                offset.dot(u),
                offset.dot(v),
                normal.dot(u),
                normal.dot(v),
                offset.dot(normals[i]),
                share(self.coverage.near[0][place]),
                share(self.coverage.near[1][place]),
                share(self.coverage.front[place] - self.coverage.near[0][place]),
                share(self.coverage.back[place] - self.coverage.near[1][place]),
            ]
        };
        let mut equations = Equations { matrix: [[0.0; N]; N], right: [0.0; N] };
        let mut rows: Vec<(Row, f32, f32)> = Vec::with_capacity((AROUND + 1) * 16);
        let (mut total, mut noise) = (0.0f32, 0.0f32);
        let all = around.iter().map(|near| (near.index, near.distance as f32 * scale));
        for (other, distance) in [(i, 0.0)].into_iter().chain(all) {
            let alike = (normals[other].dot(normals[i]) - ALIKE) / (1.0 - ALIKE);
            if alike <= 0.0 {
                continue;
            }
            let weight = alike.min(1.0) * (-distance * distance).exp();
            for (lane, place) in self.bundles[other].places().enumerate() {
                let (x, y) = (row(place), self.found[other].occlusion[lane]);
                equations.add(&x, y, weight);
                rows.push((x, y, weight));
                total += weight;
                noise += weight * self.found[other].variance;
            }
        }
        if rows.len() < 4 * N {
            return raw;
        }
        // A little of what pulls the slopes to zero keeps the equations regular.
        for k in 1..N {
            equations.matrix[k][k] += 1e-3 * total;
        }
        let Some(fit) = equations.solve() else { return raw };
        let value = |x: &Row| -> f32 { x.iter().zip(&fit).map(|(x, fit)| x * fit).sum() };
        // What is near says most of whether the fit holds here.
        let mut misfit = (0.0f32, 0.0f32);
        for (x, y, weight) in &rows {
            let weight = weight * weight;
            misfit = (misfit.0 + weight * (y - value(x)).powi(2), misfit.1 + weight);
        }
        let squares: f32 = rows.iter().map(|(_, _, weight)| weight * weight).sum();
        let lost = (TOGETHER * N as f32 * squares / (total * total)).min(0.8);
        let residual = misfit.0 / misfit.1 / (1.0 - lost);
        let noise = noise / total;
        let share = if residual > noise { noise / residual } else { 1.0 };
        let mut smooth = own.occlusion;
        for ((x, y, _), smooth) in rows.iter().zip(&mut smooth).take(self.bundles[i].n) {
            *smooth = (y + share * (value(x) - y)).clamp(0.0, 1.0);
        }
        let left = share * lost + (1.0 - share);
        (smooth, noise * left)
    }
}
