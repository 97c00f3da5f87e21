//! Planes of least squares, and how the surface over one curves.

use super::samples::Samples;
use surfelshop_api::glam::{DMat3, DVec2, DVec3};
use surfelshop_geometry::eigen;

/// A plane and how its samples lie about it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// A point of it, in the middle of the samples and half way between the highest and the lowest.
    pub(crate) at: DVec3,
    /// Unit normal, on the side of the samples' normals.
    pub(crate) normal: DVec3,
    /// Mean of the samples' normals, unit length.
    pub(crate) mean: DVec3,
    /// Height of the highest sample, and depth of the lowest.
    pub(crate) height: f64,
    /// Least cosine between the normal and those of the samples.
    pub(crate) least_cosine: f64,
}

/// Cosine between the normal of a plane and the mean normal of its samples below which the plane says
/// less of the surface than the normals do: few samples, or nearly on a line.
const LEAST_AGREEMENT: f64 = 0.8;

/// Width of a set of samples relative to its length below which it is a line, squared.
const LINE: f64 = 1e-6;

impl Plane {
    /// The plane of least squares through at least one sample, moved to the middle of their heights;
    /// that of the mean normal where samples do not span one.
    pub(crate) fn fit(samples: &Samples, members: &[u32]) -> Self {
        let count = members.len().max(1) as f64;
        let mean: DVec3 = members.iter().map(|&i| samples.point(i)).sum::<DVec3>() / count;
        let sum: DVec3 = members.iter().map(|&i| samples.normal(i)).sum();
        let own = members.first().map_or(DVec3::Z, |&i| samples.normal(i));
        let towards = sum.try_normalize().unwrap_or(own);
        let mut covariance = DMat3::ZERO;
        for &i in members {
            let d = samples.point(i) - mean;
            covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        }
        let normal = Self::normal(covariance, towards);
        let (mut low, mut high, mut least) = (f64::INFINITY, f64::NEG_INFINITY, 1.0f64);
        for &i in members {
            let height = normal.dot(samples.point(i) - mean);
            low = low.min(height);
            high = high.max(height);
            least = least.min(normal.dot(samples.normal(i)));
        }
        if low > high {
            (low, high) = (0.0, 0.0);
        }
        Self {
            at: mean + normal * low.midpoint(high),
            normal,
            mean: towards,
            height: 0.5 * (high - low),
            least_cosine: least,
        }
    }

    fn normal(covariance: DMat3, towards: DVec3) -> DVec3 {
        let scale = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
        if scale <= 0.0 || !scale.is_finite() {
            return towards;
        }
        // Divided by their size, squares of tiny offsets still have products.
        let found = eigen::symmetric(covariance * scale.recip());
        let along = found.vectors[2];
        if found.values[1] <= LINE * found.values[2] {
            // On a line: what is perpendicular to it and as near to the normals as can be.
            return (towards - along * along.dot(towards)).try_normalize().unwrap_or(towards);
        }
        let normal = found.vectors[0] * found.vectors[0].dot(towards).signum();
        if normal.dot(towards) < LEAST_AGREEMENT { towards } else { normal }
    }

    /// Height of a point above the plane.
    pub(crate) fn height_of(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.at)
    }
}

/// Directions in a plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    pub(crate) u: DVec3,
    pub(crate) v: DVec3,
}

impl Axes {
    /// Any two that are perpendicular to a normal.
    pub(crate) fn across(normal: DVec3) -> Self {
        let u = normal.any_orthonormal_vector();
        Self { u, v: normal.cross(u) }
    }

    /// These turned by an angle of this cosine and sine.
    fn turned(self, cosine: f64, sine: f64) -> Self {
        Self { u: self.u * cosine + self.v * sine, v: self.v * cosine - self.u * sine }
    }

    /// Coordinates of an offset.
    pub(crate) fn of(&self, offset: DVec3) -> DVec2 {
        DVec2::new(self.u.dot(offset), self.v.dot(offset))
    }
}

/// Principal directions of a piece of surface, and the curvatures along them, signed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    pub(crate) axes: Axes,
    pub(crate) curvatures: [f64; 2],
    /// Mean square distance from the middle.
    pub(crate) spread: f64,
}

/// Least share of a square sum in the sum of both that counts as a spread in its direction.
const FLAT: f64 = 1e-6;

impl Shape {
    /// The symmetric matrix S of least squares for slopes = mean + S (u, v), where a normal of slopes
    /// (x, y) has the direction (x, y, 1) over the plane; its eigenvectors are the principal directions.
    pub(crate) fn of(samples: &Samples, members: &[u32], plane: &Plane) -> Self {
        let axes = Axes::across(plane.normal);
        let count = members.len().max(1) as f64;
        let both = |i: u32| {
            let normal = samples.normal(i);
            let up = plane.normal.dot(normal).max(STEEPEST);
            (axes.of(samples.point(i) - plane.at), axes.of(normal) / up)
        };
        let (mut at, mut slope) = (DVec2::ZERO, DVec2::ZERO);
        for &i in members {
            let (a, s) = both(i);
            at += a;
            slope += s;
        }
        (at, slope) = (at / count, slope / count);
        let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
        let (mut xu, mut cross, mut yv) = (0.0, 0.0, 0.0);
        for &i in members {
            let (a, s) = both(i);
            let (d, e) = (a - at, s - slope);
            uu += d.x * d.x;
            uv += d.x * d.y;
            vv += d.y * d.y;
            xu += e.x * d.x;
            yv += e.y * d.y;
            cross += e.x * d.y + e.y * d.x;
        }
        let spread = (uu + vv) / count;
        let none = Self { axes, curvatures: [0.0; 2], spread };
        if uu <= FLAT * (uu + vv) || vv <= FLAT * (uu + vv) {
            return none;
        }
        let left = uu + vv - uv * uv / uu - uv * uv / vv;
        if left <= FLAT * (uu + vv) {
            return none;
        }
        let q = (cross - xu * uv / uu - yv * uv / vv) / left;
        let (p, r) = ((xu - q * uv) / uu, (yv - q * uv) / vv);
        let (sine, cosine) = (0.5 * (2.0 * q).atan2(p - r)).sin_cos();
        let (mean, half) = (0.5 * (p + r), (0.5 * (p - r)).hypot(q));
        Self { axes: axes.turned(cosine, sine), curvatures: [mean + half, mean - half], spread }
    }

    /// Directions of most and least spread of the samples themselves.
    pub(crate) fn extents(samples: &Samples, members: &[u32], plane: &Plane) -> Axes {
        let axes = Axes::across(plane.normal);
        let count = members.len().max(1) as f64;
        let at = |i: u32| axes.of(samples.point(i) - plane.at);
        let mean: DVec2 = members.iter().map(|&i| at(i)).sum::<DVec2>() / count;
        let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
        for &i in members {
            let d = at(i) - mean;
            uu += d.x * d.x;
            uv += d.x * d.y;
            vv += d.y * d.y;
        }
        let (sine, cosine) = (0.5 * (2.0 * uv).atan2(uu - vv)).sin_cos();
        axes.turned(cosine, sine)
    }
}

/// Least cosine between the normal of a splat and those of its samples, some 75 degrees: slopes, which
/// are sine over cosine, grow without bound towards 90 degrees.
pub(crate) const STEEPEST: f64 = 0.25;
