//! Set cover: choosing few regions that together hold every sample.

use super::context::{GrowthContext, Region};
use super::greedy_cover;
use super::normal_field;
use super::outline::{Outline, Splat};
use super::ruin_recreate;
use super::samples::within;
use super::splat_fit;
use std::ops::Range;
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;
use surfelshop_geometry::hashing::scattered;

/// Regions that every sample is in, or it is the seed of one, before regions are chosen.
const CHOICE: u16 = 16;

/// Share of the progress that is growing the regions to choose from, where there are rounds after it.
const GROWING: f64 = 0.6;

/// Splats that hold every sample, from regions that were moved `rounds` times.
pub(crate) fn cover(
    context: &GrowthContext<'_>,
    rounds: u32,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Vec<Splat>> {
    job.progress(share.start, "growing splats");
    let grown = within(&share, GROWING);
    let mut pool = candidates(context, share.start..grown, job)?;
    job.check()?;
    let mut best = greedy_cover::choose(context, &pool, job)?;
    let step = (within(&share, 0.9) - grown) / f64::from(rounds.max(1));
    for round in 0..rounds {
        let start = grown + step * f64::from(round);
        job.progress(start, "moving splats");
        let moved = moved(context, &pool, &best, start..start + step, job)?;
        pool.extend(moved);
        // To choose anew among more finds fewer at times, and to exchange some always finds no more.
        let anew = greedy_cover::choose(context, &pool, job)?;
        let next = if anew.len() < best.len() { anew } else { best };
        best = ruin_recreate::exchange(context, &pool, &next, round, job)?;
    }
    let regions: Vec<Region> = best.into_iter().map(|i| std::mem::take(&mut pool[i])).collect();
    drop(pool);
    job.progress(within(&share, 0.9), "fitting ellipses and normals");
    finished(context, &regions, within(&share, 0.9)..share.end, job)
}

/// Regions from seeds in an order that has nothing to do with that of the samples, until all samples
/// are in enough of them.
fn candidates(
    context: &GrowthContext<'_>,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Vec<Region>> {
    let n = context.samples.len();
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by_cached_key(|&i| scattered(u64::from(i)));
    let mut n_holding = vec![0u16; n];
    let mut found: Vec<Region> = Vec::new();
    let (mut next, mut n_held) = (0, 0usize);
    while next < n {
        // As many as hold a part of all samples together, by what regions held so far.
        let size = if found.is_empty() { 512 } else { n_held / found.len() + 1 };
        let most = (n / (4 * size)).clamp(32, 8192);
        let mut seeds = Vec::with_capacity(most);
        let started = next;
        while next < n && seeds.len() < most {
            let seed = order[next];
            next += 1;
            if n_holding[seed as usize] < CHOICE {
                seeds.push(seed);
            }
        }
        let part = |at: usize| within(&share, at as f64 / n as f64);
        let grown =
            job.map(seeds.len(), part(started)..part(next), |i| context.region(seeds[i]))?;
        for region in grown {
            for &i in &region {
                n_holding[i as usize] = n_holding[i as usize].saturating_add(1);
            }
            n_held += region.len();
            found.push(region);
        }
    }
    Ok(found)
}

/// For each region the samples that it is the nearest to, in units of its half axes.
fn cells(context: &GrowthContext<'_>, regions: &[&Region], outlines: &[Outline]) -> Vec<Vec<u32>> {
    let n = context.samples.len();
    let mut nearest = vec![(f64::INFINITY, u32::MAX); n];
    for (number, (region, outline)) in regions.iter().zip(outlines).enumerate() {
        for &i in *region {
            let distance = outline.of(context.samples.point(i)).length_squared();
            if distance < nearest[i as usize].0 || nearest[i as usize].1 == u32::MAX {
                nearest[i as usize] = (distance, number as u32);
            }
        }
    }
    let mut cells = vec![Vec::new(); regions.len()];
    for (i, &(_, number)) in nearest.iter().enumerate() {
        if let Some(cell) = cells.get_mut(number as usize) {
            cell.push(i as u32);
        }
    }
    cells
}

/// Regions grown anew from the middle of what each chosen one is the nearest to.
fn moved(
    context: &GrowthContext<'_>,
    pool: &[Region],
    chosen: &[usize],
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Vec<Region>> {
    let middle = within(&share, 0.3);
    let regions: Vec<&Region> = chosen.iter().map(|&i| &pool[i]).collect();
    let outlines =
        job.map(regions.len(), share.start..middle, |i| splat_fit::whole(context, regions[i]))?;
    let cells = cells(context, &regions, &outlines);
    let samples = context.samples;
    let seeds: Vec<Option<u32>> = cells
        .iter()
        .map(|cell| {
            let sum: DVec3 = cell.iter().map(|&i| samples.point(i)).sum();
            let mean = sum / cell.len().max(1) as f64;
            let distance = |&i: &u32| samples.point(i).distance_squared(mean);
            cell.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)))
        })
        .collect();
    let grown =
        job.map(seeds.len(), middle..share.end, |i| seeds[i].map(|seed| context.region(seed)))?;
    Ok(grown.into_iter().flatten().collect())
}

/// The splats of regions, each as large as the samples it is the nearest to ask for.
fn finished(
    context: &GrowthContext<'_>,
    regions: &[Region],
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<Vec<Splat>> {
    let (middle, last) = (within(&share, 0.45), within(&share, 0.95));
    let outlines =
        job.map(regions.len(), share.start..middle, |i| splat_fit::whole(context, &regions[i]))?;
    let all: Vec<&Region> = regions.iter().collect();
    let cells = cells(context, &all, &outlines);
    let used: Vec<usize> = (0..regions.len()).filter(|&i| !cells[i].is_empty()).collect();
    let found = job.map(used.len(), middle..last, |i| {
        splat_fit::splats(context, &regions[used[i]], &cells[used[i]])
    })?;
    let mut holder = vec![0u32; context.samples.len()];
    let mut splats = Vec::with_capacity(found.len());
    for (splat, held) in found.into_iter().flatten() {
        held.iter().for_each(|&sample| holder[sample as usize] = splats.len() as u32);
        splats.push(splat);
    }
    normal_field::steady(splats.iter_mut().map(|splat| (&mut splat.field, &splat.fit)));
    let moves = job.map(splats.len(), last..share.end, |i| {
        let others = |sample: u32| &splats[holder[sample as usize] as usize].outline.plane;
        splat_fit::moves(context, &splats[i], others)
    })?;
    for (splat, moves) in splats.iter_mut().zip(moves) {
        for (met, outwards) in splat.cut.lines.iter_mut().zip(moves) {
            met.line.offset += outwards;
        }
    }
    Ok(splats)
}
