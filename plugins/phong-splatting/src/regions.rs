//! Growing the largest region around a sample that one plane stands in for.

use crate::colors::Colors;
use crate::creases;
use crate::finish::Outline;
use crate::graph::Graph;
use crate::plane::{Axes, Plane, STEEPEST, Shape};
use crate::samples::Samples;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::glam::DVec3;

/// What regions grow on, and how far.
pub(crate) struct Ground<'a> {
    pub(crate) samples: &'a Samples,
    pub(crate) graph: &'a Graph,
    /// Largest distance of a sample from its plane.
    pub(crate) tolerance: f64,
    /// Whether splats are cut where faces meet, so that a region may border on two lines at most.
    pub(crate) clip: bool,
    /// Colours that must be alike in a region, where there are any.
    colors: Option<Colors>,
    desks: Mutex<Vec<Desk>>,
}

/// What a thread works with; made once, since a row for every sample takes longer than a region.
struct Desk {
    /// The last region that each sample was seen by.
    seen: Vec<u32>,
    region: u32,
    border: BinaryHeap<Reverse<(u64, u32)>>,
    /// Samples, those nearest to the seed first.
    order: Vec<u32>,
}

impl Desk {
    /// Nothing is seen yet.
    fn start(&mut self) {
        self.region = self.region.wrapping_add(1);
        if self.region == 0 {
            self.seen.fill(0);
            self.region = 1;
        }
        self.order.clear();
        self.border.clear();
    }

    /// Puts a sample in the order where it is seen for the first time.
    fn visit(&mut self, sample: u32) {
        let seen = &mut self.seen[sample as usize];
        if *seen != self.region {
            *seen = self.region;
            self.order.push(sample);
        }
    }
}

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
/// have to be seen for each candidate.
const MOST: usize = 8192;

/// How much a region grows from one test of its plane to the next.
const STEP: f64 = 1.3;

impl<'a> Ground<'a> {
    pub(crate) fn new(samples: &'a Samples, graph: &'a Graph, tolerance: f64, clip: bool) -> Self {
        Self { samples, graph, tolerance, clip, colors: None, desks: Mutex::new(Vec::new()) }
    }

    /// This, where regions end at colours too.
    pub(crate) fn with_colors(self, colors: Option<Colors>) -> Self {
        Self { colors, ..self }
    }

    /// The region about a sample, which is its first: connected, within the tolerance of one plane,
    /// and as large as it gets in an ellipse of the shape that suits the curvature there.
    pub(crate) fn region(&self, seed: u32) -> Vec<u32> {
        let mut desk = self.desk();
        let normal = self.samples.normal(seed);
        let at = self.samples.point(seed);
        let axes = Axes::across(normal);
        let mut metric = Metric { at, axes, stretch: [1.0; 2], normal };
        self.grow(&mut desk, seed, &metric);
        let mut best = desk.order.clone();
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
            self.grow(&mut desk, seed, &metric);
            let is_better = desk.order.len() > best.len();
            if is_better {
                best.clone_from(&desk.order);
            }
            if !is_better || metric.stretch[0].max(metric.stretch[1]) < 1.5 {
                break;
            }
        }
        self.give_back(desk);
        best
    }

    /// Samples under or above an ellipse, or within `margin` of it, that are connected to the ones it
    /// holds and on its side.
    pub(crate) fn under(&self, outline: &Outline, held: &[u32], margin: f64) -> Vec<u32> {
        let mut desk = self.desk();
        desk.start();
        let wide = (outline.ellipse.half + margin) / outline.ellipse.half;
        held.iter().for_each(|&i| desk.visit(i));
        let mut next = 0;
        while let Some(&sample) = desk.order.get(next) {
            next += 1;
            for &other in self.graph.joined.of(sample) {
                let at = outline.of(self.samples.point(other)) / wide;
                let is_here = at.length_squared() <= 1.0;
                if is_here && outline.plane.normal.dot(self.samples.normal(other)) > 0.0 {
                    desk.visit(other);
                }
            }
        }
        let found = desk.order.clone();
        self.give_back(desk);
        found
    }

    fn desk(&self) -> Desk {
        let known = self.desks.lock().unwrap_or_else(PoisonError::into_inner).pop();
        known.unwrap_or_else(|| Desk {
            seen: vec![0; self.samples.len()],
            region: 0,
            border: BinaryHeap::new(),
            order: Vec::new(),
        })
    }

    fn give_back(&self, desk: Desk) {
        self.desks.lock().unwrap_or_else(PoisonError::into_inner).push(desk);
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

    /// Leaves in the desk's order the samples of the largest region.
    fn grow(&self, desk: &mut Desk, seed: u32, metric: &Metric) {
        desk.start();
        desk.border.push(Reverse((0, seed)));
        desk.seen[seed as usize] = desk.region;
        let (mut good, mut next) = (1, 2);
        while let Some(Reverse((_, sample))) = desk.border.pop() {
            desk.order.push(sample);
            if desk.order.len() >= next {
                if !self.holds(&desk.order) {
                    break;
                }
                good = desk.order.len();
                next = (good + 1).max((good as f64 * STEP) as usize);
            }
            if desk.order.len() >= MOST {
                break;
            }
            for &other in self.graph.joined.of(sample) {
                if desk.seen[other as usize] != desk.region {
                    desk.seen[other as usize] = desk.region;
                    if metric.normal.dot(self.samples.normal(other)) > 0.0 {
                        let key = metric.distance(self.samples.point(other)).to_bits();
                        desk.border.push(Reverse((key, other)));
                    }
                }
            }
        }
        // Between the last that held and what there is now.
        let mut bad = desk.order.len() + 1;
        while good + 1 < bad {
            let middle = usize::midpoint(good, bad);
            if self.holds(&desk.order[..middle]) { good = middle } else { bad = middle }
        }
        desk.order.truncate(good);
    }

    /// Whether one splat may stand in for samples.
    fn holds(&self, members: &[u32]) -> bool {
        let plane = Plane::fit(self.samples, members);
        plane.height <= self.tolerance
            && plane.least_cosine >= STEEPEST
            && self.colors.as_ref().is_none_or(|colors| colors.are_alike(members))
            && (!self.clip || creases::can_cut(self, &plane, members))
    }
}

/// Most rounds of growing with a shape that follows from the one before.
const ROUNDS: usize = 3;
