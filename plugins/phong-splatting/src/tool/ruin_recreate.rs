//! Ruin and recreate: a few regions at a time are exchanged for fewer others.

use super::context::{GrowthContext, Region};
use super::graph::Lists;
use surfelshop_api::prelude::*;
use surfelshop_geometry::hashing::{fraction, scattered};

/// Passes: times that each region is taken out with some around it, in a round.
const PASSES: usize = 4;

/// Regions taken out together at most: enough that those put in instead can lie differently, and few
/// enough that chance finds fewer.
const TOGETHER: usize = 6;

/// How much chance plays a part in which regions are put in, as a share of what they hold.
const CHANCE: f64 = 0.25;

/// Units that the mean area of a sample is counted in: sums of whole numbers do not drift.
const PRECISION: f64 = 1024.0;

/// What is chosen, and what it holds.
struct Exchange<'a> {
    pool: &'a [Region],
    /// For each sample the regions of the pool that hold it.
    holders: Lists,
    areas: Vec<u64>,
    n_holding: Vec<u32>,
    is_chosen: Vec<bool>,
    n_chosen: usize,
    /// For each region the area that it holds of what nothing else does; 0 between exchanges.
    gains: Vec<u64>,
}

/// At most as many regions that hold the same samples.
///
/// Source: the idea is "ruin and recreate", Schrimpf et al. 2000, "Record Breaking Optimization Results
/// Using the Ruin and Recreate Principle".
pub(crate) fn exchange(
    context: &GrowthContext<'_>,
    pool: &[Region],
    chosen: &[usize],
    round: u32,
    job: &Job<'_>,
) -> Result<Vec<usize>> {
    let n = context.samples.len();
    let square = |&disc: &f64| disc * disc;
    let mean = context.samples.discs.iter().map(square).sum::<f64>() / n.max(1) as f64;
    let units = |disc: &f64| ((square(disc) / mean * PRECISION) as u64).max(1);
    let mut work = Exchange {
        pool,
        holders: Lists::inverse(n, pool),
        areas: context.samples.discs.iter().map(units).collect(),
        n_holding: vec![0; n],
        is_chosen: vec![false; pool.len()],
        n_chosen: 0,
        gains: vec![0; pool.len()],
    };
    chosen.iter().for_each(|&i| work.add(i));
    for pass in 0..PASSES {
        let now: Vec<usize> = (0..pool.len()).filter(|&i| work.is_chosen[i]).collect();
        for (step, &i) in now.iter().enumerate() {
            if step.is_multiple_of(256) {
                job.check()?;
            }
            if work.is_chosen[i] {
                work.step(
                    i,
                    scattered((u64::from(round) << 48) ^ ((pass as u64) << 40) ^ i as u64),
                );
            }
        }
    }
    Ok((0..pool.len()).filter(|&i| work.is_chosen[i]).collect())
}

impl Exchange<'_> {
    fn add(&mut self, i: usize) {
        self.pool[i].iter().for_each(|&sample| self.n_holding[sample as usize] += 1);
        self.is_chosen[i] = true;
        self.n_chosen += 1;
    }

    fn remove(&mut self, i: usize) {
        self.pool[i].iter().for_each(|&sample| self.n_holding[sample as usize] -= 1);
        self.is_chosen[i] = false;
        self.n_chosen -= 1;
    }

    /// Takes out a region and some that it shares samples with, puts in what holds the most of what is uncovered
    /// then, and undoes it all where that takes more.
    fn step(&mut self, i: usize, seed: u64) {
        let before = self.n_chosen;
        let out = self.around(i, seed);
        out.iter().for_each(|&region| self.remove(region));
        let mut uncovered: Vec<u32> =
            out.iter().flat_map(|&region| &self.pool[region]).copied().collect();
        uncovered.retain(|&sample| self.n_holding[sample as usize] == 0);
        uncovered.sort_unstable();
        uncovered.dedup();
        let mut touched = Vec::new();
        let mut n_uncovered = uncovered.len();
        for &sample in &uncovered {
            for &region in self.holders.of(sample) {
                if self.gains[region as usize] == 0 {
                    touched.push(region);
                }
                self.gains[region as usize] += self.areas[sample as usize];
            }
        }
        let mut put_in = Vec::with_capacity(out.len());
        while n_uncovered > 0 && put_in.len() < out.len() {
            let worth = |&region: &u32| {
                let chance = fraction(scattered(seed ^ u64::from(region)));
                (self.gains[region as usize] as f64 * (1.0 - CHANCE * chance), region)
            };
            let best =
                touched.iter().map(worth).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let Some((_, best)) = best else { break };
            for &sample in &self.pool[best as usize] {
                if self.n_holding[sample as usize] == 0 {
                    n_uncovered -= 1;
                    for &region in self.holders.of(sample) {
                        self.gains[region as usize] -= self.areas[sample as usize];
                    }
                }
            }
            self.add(best as usize);
            put_in.push(best as usize);
        }
        touched.iter().for_each(|&region| self.gains[region as usize] = 0);
        if n_uncovered > 0 || self.n_chosen > before {
            put_in.iter().for_each(|&region| self.remove(region));
            out.iter().for_each(|&region| self.add(region));
        } else {
            self.leave_out_idle(&put_in);
        }
    }

    /// A region and some of the chosen ones that it shares samples with.
    fn around(&self, i: usize, seed: u64) -> Vec<usize> {
        let mut others: Vec<usize> = (self.pool[i].iter())
            .flat_map(|&sample| self.holders.of(sample))
            .map(|&region| region as usize)
            .filter(|&region| self.is_chosen[region] && region != i)
            .collect();
        others.sort_unstable();
        others.dedup();
        others.sort_by_key(|&region| scattered(seed ^ region as u64));
        others.truncate(TOGETHER - 1);
        others.push(i);
        others
    }

    /// Leaves out those around new regions that hold nothing alone any more.
    fn leave_out_idle(&mut self, put_in: &[usize]) {
        let samples = put_in.iter().flat_map(|&i| &self.pool[i]);
        let mut near: Vec<usize> = samples
            .flat_map(|&sample| self.holders.of(sample))
            .map(|&region| region as usize)
            .filter(|&region| self.is_chosen[region])
            .collect();
        near.sort_unstable();
        near.dedup();
        for i in near {
            if self.pool[i].iter().all(|&sample| self.n_holding[sample as usize] > 1) {
                self.remove(i);
            }
        }
    }
}
