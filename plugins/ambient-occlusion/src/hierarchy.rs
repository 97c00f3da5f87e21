//! What the surfels of each node of the octree cast together.
//!
//! A distant node stands in for its surfels. The thesis takes their area and any one's normal where
//! an eigenvalue test finds the node flat, and divides it otherwise. Here the node keeps moments
//! that say how flat it is in the direction it is seen from: the mean normal with its length
//! (erratum T24: area-weighted centre, mean normal times coherence), the covariance of the normals
//! and that of the positions. Thus the two sides of a thin shell, whose normals cancel, still cast
//! what they cast, and nothing is divided only because it is not flat.

use crate::form_factor::{Emitter, Reach, Receivers, Sums, within};
use crate::lanes::Lanes;
use crate::surfels::Surfels;
use std::f32::consts::PI;
use surfelshop_api::glam::Vec3;

/// The moments of a node's surfels, each weighted by what is left of its area.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Moments {
    /// Weighted mean of the positions.
    pub(crate) centre: Vec3,
    /// The farthest surfel's distance from the centre, or more.
    pub(crate) radius: f32,
    /// Sum of the weights.
    pub(crate) weight: f32,
    /// Weighted mean of the areas of single surfels.
    area: f32,
    /// Sum of the normals.
    normal: Vec3,
    /// Sum of the normals' dot products with the offset from the centre.
    bulge: f32,
    /// Square of the half width of the normals' spread along any line of sight over its variance.
    width_squared: f32,
    /// Sum of the products of the normals' components: xx yy zz xy xz yz.
    normals: [f32; 6],
    /// Mean of the products of the offsets' components, scaled to squares of half widths.
    spread: [f32; 6],
}

/// `v M v` of a symmetric matrix for sixteen vectors.
#[inline(always)]
fn quadratic(m: &[f32; 6], v: crate::lanes::Lanes3) -> Lanes {
    v.x * v.x * m[0]
        + v.y * v.y * m[1]
        + v.z * v.z * m[2]
        + (v.x * v.y * m[3] + v.x * v.z * m[4] + v.y * v.z * m[5]) * 2.0
}

fn products(v: Vec3) -> [f32; 6] {
    [v.x * v.x, v.y * v.y, v.z * v.z, v.x * v.y, v.x * v.z, v.y * v.z]
}

fn add(sum: &mut [f32; 6], other: [f32; 6], weight: f32) {
    for (sum, other) in sum.iter_mut().zip(other) {
        *sum += weight * other;
    }
}

/// Square of the half width of a spread over its variance. A uniform spread has 3, one at two
/// points 1. With 2 the octree has the least bias against all pairs on three scanned models (below
/// 0.0005 of the sky at a tolerance of 0.01; 0.003 to 0.004 with 3 or 1.5).
const WIDTH_SQUARED: f32 = 2.0;

impl Moments {
    /// What the node covers of each receiver's sky.
    ///
    /// Both cosines vary over a node. How far each spreads about its mean follows from a
    /// covariance, that of the positions along the receiver's normal and that of the normals along
    /// the line of sight; the clamped and the absolute value are means over a uniform spread.
    #[inline(always)]
    pub(crate) fn cast(&self, receivers: &Receivers, reach: Reach) -> Sums {
        let to = receivers.at.to(self.centre.to_array());
        let squared = to.dot(to);
        let height = to.dot(receivers.normal);
        // The mean of what rises above the horizon.
        let half_width = quadratic(&self.spread, receivers.normal).max(0.0).sqrt();
        let straddling = (height + half_width) * (height + half_width) / (half_width * 4.0 + 1e-20);
        let above = half_width.where_above(height.abs(), straddling, height.max(0.0));
        let signed = to.along(self.normal.to_array()) + self.bulge;
        let square = signed * signed;
        let variance = (quadratic(&self.normals, to) * self.weight - square).max(0.0);
        let half = (variance * self.width_squared).sqrt();
        let around = (square + half * half) / (half * 2.0 + 1e-20);
        let absolute = half.where_above(signed.abs(), around, signed.abs());
        let factor = above / ((squared * PI + self.area) * squared);
        let factor = within(squared, above, factor, reach);
        Sums { signed: factor * signed, absolute: factor * absolute }
    }

    /// Moments of single surfels.
    fn of_surfels(emitters: &[Emitter]) -> Self {
        let at = |e: &Emitter| Vec3::from_array(e.at);
        let mut m = Self { weight: emitters.iter().map(|e| e.weight).sum(), ..Self::default() };
        if m.weight <= 0.0 {
            return Self::default();
        }
        m.centre = emitters.iter().map(|e| e.weight * at(e)).sum::<Vec3>() / m.weight;
        m.area = emitters.iter().map(|e| e.weight * e.area).sum::<f32>() / m.weight;
        for e in emitters {
            let (offset, normal) = (at(e) - m.centre, Vec3::from_array(e.normal));
            if e.weight > 0.0 {
                m.radius = m.radius.max(offset.length());
            }
            m.normal += e.weight * normal;
            m.bulge += e.weight * normal.dot(offset);
            add(&mut m.normals, products(normal), e.weight);
            add(&mut m.spread, products(offset), WIDTH_SQUARED * e.weight / m.weight);
        }
        m.measure_spread();
        m
    }

    /// Finds how the normals spread, by a test of their tensor's eigenvalues, which has no scale.
    ///
    /// The sum of the eigenvalues' squares is 1 where all normals lie on one line. Then either they
    /// agree, and there is no spread, or they are the two sides of a thin shell: values at two
    /// points, whose mean absolute value is half of a half width of twice their deviation.
    fn measure_spread(&mut self) {
        let [xx, yy, zz, xy, xz, yz] = self.normals.map(|product| product / self.weight);
        let squares = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz);
        // Isotropic normals have 1/3.
        let collinear = (1.5 * squares - 0.5).clamp(0.0, 1.0);
        let coherence = (self.normal / self.weight).length_squared().min(1.0);
        self.width_squared = WIDTH_SQUARED + (4.0 - WIDTH_SQUARED) * collinear * (1.0 - coherence);
    }

    /// Moments of several nodes together.
    fn of_nodes(nodes: &[Self]) -> Self {
        let mut m = Self { weight: nodes.iter().map(|n| n.weight).sum(), ..Self::default() };
        if m.weight <= 0.0 {
            return Self::default();
        }
        m.centre = nodes.iter().map(|n| n.weight * n.centre).sum::<Vec3>() / m.weight;
        m.area = nodes.iter().map(|n| n.weight * n.area).sum::<f32>() / m.weight;
        for n in nodes.iter().filter(|n| n.weight > 0.0) {
            let offset = n.centre - m.centre;
            m.radius = m.radius.max(offset.length() + n.radius);
            m.normal += n.normal;
            m.bulge += n.bulge + n.normal.dot(offset);
            add(&mut m.normals, n.normals, 1.0);
            add(&mut m.spread, n.spread, n.weight / m.weight);
            add(&mut m.spread, products(offset), WIDTH_SQUARED * n.weight / m.weight);
        }
        m.measure_spread();
        m
    }
}

/// Emitters and the moments of the tree's nodes.
pub(crate) struct Hierarchy<'a> {
    pub(crate) surfels: &'a Surfels,
    /// One for each surfel, those without weight included.
    pub(crate) emitters: Vec<Emitter>,
    /// One for each node of the tree.
    pub(crate) moments: Vec<Moments>,
}

impl<'a> Hierarchy<'a> {
    /// The moments of these emitters, one for each surfel.
    pub(crate) fn new(surfels: &'a Surfels, emitters: Vec<Emitter>) -> Self {
        let nodes = surfels.tree.nodes();
        let mut moments = vec![Moments::default(); nodes.len()];
        // Children come after their parents.
        for (i, node) in nodes.iter().enumerate().rev() {
            let range = |range: &std::ops::Range<u32>| range.start as usize..range.end as usize;
            moments[i] = if node.children.is_empty() {
                Moments::of_surfels(&emitters[range(&node.surfels)])
            } else {
                Moments::of_nodes(&moments[range(&node.children)])
            };
        }
        Self { surfels, emitters, moments }
    }
}
