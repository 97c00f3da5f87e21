//! The linear normal field of a splat.

use super::plane::{Axes, STEEPEST};
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

/// How sure a field is: what its least squares leave, along both axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Fit {
    /// Samples.
    n: f64,
    /// Their mean place, in units of the half axes.
    at: DVec2,
    /// Sum of squares of their places about it.
    spread: DVec2,
    /// Sum of squares of what slopes are off.
    rest: DVec2,
}

/// Samples that what all splats together say of their noise counts for.
const PRIOR: f64 = 4.0;

/// Takes from each field what may be the noise of its samples: its slopes α and β shrink by their share
/// of their own square and the square of their standard error. A splat of two or three samples says
/// nothing of its noise, which is that of all splats then; its field would else swing at the splat's
/// edge, a disc beyond them.
///
/// Source: Efron & Morris 1975, "Data Analysis Using Stein's Estimator", for shrinking towards what is
/// known of many alike.
pub(crate) fn steady<'a>(all: impl Iterator<Item = (&'a mut Field, &'a Fit)>) {
    let mut all: Vec<(&mut Field, &Fit)> = all.collect();
    // A line through two samples leaves nothing.
    let free = |fit: &Fit| (fit.n - 2.0).max(0.0);
    let rest: f64 = all.iter().map(|(_, fit)| fit.rest.element_sum()).sum();
    let n_free: f64 = all.iter().map(|(_, fit)| 2.0 * free(fit)).sum();
    let noise = if n_free > 0.0 { rest / n_free } else { 0.0 };
    for (field, fit) in &mut all {
        let own = (fit.rest + PRIOR * noise) / (free(fit) + PRIOR);
        let [x, y, alpha, beta] = &mut field.0;
        for (slope, middle, spread, own, at) in
            [(alpha, x, fit.spread.x, own.x, fit.at.x), (beta, y, fit.spread.y, own.y, fit.at.y)]
        {
            let square = *slope * *slope;
            if square > 0.0 && spread > 0.0 {
                let kept = *slope * square / (square + own / spread);
                // What is taken away turns the field about the middle of its samples.
                *middle += (*slope - kept) * at;
                *slope = kept;
            }
        }
    }
}

/// Variance of a coordinate, in units of the half axis, below which it says nothing of a slope: samples
/// that lie closer about their mean than a sixth of the way to the edge. That of a full disc is 0.25.
const LEAST_VARIANCE: f64 = 0.03;

impl Field {
    /// The field of least squares, eq. 3 and 4 with sums about the means, since those of the paper cancel
    /// and have no solution where all samples have the same coordinate (erratum B7).
    ///
    /// Least squares of slopes count steep normals for more than their angle, so it is also found with
    /// weights of one to the square of the normal's length, and the better of both by angle is taken; or
    /// the constant normal `mean`, where that is better than either.
    pub(crate) fn fit(normals: &[Normal], n: DVec3, axes: &Axes, mean: DVec3) -> (Self, Fit) {
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
        if error(&found) <= error(&constant) {
            (found, found.left(&slopes))
        } else {
            (constant, Fit::default())
        }
    }

    /// Whether samples lie far enough apart to tell the slopes along both axes.
    pub(crate) fn is_told_by(normals: &[Normal]) -> bool {
        let n = normals.len() as f64;
        let mean = normals.iter().map(|s| s.at).sum::<DVec2>() / n;
        let squares = normals.iter().map(|s| (s.at - mean) * (s.at - mean)).sum::<DVec2>();
        squares.min_element() > LEAST_VARIANCE * n
    }

    /// What the field leaves of slopes.
    fn left(&self, slopes: &[(DVec2, DVec2)]) -> Fit {
        let [x, y, alpha, beta] = self.0;
        let n = slopes.len() as f64;
        let at = slopes.iter().map(|(at, _)| *at).sum::<DVec2>() / n.max(1.0);
        let mut fit = Fit { n, at, ..Fit::default() };
        for &(place, slope) in slopes {
            let off = slope - DVec2::new(x + alpha * place.x, y + beta * place.y);
            fit.spread += (place - at) * (place - at);
            fit.rest += off * off;
        }
        fit
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
