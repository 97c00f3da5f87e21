//! Region growing: the largest region around a sample that one plane stands in for.

use super::context::{GrowthContext, Scratch};
use super::creases;
use super::outline::Outline;
use super::plane::{Axes, Plane, STEEPEST, Shape};
use std::cmp::Reverse;
use surfelshop_api::glam::DVec3;

/// How distance is measured while a region grows: an ellipse of unit area about a seed.
#[derive(Clone, Copy)]
struct Metric {
    at: DVec3,
    axes: Axes,
    stretch: [f64; 2],
    normal: DVec3,
}

impl Metric {
    /// Squared distance. What is above or below is at least as far as it would be in the plane.
    fn distance(&self, point: DVec3) -> f64 {
        let d = point - self.at;
        let flat = self.axes.of(d);
        let [u, v] = [flat.x / self.stretch[0], flat.y / self.stretch[1]];
        let up = self.normal.dot(d) / self.stretch[0].max(self.stretch[1]);
        u * u + v * v + up * up
    }
}

/// Ratio of the axes of an ellipse beyond which it is not stretched further: what curves one way only
/// would else become a needle, and blends badly with what is beside it.
const LONGEST: f64 = 4.0;

/// Most samples of a region. Flat parts are all within any tolerance, and each of their samples would
/// have to be visited for each candidate.
const MOST: usize = 8192;

/// How much a region grows from one test of its plane to the next.
const STEP: f64 = 1.3;

impl GrowthContext<'_> {
    /// The region about a sample, which is its first: connected, within the tolerance of one plane,
    /// and as large as it gets in an ellipse of the shape that suits the curvature there.
    pub(crate) fn region(&self, seed: u32) -> Vec<u32> {
        let mut scratch = self.take_scratch();
        let normal = self.samples.normal(seed);
        let at = self.samples.point(seed);
        let axes = Axes::across(normal);
        let mut metric = Metric { at, axes, stretch: [1.0; 2], normal };
        self.grow(&mut scratch, seed, &metric);
        let mut best = scratch.order.clone();
        // What a round region says of the curvature, and then what a longer one does.
        for _ in 0..ROUNDS {
            if best.len() < 6 {
                break;
            }
            let plane = Plane::fit(self.samples, &best);
            let shape = Shape::of(self.samples, &best, &plane);
            metric = Metric {
                at,
                axes: shape.axes,
                stretch: self.stretch(&shape),
                normal: plane.normal,
            };
            self.grow(&mut scratch, seed, &metric);
            let is_better = scratch.order.len() > best.len();
            if is_better {
                best.clone_from(&scratch.order);
            }
            if !is_better || metric.stretch[0].max(metric.stretch[1]) < 1.5 {
                break;
            }
        }
        self.return_scratch(scratch);
        best
    }

    /// Samples under or above an ellipse, or within `margin` of it, that are connected to the ones it
    /// holds and on its side.
    pub(crate) fn under(&self, outline: &Outline, held: &[u32], margin: f64) -> Vec<u32> {
        let mut scratch = self.take_scratch();
        scratch.start();
        let wide = (outline.ellipse.half + margin) / outline.ellipse.half;
        held.iter().for_each(|&i| scratch.visit(i));
        let mut next = 0;
        while let Some(&sample) = scratch.order.get(next) {
            next += 1;
            for &other in self.graph.joined.of(sample) {
                let at = outline.of(self.samples.point(other)) / wide;
                let is_here = at.length_squared() <= 1.0;
                if is_here && outline.plane.normal.dot(self.samples.normal(other)) > 0.0 {
                    scratch.visit(other);
                }
            }
        }
        let found = scratch.order.clone();
        self.return_scratch(scratch);
        found
    }

    /// Half axes at which heights are alike along both, of product 1: as one to the root of curvature.
    fn stretch(&self, shape: &Shape) -> [f64; 2] {
        // Curvature that matters little within the tolerance does not count, so that noise on a flat
        // part does not stretch anything.
        let least = 0.1 * self.tolerance / shape.spread.max(f64::MIN_POSITIVE);
        let [u, v] = shape.curvatures.map(|curvature| curvature.abs() + least);
        let root = (v / u).sqrt().clamp(1.0 / LONGEST, LONGEST).sqrt();
        [root, 1.0 / root]
    }

    /// Leaves in the scratch's order the samples of the largest region.
    fn grow(&self, scratch: &mut Scratch, seed: u32, metric: &Metric) {
        scratch.start();
        scratch.border.push(Reverse((0, seed)));
        scratch.visited[seed as usize] = scratch.region;
        let (mut good, mut next) = (1, 2);
        while let Some(Reverse((_, sample))) = scratch.border.pop() {
            scratch.order.push(sample);
            if scratch.order.len() >= next {
                if !self.fits(&scratch.order) {
                    break;
                }
                good = scratch.order.len();
                next = (good + 1).max((good as f64 * STEP) as usize);
            }
            if scratch.order.len() >= MOST {
                break;
            }
            for &other in self.graph.joined.of(sample) {
                if scratch.visited[other as usize] != scratch.region {
                    scratch.visited[other as usize] = scratch.region;
                    if metric.normal.dot(self.samples.normal(other)) > 0.0 {
                        let key = metric.distance(self.samples.point(other)).to_bits();
                        scratch.border.push(Reverse((key, other)));
                    }
                }
            }
        }
        // Between the last that fitted and what there is now.
        let mut bad = scratch.order.len() + 1;
        while good + 1 < bad {
            let middle = usize::midpoint(good, bad);
            if self.fits(&scratch.order[..middle]) { good = middle } else { bad = middle }
        }
        scratch.order.truncate(good);
    }

    /// Whether one splat may stand in for samples.
    fn fits(&self, members: &[u32]) -> bool {
        let plane = Plane::fit(self.samples, members);
        plane.height <= self.tolerance
            && plane.least_cosine >= STEEPEST
            && self.colors.as_ref().is_none_or(|colors| colors.are_alike(members))
            && (!self.clip || creases::can_cut(self, &plane, members))
    }
}

/// Most rounds of growing with a shape that follows from the one before.
const ROUNDS: usize = 3;
