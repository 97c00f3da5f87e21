//! Structural similarity.
//!
//! Source: Wang, Bovik, Sheikh and Simoncelli 2004, "Image Quality Assessment: From Error Visibility
//! to Structural Similarity".

use super::filter::{Plane, gaussian, normalized};
use crate::Image;
use rayon::prelude::*;

/// Half of the window's side, 11.
const RADIUS: usize = 5;
/// Deviation of the window's Gaussian in pixels.
const DEVIATION: f64 = 1.5;
/// (K1 L)² and (K2 L)², L being the range of values, 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
/// Rows of windows that are computed at once.
const STRIP: usize = 64;

/// Mean structural similarity of two displayed pictures' luma over the windows inside; `None` where
/// there is none.
pub(super) fn mean(test: &Image, reference: &Image) -> Option<f64> {
    let (width, height) = (test.width as usize, test.height as usize);
    let n_rows = height.checked_sub(2 * RADIUS)?;
    let n_columns = width.checked_sub(2 * RADIUS)?;
    if n_rows == 0 || n_columns == 0 {
        return None;
    }
    let window = normalized(gaussian(RADIUS, 0.5 / (DEVIATION * DEVIATION)));
    let strip = |number: usize| {
        let first = number * STRIP;
        let rows = first..(first + STRIP).min(n_rows) + 2 * RADIUS;
        let lumas = [test, reference].map(|picture| {
            let part = &picture.data[4 * width * rows.start..4 * width * rows.end];
            Plane { width, values: part.chunks_exact(4).map(luma).collect() }
        });
        sum(&lumas[0], &lumas[1], &window)
    };
    let sums: Vec<f64> = (0..n_rows.div_ceil(STRIP)).into_par_iter().map(strip).collect();
    Some(sums.iter().sum::<f64>() / (n_rows * n_columns) as f64)
}

/// Luma of an sRGB-encoded pixel, Rec. 709.
fn luma(pixel: &[f32]) -> f64 {
    0.2126 * f64::from(pixel[0]) + 0.7152 * f64::from(pixel[1]) + 0.0722 * f64::from(pixel[2])
}

/// Similarities of all windows inside two planes, added up.
fn sum(test: &Plane, reference: &Plane, window: &[f64]) -> f64 {
    let width = test.width;
    let mean = |plane: &Plane| plane.across(window).down(window, RADIUS).values;
    let product = |a: &Plane, b: &Plane| {
        let values = a.values.iter().zip(&b.values).map(|(a, b)| a * b).collect();
        mean(&Plane { width, values })
    };
    let (of_test, of_reference) = (mean(test), mean(reference));
    let (squared_test, squared_reference) = (product(test, test), product(reference, reference));
    let mixed = product(test, reference);
    let inside = |at: &usize| (RADIUS..width - RADIUS).contains(&(at % width));
    let similarity = |at: usize| {
        let (x, y) = (of_test[at], of_reference[at]);
        let (var_x, var_y) = (squared_test[at] - x * x, squared_reference[at] - y * y);
        let covariance = mixed[at] - x * y;
        (2.0 * x * y + C1) * (2.0 * covariance + C2) / ((x * x + y * y + C1) * (var_x + var_y + C2))
    };
    (0..of_test.len()).filter(inside).map(similarity).sum()
}
