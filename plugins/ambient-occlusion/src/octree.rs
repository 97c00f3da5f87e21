//! Form factors from a hierarchy: distant nodes stand in for their surfels.

use crate::form_factor::{Reach, Receivers, Sums, single};
use crate::hierarchy::{Hierarchy, Moments};
use crate::lanes::on_best;
use std::f32::consts::PI;
use std::ops::Range;
use surfelshop_api::glam::Vec3;

/// A node is never taken whole from nearer than this many times its radius, whatever the tolerance:
/// the moments expand about its centre, which means nothing from inside of it.
const NEAREST: f32 = 1.25;

/// What the node criterion knows of a group of receivers.
struct Group {
    centre: Vec3,
    radius: f32,
}

impl Group {
    fn of(positions: &[Vec3]) -> Self {
        let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let centre = 0.5 * (low + high);
        let radius = positions.iter().map(|p| p.distance(centre)).fold(0.0, f32::max);
        Self { centre, radius }
    }

    /// Whether all of a node is too far away to count.
    fn is_beyond(&self, node: &Moments, reach: Reach) -> bool {
        let nearest = node.centre.distance(self.centre) - self.radius - node.radius;
        nearest > 0.0 && nearest * nearest >= reach.distance_squared
    }

    /// Whether a node may stand in for its surfels: its form factor times the square of its angular
    /// radius bounds what it leaves out.
    fn takes(&self, node: &Moments, tolerance: f32, reach: Reach) -> bool {
        let nearest = node.centre.distance(self.centre) - self.radius;
        if nearest <= NEAREST * node.radius {
            return false;
        }
        // Whether a node at the edge of what counts is inside is for its surfels to say.
        let limit = reach.distance;
        if nearest + 2.0 * self.radius + node.radius > limit && nearest - node.radius < limit {
            return false;
        }
        let squared = nearest * nearest;
        let factor = node.weight / (PI * squared);
        factor * (node.radius * node.radius / squared) <= tolerance
    }
}

/// What the hierarchy covers of the sky of at most sixteen receivers.
pub(crate) fn gather(
    hierarchy: &Hierarchy<'_>,
    places: Range<usize>,
    tolerance: f32,
    reach: Reach,
) -> [Sums; 2] {
    on_best(
        #[inline(always)]
        || {
            let surfels = hierarchy.surfels;
            let receivers = Receivers::of(surfels, places.clone());
            let group = Group::of(&surfels.positions[places]);
            let nodes = surfels.tree.nodes();
            let (mut near, mut far) = (Sums::ZERO, Sums::ZERO);
            let mut open = Vec::with_capacity(64);
            open.push(0u32);
            while let Some(next) = open.pop() {
                let (node, moments) = (&nodes[next as usize], &hierarchy.moments[next as usize]);
                if moments.weight <= 0.0 || group.is_beyond(moments, reach) {
                    continue;
                }
                if group.takes(moments, tolerance, reach) {
                    far.add(moments.cast(&receivers, reach));
                } else if node.children.is_empty() {
                    let range = node.surfels.start as usize..node.surfels.end as usize;
                    for emitter in &hierarchy.emitters[range] {
                        near.add(single(&receivers, emitter, reach));
                    }
                } else {
                    open.extend(node.children.clone());
                }
            }
            [near, far]
        },
    )
}
