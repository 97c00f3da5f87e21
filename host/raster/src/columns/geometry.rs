//! Where surfels are, how they stand and how large they are: a part of a cloud in drawing order.

use super::groups::{Singles, Triples};
use crate::level_of_detail::merge::Sample;

/// Columns in the order of the file; vectors are three numbers a surfel.
#[derive(Clone, Copy)]
pub struct Geometry<'a> {
    /// Relative to the cloud's origin, scene units.
    pub positions: &'a [f32],
    /// Unit.
    pub normals: &'a [f32],
    /// Scene units; not read where there are tangents.
    pub radii: &'a [f32],
    /// Not 0 where a surfel is a round splat that faces the eye; none is where there are tangents.
    pub round: Option<&'a [u8]>,
    /// Half axes of ellipses, scene units.
    pub tangents: Option<[&'a [f32]; 2]>,
}

/// Discs, or ellipses.
pub(crate) enum Shape {
    /// Radii in scene units.
    Radius(Singles),
    /// Half axes in scene units.
    Tangents(Triples, Triples),
}

/// Surfels in drawing order, by groups.
pub(crate) struct OrderedGeometry {
    pub(crate) positions: Triples,
    pub(crate) normals: Triples,
    pub(crate) shape: Shape,
}

/// The radius that a surfel is drawn with: negative where it is a round splat that faces the eye. Radii that are not
/// positive are of no surfel.
#[inline]
#[must_use]
pub fn radius_drawn(radius: f32, is_round: bool) -> f32 {
    let radius = radius.max(0.0);
    if is_round { -radius } else { radius }
}

fn three(values: &[f32], i: usize) -> [f32; 3] {
    [values[3 * i], values[3 * i + 1], values[3 * i + 2]]
}

impl OrderedGeometry {
    /// Surfels by their places in the file.
    pub(super) fn ordered(all: &Geometry<'_>, order: &[u32]) -> Self {
        let shape = match all.tangents {
            Some(axes) => {
                let [u, v] = axes.map(|axis| Triples::ordered(order, |i| three(axis, i)));
                Shape::Tangents(u, v)
            }
            None => Shape::Radius(Singles::ordered(order, |i| {
                radius_drawn(all.radii[i], all.round.is_some_and(|round| round[i] != 0))
            })),
        };
        Self {
            positions: Triples::ordered(order, |i| three(all.positions, i)),
            normals: Triples::ordered(order, |i| three(all.normals, i)),
            shape,
        }
    }

    /// Appends merged surfels, filled up to whole groups.
    pub(super) fn push(&mut self, samples: &[Sample]) {
        self.positions.push(samples.iter().map(|sample| sample.position));
        self.normals.push(samples.iter().map(|sample| sample.normal));
        if let Shape::Radius(radii) = &mut self.shape {
            radii.push(samples.iter().map(|one| radius_drawn(one.radius, one.is_round)));
        }
    }

    /// Bytes in memory.
    pub(super) fn bytes(&self) -> usize {
        let shape = match self.shape {
            Shape::Radius(_) => 1,
            Shape::Tangents(..) => 6,
        };
        self.positions.n_places() * (6 + shape) * size_of::<f32>()
    }
}
