//! What an eye at a distance resolves, as filters.

use crate::metrics::filter::{Plane, gaussian, normalized, offsets};
use std::f64::consts::PI;

/// Contrast sensitivity to opponent colours as sums of Gaussians: heights and widths, those of
/// height 0 left out.
const LIGHTNESS: &[[f64; 2]] = &[[1.0, 0.0047]];
const RED_GREEN: &[[f64; 2]] = &[[1.0, 0.0053]];
const BLUE_YELLOW: &[[f64; 2]] = &[[34.1, 0.04], [13.5, 0.025]];
/// Largest of the widths, which decides how far all filters reach: three deviations.
const WIDEST: f64 = 0.04;

/// Width in degrees of the edges and points that the eye is most sensitive to.
const FEATURE_WIDTH: f64 = 0.082;

/// Taps in one direction; the filter is their product with themselves, and its share in a sum.
struct Part {
    share: f64,
    taps: Vec<f64>,
}

/// The filters for one size of pixels.
pub(super) struct Eye {
    /// For each opponent colour.
    blurs: [Vec<Part>; 3],
    /// A Gaussian, and its first and second derivative, of which the positive and the negative taps
    /// add up to 1 and -1.
    smooth: Vec<f64>,
    edge: Vec<f64>,
    point: Vec<f64>,
    halo: usize,
}

impl Eye {
    /// For pixels of a size; see [`Settings`](crate::metrics::Settings).
    pub(super) fn new(pixels_per_degree: f64) -> Self {
        let reach = 3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
        let radius = reach.ceil() as usize;
        let blurs = [LIGHTNESS, RED_GREEN, BLUE_YELLOW]
            .map(|gaussians| blur(gaussians, radius, pixels_per_degree));
        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let feature_radius = (3.0 * deviation).ceil() as usize;
        let bell = gaussian(feature_radius, 0.5 / (deviation * deviation));
        let derivative = |of: fn(f64) -> f64| {
            let taps = offsets(feature_radius).zip(&bell).map(|(x, g)| of(x / deviation) * g);
            balanced(taps.collect())
        };
        let edge = derivative(|x| -x);
        let point = derivative(|x| x * x - 1.0);
        Self { blurs, smooth: normalized(bell), edge, point, halo: radius.max(feature_radius) }
    }

    /// Rows above and below those that are wanted, of which the filters take account.
    pub(super) fn halo(&self) -> usize {
        self.halo
    }

    /// Opponent colours as they are seen, without the rows of the halo.
    pub(super) fn blurred(&self, opponent: &[Plane; 3]) -> [Plane; 3] {
        [0, 1, 2].map(|channel| {
            let plane = &opponent[channel];
            let parts = self.blurs[channel].iter().map(|part| {
                let mut blurred = plane.across(&part.taps).down(&part.taps, self.halo);
                blurred.values.iter_mut().for_each(|value| *value *= part.share);
                blurred
            });
            let sum = parts.reduce(|mut sum, part| {
                sum.values.iter_mut().zip(&part.values).for_each(|(sum, value)| *sum += value);
                sum
            });
            sum.unwrap_or_else(|| Plane { width: plane.width, values: Vec::new() })
        })
    }

    /// How strong edges and points are, of the first opponent colour, without the rows of the halo:
    /// lengths of the first and of the second derivatives.
    pub(super) fn features(&self, lightness: &Plane) -> (Vec<f64>, Vec<f64>) {
        let values = lightness.values.iter().map(|value| (value + 16.0) / 116.0).collect();
        let plane = Plane { width: lightness.width, values };
        let smooth = plane.across(&self.smooth);
        let strength = |taps: &[f64]| {
            let across = plane.across(taps).down(&self.smooth, self.halo);
            let down = smooth.down(taps, self.halo);
            across.values.iter().zip(&down.values).map(|(x, y)| x.hypot(*y)).collect()
        };
        (strength(&self.edge), strength(&self.point))
    }
}

/// A sum of Gaussians, given by the contrast sensitivity, over the square that they reach; its taps
/// add up to 1.
fn blur(gaussians: &[[f64; 2]], radius: usize, pixels_per_degree: f64) -> Vec<Part> {
    let parts: Vec<Part> = gaussians
        .iter()
        .map(|&[height, width]| {
            let falloff = PI * PI / (width * pixels_per_degree * pixels_per_degree);
            let taps = gaussian(radius, falloff);
            let sum: f64 = taps.iter().sum();
            // What it adds up to over the square.
            let share = height * (PI / width).sqrt() * sum * sum;
            Part { share, taps: normalized(taps) }
        })
        .collect();
    let total: f64 = parts.iter().map(|part| part.share).sum();
    parts.into_iter().map(|part| Part { share: part.share / total, ..part }).collect()
}

/// Taps of which the positive ones are scaled to add up to 1, and the negative ones to -1.
fn balanced(mut taps: Vec<f64>) -> Vec<f64> {
    let of = |sign: f64| taps.iter().map(|tap| (sign * tap).max(0.0)).sum::<f64>();
    let (positive, negative) = (of(1.0), of(-1.0));
    for tap in &mut taps {
        *tap /= if *tap > 0.0 { positive } else { negative };
    }
    taps
}
