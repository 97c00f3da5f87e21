//! Greedy set cover: which of many regions are needed so that every sample is in one.

use super::context::{GrowthContext, Region};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use surfelshop_api::prelude::*;

/// What some regions of a pool hold together.
struct Coverage<'a> {
    context: &'a GrowthContext<'a>,
    pool: &'a [Region],
    /// Regions that each sample is in.
    n_holding: Vec<u32>,
}

impl<'a> Coverage<'a> {
    fn add(&mut self, i: usize) {
        self.pool[i].iter().for_each(|&sample| self.n_holding[sample as usize] += 1);
    }

    fn remove(&mut self, i: usize) {
        self.pool[i].iter().for_each(|&sample| self.n_holding[sample as usize] -= 1);
    }

    /// The area of a region's samples that so many regions hold.
    fn area(&self, i: usize, n_holding: u32) -> f64 {
        let samples = self.pool[i].iter().filter(|&&i| self.n_holding[i as usize] == n_holding);
        samples.map(|&i| self.context.samples.disc(i).powi(2)).sum()
    }
}

/// Regions that hold all samples that any of the pool holds: always the one that holds the largest area
/// that none before does. Then those are left out that are not needed.
pub(crate) fn choose(
    context: &GrowthContext<'_>,
    pool: &[Region],
    job: &Job<'_>,
) -> Result<Vec<usize>> {
    let mut held = Coverage { context, pool, n_holding: vec![0; context.samples.len()] };
    let mut chosen = Vec::new();
    // Bits of numbers that are not negative are in their order. Of equal ones the first is taken.
    let key = |gain: f64, i: usize| (gain.to_bits(), Reverse(i));
    let mut queue: BinaryHeap<(u64, Reverse<usize>)> =
        (0..pool.len()).map(|i| key(held.area(i, 0), i)).collect();
    let mut n_seen = 0usize;
    while let Some((bits, Reverse(i))) = queue.pop() {
        n_seen += 1;
        if n_seen.is_multiple_of(1024) {
            job.check()?;
        }
        // Others were chosen since, so that it may hold less by now.
        let now = held.area(i, 0);
        if now <= 0.0 {
            continue;
        }
        if now.to_bits() == bits {
            held.add(i);
            chosen.push(i);
        } else {
            queue.push(key(now, i));
        }
    }
    // The last hold least: what they hold may be held by larger ones on both sides by now.
    let mut needed = Vec::with_capacity(chosen.len());
    for i in chosen.into_iter().rev() {
        if held.area(i, 1) > 0.0 {
            needed.push(i);
        } else {
            held.remove(i);
        }
    }
    needed.reverse();
    Ok(needed)
}
