//! The linear normal field of a splat.

use crate::plane::{Axes, STEEPEST};
use surfelshop_api::glam::{DVec2, DVec3};

/// A normal of a sample, and where it is in units of the half axes.
#[derive(Clone, Copy)]
pub(crate) struct Normal {
    pub(crate) at: DVec2,
    pub(crate) normal: DVec3,
}

/// x, y, α and β of eq. 2: the normal at (u, v) has the direction of n + (x + α u) û + (y + β v) v̂.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Field(pub(crate) [f64; 4]);

/// Variance of a coordinate, in units of the half axis, below which it says nothing of a slope.
const LEAST_VARIANCE: f64 = 1e-4;

impl Field {
    /// The field of least squares, eq. 3 and 4 with sums about the means, since those of the paper cancel
    /// and have no solution where all samples have the same coordinate (erratum B7).
    ///
    /// Least squares of slopes count steep normals for more than their angle, so it is also found with
    /// weights of one to the square of the normal's length, and the better of both by angle is taken; or
    /// the constant normal `mean`, where that is better than either.
    pub(crate) fn fit(normals: &[Normal], n: DVec3, axes: &Axes, mean: DVec3) -> Self {
        let slope = |normal: DVec3| axes.of(normal) / n.dot(normal).max(STEEPEST);
        let constant = slope(mean);
        let constant = Self([constant.x, constant.y, 0.0, 0.0]);
        let slopes: Vec<(DVec2, DVec2)> = normals.iter().map(|s| (s.at, slope(s.normal))).collect();
        let plain = Self::least_squares(&slopes, |_| 1.0);
        let weighted = Self::least_squares(&slopes, |slope| 1.0 / (1.0 + slope.length_squared()));
        let error = |field: &Self| {
            let squares = normals.iter().map(|s| angle(field.at(s.at, n, axes), s.normal).powi(2));
            squares.sum::<f64>()
        };
        let found = if error(&weighted) < error(&plain) { weighted } else { plain };
        if error(&found) <= error(&constant) { found } else { constant }
    }

    fn least_squares(slopes: &[(DVec2, DVec2)], weight: impl Fn(DVec2) -> f64) -> Self {
        let (mut total, mut at, mut slope) = (0.0, DVec2::ZERO, DVec2::ZERO);
        for &(a, s) in slopes {
            let w = weight(s);
            total += w;
            at += a * w;
            slope += s * w;
        }
        if total <= 0.0 {
            return Self::default();
        }
        (at, slope) = (at / total, slope / total);
        let (mut variance, mut covariance) = (DVec2::ZERO, DVec2::ZERO);
        for &(a, s) in slopes {
            let w = weight(s);
            variance += (a - at) * (a - at) * w;
            covariance += (a - at) * (s - slope) * w;
        }
        let rise = |variance: f64, covariance: f64| {
            if variance > LEAST_VARIANCE * total { covariance / variance } else { 0.0 }
        };
        let [alpha, beta] = [rise(variance.x, covariance.x), rise(variance.y, covariance.y)];
        Self([slope.x - alpha * at.x, slope.y - beta * at.y, alpha, beta])
    }

    /// The unit normal at a place.
    pub(crate) fn at(&self, at: DVec2, n: DVec3, axes: &Axes) -> DVec3 {
        let [x, y, alpha, beta] = self.0;
        let normal = n + axes.u * (x + alpha * at.x) + axes.v * (y + beta * at.y);
        normal.normalize_or(n)
    }
}

/// The angle between two unit vectors, exact where it is small.
pub(crate) fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}
