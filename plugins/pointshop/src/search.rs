//! Nearest points of a set to any place, in f64, by a k-d tree.

use std::ops::{ControlFlow, Range};
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;

/// Points that a search goes through one by one.
const LEAF: usize = 8;

/// Points below which a part of the tree is built between two questions whether to stop.
const QUESTION: usize = 1 << 15;

/// A point that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    /// Squared distance.
    pub(crate) squared: f64,
    /// Position of the point in the list that the tree was built from.
    pub(crate) index: u32,
}

/// The tree: the middle point of a range of `order` divides the range along the axis stored at it.
pub(crate) struct Search {
    order: Vec<u32>,
    /// The points in that order.
    points: Vec<DVec3>,
    axes: Vec<u8>,
}

impl Search {
    /// Builds the tree: O(n log n). Points that are not finite are in nobody's surroundings.
    ///
    /// # Errors
    /// Where the job is to stop.
    pub(crate) fn build(points: &[DVec3], job: &Job<'_>) -> Result<Self> {
        job.check()?;
        let finite = (0u32..).zip(points).filter(|(_, point)| point.is_finite());
        let mut order: Vec<u32> = finite.map(|(index, _)| index).collect();
        let mut axes = vec![0; order.len()];
        let mut open = Vec::from([(0, order.len())]);
        while let Some((start, end)) = open.pop() {
            let range = start..end;
            if range.len() <= LEAF {
                continue;
            }
            if range.len() > QUESTION {
                job.check()?;
            }
            let part = &mut order[range.clone()];
            let axis = widest(part.iter().map(|&index| points[index as usize]));
            let middle = part.len() / 2;
            part.select_nth_unstable_by(middle, |&a, &b| {
                let (x, y) = (points[a as usize][axis], points[b as usize][axis]);
                x.total_cmp(&y).then(a.cmp(&b))
            });
            let middle = range.start + middle;
            axes[middle] = axis as u8;
            open.extend([(range.start, middle), (middle + 1, range.end)]);
        }
        let points = order.iter().map(|&index| points[index as usize]).collect();
        Ok(Self { order, points, axes })
    }

    /// The `k` nearest points within a distance, nearest first, ties by index.
    pub(crate) fn nearest(&self, at: DVec3, k: usize, reach: f64) -> Vec<Found> {
        let mut found: Vec<Found> = Vec::with_capacity(k + 1);
        let mut most = reach * reach;
        self.visit(at, &mut most, &mut |candidate, most| {
            let after =
                |other: &Found| (other.squared, other.index) > (candidate.squared, candidate.index);
            if found.len() == k && !found.last().is_some_and(after) {
                return ControlFlow::Continue(());
            }
            let place = found.partition_point(|other| !after(other));
            found.insert(place, candidate);
            found.truncate(k);
            if found.len() == k {
                *most = found.last().map_or(*most, |last| last.squared);
            }
            ControlFlow::Continue(())
        });
        found
    }

    /// The nearest point; `None` where there are none.
    pub(crate) fn closest(&self, at: DVec3) -> Option<Found> {
        self.nearest(at, 1, f64::INFINITY).first().copied()
    }

    /// All points within a distance, in no order that matters.
    pub(crate) fn within(&self, at: DVec3, reach: f64, mut visit: impl FnMut(Found)) {
        let mut most = reach * reach;
        self.visit(at, &mut most, &mut |found, _| {
            visit(found);
            ControlFlow::Continue(())
        });
    }

    /// Whether any point within a distance fits.
    pub(crate) fn any(&self, at: DVec3, reach: f64, fits: impl Fn(Found) -> bool) -> bool {
        let mut most = reach * reach;
        let mut any = false;
        self.visit(at, &mut most, &mut |found, _| {
            any = fits(found);
            if any { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        any
    }

    /// Visits the points within a squared distance, which the visitor may lower.
    fn visit(
        &self,
        at: DVec3,
        most: &mut f64,
        visitor: &mut dyn FnMut(Found, &mut f64) -> ControlFlow<()>,
    ) {
        // Each entry: a range and the squared distance of its half space.
        let mut open: Vec<(Range<usize>, f64)> = Vec::with_capacity(64);
        open.push((0..self.order.len(), 0.0));
        while let Some((range, away)) = open.pop() {
            if away > *most {
                continue;
            }
            if range.len() <= LEAF {
                for place in range {
                    if self.meet(place, at, most, visitor).is_break() {
                        return;
                    }
                }
                continue;
            }
            let middle = range.start + range.len() / 2;
            if self.meet(middle, at, most, visitor).is_break() {
                return;
            }
            let axis = usize::from(self.axes[middle]);
            let offset = at[axis] - self.points[middle][axis];
            let (low, high) = (range.start..middle, middle + 1..range.end);
            let (near, far) = if offset < 0.0 { (low, high) } else { (high, low) };
            open.push((far, away.max(offset * offset)));
            open.push((near, away));
        }
    }

    fn meet(
        &self,
        place: usize,
        at: DVec3,
        most: &mut f64,
        visitor: &mut dyn FnMut(Found, &mut f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let squared = self.points[place].distance_squared(at);
        if squared <= *most {
            return visitor(Found { squared, index: self.order[place] }, most);
        }
        ControlFlow::Continue(())
    }
}

/// The axis along which points spread most.
fn widest(points: impl Iterator<Item = DVec3>) -> usize {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (min, max) = points.fold(start, |(min, max), p| (min.min(p), max.max(p)));
    let size = max - min;
    if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) }
}
