//! Regions of free space: fronts that see each other.

use super::rays::{Ray, Sky};
use crate::normals::signs::{Coupling, SignedSets, gathered};
use crate::progress::{Cancelled, Progress, part};
use std::collections::BTreeMap;

/// Rounds in which groups take the region of most that they see.
const ROUNDS: usize = 12;

/// Share of what a region sees that lies in another region from which on they are one: more than
/// gaps between discs let through, less than a door does.
const CONNECTED: f64 = 0.03;

/// Share of the largest region's surfels below which a region is small.
const SMALL: f64 = 0.2;

/// Share of the surfels whose side, the front or the back, is in a small region of sides that see each
/// other: one within a thing, if the front is in front. `member` has the group of each surfel, and after them of each part of the sky.
///
/// Regions grow by label propagation: Raghavan et al. 2007.
pub(super) fn small(
    (member, n_groups): (&[(u32, bool)], usize),
    rays: &[Ray],
    signs: &[bool],
    front: bool,
    progress: Progress<'_>,
) -> Result<f64, Cancelled> {
    let n_surfels = member.len() - Sky::PARTS;
    // All of the sky is one place.
    let sky = n_groups as u32;
    let mut groups: Vec<(u32, bool)> = member[..n_surfels].to_vec();
    groups.resize(member.len(), (sky, false));
    let is_on_side = |ray: &&Ray| {
        (ray.to as usize) < member.len()
            && (ray.leaves_front == signs[ray.from as usize]) == front
            && (ray.arrives_front == signs[ray.to as usize]) == front
    };
    let seen = rays.iter().filter(is_on_side).map(|ray| {
        let weight = i64::from(ray.weight);
        Coupling { a: ray.from, b: ray.to, net: weight, total: weight }
    });
    let couplings = gathered(seen, &groups, &part(progress, 0.0..0.6))?;
    let labels = propagated(n_groups + 1, &couplings);
    let region = connected(n_groups + 1, &couplings, &labels);
    let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
    let mut sees_any = vec![false; n_groups + 1];
    for coupling in &couplings {
        sees_any[coupling.a as usize] = true;
        sees_any[coupling.b as usize] = true;
    }
    let known = groups[..n_surfels].iter().filter(|group| sees_any[group.0 as usize]);
    let mut count = 0;
    for &(group, _) in known {
        *sizes.entry(region[group as usize]).or_default() += 1;
        count += 1;
    }
    let largest = sizes.values().copied().max().unwrap_or(0) as f64;
    let is_small = |size: &usize| (*size as f64) < SMALL * largest;
    let small: usize = sizes.into_values().filter(is_small).sum();
    Ok(small as f64 / f64::from(count.max(1)))
}

/// For each group the group whose label it took.
fn propagated(count: usize, couplings: &[Coupling]) -> Vec<u32> {
    let mut around: Vec<Vec<(u32, i64)>> = vec![Vec::new(); count];
    for coupling in couplings {
        around[coupling.a as usize].push((coupling.b, coupling.total));
        around[coupling.b as usize].push((coupling.a, coupling.total));
    }
    let mut labels: Vec<u32> = (0..count as u32).collect();
    let mut votes = vec![0i64; count];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for group in 0..count {
            for &(other, weight) in &around[group] {
                votes[labels[other as usize] as usize] += weight;
            }
            let label = |&(other, _): &(u32, i64)| labels[other as usize];
            let best = around[group].iter().map(label).max_by_key(|&l| (votes[l as usize], !l));
            for &(other, _) in &around[group] {
                votes[labels[other as usize] as usize] = 0;
            }
            if let Some(best) = best.filter(|&best| best != labels[group]) {
                labels[group] = best;
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    labels
}

/// For each group its region: labels that see enough of each other are one.
fn connected(count: usize, couplings: &[Coupling], labels: &[u32]) -> Vec<u32> {
    let mut all = vec![0i64; count];
    let mut between: BTreeMap<(u32, u32), i64> = BTreeMap::new();
    for coupling in couplings {
        let (a, b) = (labels[coupling.a as usize], labels[coupling.b as usize]);
        all[a as usize] += coupling.total;
        all[b as usize] += coupling.total;
        if a != b {
            *between.entry((a.min(b), a.max(b))).or_default() += coupling.total;
        }
    }
    let mut sets = SignedSets::new(count);
    for (&(a, b), &weight) in &between {
        let less = all[a as usize].min(all[b as usize]);
        if weight as f64 > CONNECTED * less as f64 {
            sets.join(a, b, false, u32::MAX);
        }
    }
    labels.iter().map(|&label| sets.find(label).0).collect()
}
