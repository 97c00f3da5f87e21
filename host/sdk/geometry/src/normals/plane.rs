//! The plane through points.

use crate::eigen;
use glam::{DMat3, DVec3};

/// Ratio of width to length below which a neighbourhood counts as a line: f32 positions of a line
/// that is not parallel to an axis deviate from it by 1e-7 of their magnitude, so that a hundred
/// times this is noise rather than shape.
pub(super) const LINE_WIDTH: f64 = 1e-5;

/// Weighted sums over points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments {
    /// The sum of the weights.
    pub(super) weight: f64,
    pub(super) mean: DVec3,
    /// The weighted sum of the outer products of offsets from the mean.
    pub(super) spread: DMat3,
}

/// The outer product of a vector with itself.
pub(super) fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

impl Moments {
    pub(super) const NOTHING: Self = Self { weight: 0.0, mean: DVec3::ZERO, spread: DMat3::ZERO };

    /// Those of points that weigh the same.
    ///
    /// The spread is summed in a second pass about the mean: the one-pass form
    /// `E[x^2] - E[x]^2` gives negative variances for small features far from the origin.
    pub(super) fn of(points: &[DVec3]) -> Self {
        if points.is_empty() {
            return Self::NOTHING;
        }
        let count = points.len() as f64;
        let mean = points.iter().sum::<DVec3>() / count;
        let (mut squares, mut products) = (DVec3::ZERO, DVec3::ZERO);
        for point in points {
            let offset = *point - mean;
            squares += offset * offset;
            products += offset * DVec3::new(offset.y, offset.z, offset.x);
        }
        let DVec3 { x: xy, y: yz, z: xz } = products;
        let spread = DMat3::from_cols(
            DVec3::new(squares.x, xy, xz),
            DVec3::new(xy, squares.y, yz),
            DVec3::new(xz, yz, squares.z),
        );
        Self { weight: count, mean, spread }
    }
}

/// A plane through a neighbourhood.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Unit length; its sign means nothing.
    pub(super) normal: DVec3,
    /// Whether the points do not span a plane.
    pub(super) degenerate: bool,
    /// Standard deviation across the plane, in units of the points.
    pub(super) error: f64,
    /// That over the one along the shorter side of the neighbourhood, in [0, 1]: 0 for points in a plane, 1 for
    /// those of no surface.
    pub(super) roughness: f64,
    /// Standard deviation along the shorter side, in units of the points.
    pub(super) side: f64,
    /// Shorter side over longer side, in [0, 1].
    pub(super) width: f64,
    /// Points that it goes through.
    pub(super) count: f64,
}

impl Plane {
    /// The best plane through points of which a coordinate is exact to `grain`; they are a line up to this width, a
    /// share of its length.
    pub(super) fn through(moments: &Moments, grain: f64, line_width: f64) -> Self {
        let size = moments.spread.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let count = moments.weight;
        let none = |normal, error| Self {
            normal,
            degenerate: true,
            error,
            roughness: 1.0,
            side: 0.0,
            width: 0.0,
            count,
        };
        if count <= 0.0 || size <= 0.0 {
            return none(DVec3::Z, 0.0);
        }
        // Divided by their size, offsets of 1e-200 still have cubes of squares.
        let (values, normal) = eigen::least(moments.spread * (1.0 / size));
        let deviation = values.map(|value| (value.max(0.0) * (size / count)).sqrt());
        if deviation[1] <= (line_width * deviation[2]).max(grain) {
            let along = eigen::symmetric(moments.spread * (1.0 / size)).vectors[2];
            return none(perpendicular_to(along), deviation[0]);
        }
        Self {
            normal,
            degenerate: false,
            error: deviation[0],
            roughness: (deviation[0] / deviation[1]).min(1.0),
            side: deviation[1],
            width: deviation[1] / deviation[2],
            count,
        }
    }

    /// About the angle by which it may be off, where its points are scattered about it: the standard error of a
    /// slope, which grows beyond all bounds where points spread as far across as along.
    pub(super) fn uncertainty(&self) -> f64 {
        let squared = (self.roughness * self.roughness).min(0.999);
        self.roughness / ((1.0 - squared) * self.count.sqrt())
    }
}

/// The unit vector perpendicular to a unit vector that is closest to +z; +y where that is z itself.
fn perpendicular_to(direction: DVec3) -> DVec3 {
    let rest = DVec3::Z - direction * direction.z;
    // The length is the sine of the angle to z; below a millionth its direction is rounding.
    if rest.length_squared() > 1e-12 { rest.normalize_or(DVec3::Z) } else { DVec3::Y }
}
