//! Rotations of functions on the sphere.

use super::{MAX_ORDER, basis, n_coefficients};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Rings of directions over which products of two basis functions are summed without an error: a sum over `n`
/// zeros of a Legendre polynomial is exact up to degree `2 n - 1`.
const N_RINGS: usize = MAX_ORDER + 1;

/// Directions of a ring, which is exact up to degree `n - 1`.
const N_AROUND: usize = 2 * MAX_ORDER + 1;

/// The matrix, row by row, that turns the `2 l + 1` coefficients of one order `l`, from m = -l to l: of a function
/// `f` with coefficients `c`, the product is those of the function `g` with `g(R d) = f(d)`. `None` where the order is
/// above [`MAX_ORDER`].
///
/// The entry of row m and column k is the integral of `Y_lm(R d) Y_lk(d)` over the sphere, a sum that is exact
/// but for rounding. The matrix is as orthogonal as `R`.
#[must_use]
pub fn rotation(order: usize, rotation: DMat3) -> Option<Vec<f64>> {
    if order > MAX_ORDER {
        return None;
    }
    let n = 2 * order + 1;
    let own = order * order..n_coefficients(order);
    let mut matrix = vec![0.0; n * n];
    for (z, weight) in gauss_legendre() {
        let radius = (1.0 - z * z).sqrt();
        for i in 0..N_AROUND {
            let (sine, cosine) = (2.0 * PI * i as f64 / N_AROUND as f64).sin_cos();
            let d = DVec3::new(radius * cosine, radius * sine, z);
            let (before, after) = (basis(d), basis(rotation * d));
            let weight = weight * 2.0 * PI / N_AROUND as f64;
            for (row, turned) in matrix.chunks_exact_mut(n).zip(&after[own.clone()]) {
                for (sum, plain) in row.iter_mut().zip(&before[own.clone()]) {
                    *sum += weight * turned * plain;
                }
            }
        }
    }
    Some(matrix)
}

/// Zeros of the Legendre polynomial of degree [`N_RINGS`] and their weights in integrals from -1 to 1.
fn gauss_legendre() -> [(f64, f64); N_RINGS] {
    let n = N_RINGS as f64;
    std::array::from_fn(|i| {
        let mut z = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 1.0;
        // Newton's method from there doubles the digits with each step.
        for _ in 0..8 {
            let (mut before, mut p) = (1.0, z);
            for l in 2..=N_RINGS {
                let l = l as f64;
                (before, p) = (p, ((2.0 * l - 1.0) * z * p - (l - 1.0) * before) / l);
            }
            slope = n * (z * p - before) / (z * z - 1.0);
            z -= p / slope;
        }
        (z, 2.0 / ((1.0 - z * z) * slope * slope))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn rotations() -> Vec<DMat3> {
        let quaternions = [
            DQuat::IDENTITY,
            DQuat::from_rotation_x(1.0),
            DQuat::from_rotation_z(-2.5),
            DQuat::from_xyzw(0.3, -0.5, 1.1, 0.7).normalize(),
            DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
        ];
        quaternions.map(DMat3::from_quat).to_vec()
    }

    #[test]
    fn turned_coefficients_are_those_of_the_turned_function() {
        for turn in rotations() {
            for order in 0..=MAX_ORDER {
                let n = 2 * order + 1;
                let matrix = rotation(order, turn).unwrap();
                let given: Vec<f64> = (0..n).map(|k| (k as f64 * 1.7 + 0.3).sin()).collect();
                let row = |row: &[f64]| row.iter().zip(&given).map(|(a, b)| a * b).sum::<f64>();
                let turned: Vec<f64> = matrix.chunks_exact(n).map(row).collect();
                let value = |c: &[f64], d: DVec3| -> f64 {
                    let y = basis(d);
                    y[order * order..].iter().zip(c).map(|(y, c)| y * c).sum()
                };
                for i in 0..50 {
                    let d = DVec3::new((f64::from(i)).sin(), (f64::from(i) * 2.3).cos(), 0.4);
                    let d = d.normalize_or(DVec3::Z);
                    let error = (value(&turned, turn * d) - value(&given, d)).abs();
                    assert!(error < 1e-12, "order {order}: {error:e}");
                }
            }
        }
        assert_eq!(rotation(MAX_ORDER + 1, DMat3::IDENTITY), None);
    }

    #[test]
    fn order_one_turns_as_vectors_do() {
        // Of (y, z, x), which is the order of the coefficients.
        let turn = rotations()[3];
        let matrix = rotation(1, turn).unwrap();
        let axes = [1, 2, 0];
        for (i, row) in matrix.chunks_exact(3).enumerate() {
            for (j, entry) in row.iter().enumerate() {
                let expected = turn.col(axes[j])[axes[i]];
                assert!((entry - expected).abs() < 1e-13, "{i} {j}: {entry} for {expected}");
            }
        }
    }
}
