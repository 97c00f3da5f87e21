//! FLIP: how different two displayed pictures look that are shown one after the other.
//!
//! Colours are compared as an eye at a distance sees them, blurred and in steps of perceived
//! difference; edges and points that are in one picture only make the difference larger.
//!
//! Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A
//! Difference Evaluator for Alternating Images".

mod color;
mod eye;

use super::Flip;
use super::filter::Plane;
use crate::Image;
use color::Space;
use eye::Eye;
use rayon::prelude::*;
use std::ops::Range;

/// Rows that are computed at once, at least.
const STRIP: usize = 64;

/// Exponent on differences of features.
const FEATURE_EXPONENT: f64 = 0.5;

/// What an eye sees of some rows of a picture.
struct FilteredRows {
    /// Colours in which distances are perceived differences.
    colors: Vec<[f64; 3]>,
    /// How strong an edge there is at a pixel, and how strong a point or line.
    edges: Vec<f64>,
    points: Vec<f64>,
}

/// FLIP of every pixel of two displayed pictures of one size, four sRGB-encoded values a pixel.
pub(super) fn map(test: &Image, reference: &Image, pixels_per_degree: f64) -> Image {
    let eye = Eye::new(pixels_per_degree);
    let space = Space::new();
    let height = test.height as usize;
    // Every strip is filtered with the rows around it, so larger filters want larger strips.
    let n_rows = STRIP.max(2 * eye.halo());
    let strip = |number: usize| {
        let rows = number * n_rows..((number + 1) * n_rows).min(height);
        let [test, reference] =
            [test, reference].map(|picture| seen(picture, rows.clone(), &eye, &space));
        differences(&test, &reference, &space)
    };
    let strips: Vec<Vec<f32>> = (0..height.div_ceil(n_rows)).into_par_iter().map(strip).collect();
    let data = strips.concat();
    Image { width: test.width, height: test.height, components: 1, data }
}

/// What is seen of some rows of a picture.
fn seen(picture: &Image, rows: Range<usize>, eye: &Eye, space: &Space) -> FilteredRows {
    let width = picture.width as usize;
    let last = picture.height as usize - 1;
    let around = rows.start..rows.end + 2 * eye.halo();
    let mut opponent = [(); 3].map(|()| Vec::with_capacity(around.len() * width));
    for row in around {
        // Beyond the ends the first and last row go on.
        let row = row.saturating_sub(eye.halo()).min(last);
        for pixel in picture.data[4 * width * row..4 * width * (row + 1)].chunks_exact(4) {
            let values = space.opponent([pixel[0], pixel[1], pixel[2]]);
            for (plane, value) in opponent.iter_mut().zip(values) {
                plane.push(value);
            }
        }
    }
    let opponent = opponent.map(|values| Plane { width, values });
    let (edges, points) = eye.features(&opponent[0]);
    let [y, cx, cz] = eye.blurred(&opponent);
    let colors = y.values.iter().zip(&cx.values).zip(&cz.values);
    let colors = colors.map(|((y, cx), cz)| space.perceived([*y, *cx, *cz])).collect();
    FilteredRows { colors, edges, points }
}

/// FLIP of every pixel of some rows.
fn differences(test: &FilteredRows, reference: &FilteredRows, space: &Space) -> Vec<f32> {
    let of = |at: usize| {
        let color = space.difference(test.colors[at], reference.colors[at]);
        let edge = (test.edges[at] - reference.edges[at]).abs();
        let point = (test.points[at] - reference.points[at]).abs();
        let feature = (edge.max(point) / std::f64::consts::SQRT_2).powf(FEATURE_EXPONENT);
        color.powf(1.0 - feature.min(1.0)).clamp(0.0, 1.0) as f32
    };
    (0..test.colors.len()).map(of).collect()
}

/// Mean and percentiles of a map that is not empty.
pub(super) fn summary(map: &Image) -> Flip {
    let mut values = map.data.clone();
    values.par_sort_unstable_by(f32::total_cmp);
    let percentile = |percent: usize| {
        let rank = (values.len() * percent).div_ceil(100).max(1);
        f64::from(values[rank - 1])
    };
    let sum: f64 = map.data.iter().map(|value| f64::from(*value)).sum();
    Flip {
        mean: sum / values.len() as f64,
        p50: percentile(50),
        p95: percentile(95),
        p99: percentile(99),
        max: percentile(100),
    }
}
