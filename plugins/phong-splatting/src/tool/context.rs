//! What regions grow on: the samples, their graph, and the limits of a region; with a pool of scratch memory.

use super::colors::Colors;
use super::graph::Graph;
use super::samples::Samples;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Mutex, PoisonError};

/// Samples that one splat can stand for; the first is where it grew from.
pub(crate) type Region = Vec<u32>;

/// What regions grow on, and how far.
pub(crate) struct GrowthContext<'a> {
    pub(crate) samples: &'a Samples,
    pub(crate) graph: &'a Graph,
    /// Largest distance of a sample from its plane.
    pub(crate) tolerance: f64,
    /// Whether splats are cut where faces meet, so that a region may border on two lines at most.
    pub(crate) clip: bool,
    /// Colours that must be alike in a region, where there are any.
    pub(super) colors: Option<Colors>,
    scratch_pool: Mutex<Vec<Scratch>>,
}

/// What a thread works with; made once, since a row for every sample takes longer than a region.
pub(super) struct Scratch {
    /// The last region that each sample was visited by.
    pub(super) visited: Vec<u32>,
    pub(super) region: u32,
    pub(super) border: BinaryHeap<Reverse<(u64, u32)>>,
    /// Samples, those nearest to the seed first.
    pub(super) order: Vec<u32>,
}

impl Scratch {
    /// Nothing is visited yet.
    pub(super) fn start(&mut self) {
        self.region = self.region.wrapping_add(1);
        if self.region == 0 {
            self.visited.fill(0);
            self.region = 1;
        }
        self.order.clear();
        self.border.clear();
    }

    /// Puts a sample in the order where it is visited for the first time.
    pub(super) fn visit(&mut self, sample: u32) {
        let visited = &mut self.visited[sample as usize];
        if *visited != self.region {
            *visited = self.region;
            self.order.push(sample);
        }
    }
}

impl<'a> GrowthContext<'a> {
    pub(crate) fn new(samples: &'a Samples, graph: &'a Graph, tolerance: f64, clip: bool) -> Self {
        Self { samples, graph, tolerance, clip, colors: None, scratch_pool: Mutex::new(Vec::new()) }
    }

    /// This, where regions end at colours too.
    pub(crate) fn with_colors(self, colors: Option<Colors>) -> Self {
        Self { colors, ..self }
    }

    /// The working memory of a thread, which it gives back.
    pub(super) fn take_scratch(&self) -> Scratch {
        let known = self.scratch_pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        known.unwrap_or_else(|| Scratch {
            visited: vec![0; self.samples.len()],
            region: 0,
            border: BinaryHeap::new(),
            order: Vec::new(),
        })
    }

    pub(super) fn return_scratch(&self, scratch: Scratch) {
        self.scratch_pool.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}
