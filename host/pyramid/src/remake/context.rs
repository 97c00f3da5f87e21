//! What is around a part: the surfels close by, and merged ones for all others.

use crate::error::PyramidError;
use crate::index::chunk::{FEW, HALO, MOST_AROUND};
use crate::pyramid::Pyramid;
use glam::DVec3;
use std::collections::BinaryHeap;
use surfelshop_api::Scope;
use surfelshop_api::columns::RADIUS;
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column};
use surfelshop_geometry::Bounds;

/// The radius of merged surfels by their distance, at most, where memory allows: 2.4 degrees of the sky, far less than
/// what its occlusion is spread over.
const FAR: f64 = 1.0 / 24.0;

/// How far a place lies outside of a box, along the axis in which it is farthest.
pub(super) fn away(bounds: &Bounds, place: DVec3) -> f64 {
    (bounds.min - place).max(place - bounds.max).max(DVec3::ZERO).max_element()
}

/// Surfels around a part of so many in a box.
pub(super) fn around(
    pyramid: &Pyramid,
    part: u32,
    (bounds, n_own): (Bounds, usize),
    scope: Scope,
) -> Result<Vec<Cloud>, PyramidError> {
    if matches!(scope, Scope::Surfel | Scope::Cloud) {
        return Ok(Vec::new());
    }
    let side = (bounds.max - bounds.min).max_element();
    let reach = match n_own {
        0..FEW => side,
        n => (HALO * side / (n as f64).sqrt()).min(side),
    };
    let most = FEW.max(n_own / MOST_AROUND);
    let mut context = Context { pyramid, part, bounds, reach, most };
    let mut found = context.near()?;
    if scope == Scope::Scene {
        found.extend(context.far()?);
    }
    Ok(found)
}

struct Context<'a> {
    pyramid: &'a Pyramid,
    part: u32,
    bounds: Bounds,
    /// Up to here surfels are as they are.
    reach: f64,
    most: usize,
}

/// A node and how coarse it is, the coarsest first.
#[derive(PartialEq)]
struct Coarse(f64, u32);

impl Eq for Coarse {}

impl PartialOrd for Coarse {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Coarse {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

fn masked(cloud: &Cloud, mask: &[bool]) -> Result<Cloud, PyramidError> {
    let kept = cloud.keep(mask);
    kept.map_err(|error: CloudError| PyramidError::Points(error.to_string()))
}

/// The surfels that stand for so many each.
fn enlarged(cloud: Cloud, one_of: usize) -> Result<Cloud, PyramidError> {
    if one_of < 2 {
        return Ok(cloud);
    }
    let factor = (one_of as f32).sqrt();
    let radii = cloud.radii().iter().map(|radius| radius * factor).collect();
    let radii = Column::new(RADIUS, 1, Buffer::F32(radii));
    let enlarged = cloud.with_columns(vec![radii]);
    enlarged.map_err(|error| PyramidError::Points(error.to_string()))
}

impl Context<'_> {
    /// How far away all of a node is at least.
    fn distance(&self, node: u32) -> f64 {
        let record = &self.pyramid.nodes()[node as usize];
        // No coordinate of a difference exceeds its length.
        (away(&self.bounds, record.middle) - f64::from(record.spread)).max(0.0)
    }

    fn aways(&self, cloud: &Cloud) -> Vec<f64> {
        let at = |p: &glam::Vec3| away(&self.bounds, cloud.origin() + p.as_dvec3());
        cloud.positions().iter().map(at).collect()
    }

    /// The nearest surfels, and how far they reach where there are too many.
    fn near(&mut self) -> Result<Vec<Cloud>, PyramidError> {
        let mut found: Vec<(Cloud, Vec<f64>)> = Vec::new();
        let mut open = vec![0u32];
        while let Some(node) = open.pop() {
            if node == self.part || self.distance(node) > self.reach {
                continue;
            }
            let record = &self.pyramid.nodes()[node as usize];
            let [first, count] = record.children;
            if count > 0 {
                open.extend((first..first + count).rev());
                continue;
            }
            let leaf = self.pyramid.read(node)?;
            let aways = self.aways(&leaf);
            let mask: Vec<bool> = aways.iter().map(|&away| away <= self.reach).collect();
            let aways: Vec<f64> = aways.into_iter().filter(|&away| away <= self.reach).collect();
            found.push((masked(&leaf, &mask)?, aways));
            if found.iter().map(|(_, aways)| aways.len()).sum::<usize>() > 2 * self.most {
                self.trim(&mut found)?;
            }
        }
        self.trim(&mut found)?;
        Ok(found.into_iter().map(|(cloud, _)| cloud).filter(|cloud| !cloud.is_empty()).collect())
    }

    /// Keeps the nearest.
    fn trim(&mut self, found: &mut [(Cloud, Vec<f64>)]) -> Result<(), PyramidError> {
        let mut all: Vec<f64> = found.iter().flat_map(|(_, aways)| aways).copied().collect();
        if all.len() <= self.most {
            return Ok(());
        }
        let (_, &mut last, _) = all.select_nth_unstable_by(self.most, f64::total_cmp);
        self.reach = self.reach.min(last);
        for (cloud, aways) in found {
            let mask: Vec<bool> = aways.iter().map(|&away| away <= self.reach).collect();
            *cloud = masked(cloud, &mask)?;
            aways.retain(|&away| away <= self.reach);
        }
        Ok(())
    }

    /// Merged surfels for all that lies beyond the reach: as fine as `FAR` asks, where they are not too many.
    fn far(&self) -> Result<Vec<Cloud>, PyramidError> {
        let nodes = self.pyramid.nodes();
        let n = |node: u32| nodes[node as usize].n_surfels as usize;
        let coarse = |node: u32| {
            let record = &nodes[node as usize];
            let error = f64::from(record.grain) / self.distance(node).max(self.reach);
            Coarse(if record.is_leaf() { 0.0 } else { error }, node)
        };
        // Nodes above the part have it in them, and are never taken.
        let mut is_above = vec![self.part];
        is_above.extend(self.pyramid.above(self.part));
        let mut open = BinaryHeap::new();
        for &above in is_above.iter().skip(1) {
            let [first, count] = nodes[above as usize].children;
            let others = (first..first + count).filter(|child| !is_above.contains(child));
            open.extend(others.map(coarse));
        }
        let mut n_taken: usize = open.iter().map(|Coarse(_, node)| n(*node)).sum();
        let mut taken = Vec::new();
        while let Some(Coarse(error, node)) = open.pop() {
            let [first, count] = nodes[node as usize].children;
            let finer: usize = (first..first + count).map(n).sum();
            // What does not reach beyond is left out further down.
            if count == 0 || error <= FAR || n_taken - n(node) + finer > self.most.max(n_taken) {
                taken.push(node);
                continue;
            }
            n_taken = n_taken - n(node) + finer;
            open.extend((first..first + count).map(coarse));
        }
        taken.sort_unstable();
        // Where even the coarsest are too many for the memory, some stand for all.
        let one_of = n_taken.div_ceil(self.most).max(1);
        let mut found = Vec::with_capacity(taken.len());
        for node in taken {
            let cloud = self.pyramid.read(node)?;
            let aways = self.aways(&cloud);
            let is_far = |i: usize| i.is_multiple_of(one_of) && aways[i] > self.reach;
            let mask: Vec<bool> = (0..cloud.len()).map(is_far).collect();
            found.push(enlarged(masked(&cloud, &mask)?, one_of)?);
        }
        found.retain(|cloud| !cloud.is_empty());
        Ok(found)
    }
}
