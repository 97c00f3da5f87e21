//! Eigenvalues of symmetric 3x3 matrices.

use glam::{DMat3, DVec3};

/// Eigenvalues in ascending order and their unit eigenvectors.
#[derive(Clone, Copy, Debug)]
pub struct Eigen {
    /// Eigenvalues, smallest first.
    pub values: [f64; 3],
    /// Their eigenvectors: unit length and orthogonal.
    pub vectors: [DVec3; 3],
}

/// Rotations of all three off-diagonal elements. Convergence is quadratic: 3x3 matrices need at
/// most six sweeps to reach rounding error; the rest is slack so that the loop always ends.
const MAX_SWEEPS: usize = 16;

/// Eigenvalues and eigenvectors of a symmetric matrix with finite elements.
///
/// Source: cyclic Jacobi rotations, Golub and Van Loan, Matrix Computations, section 8.5. It is
/// chosen over the closed form because its eigenvectors are orthogonal to rounding error even
/// where eigenvalues coincide.
#[must_use]
pub fn symmetric(matrix: DMat3) -> Eigen {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..MAX_SWEEPS {
        let off = a[0][1].abs() + a[0][2].abs() + a[1][2].abs();
        let scale = a[0][0].abs() + a[1][1].abs() + a[2][2].abs();
        // Below a rounding error of the diagonal a rotation no longer changes it.
        if off <= f64::EPSILON * f64::EPSILON * scale || off == 0.0 {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let vector = |i: usize| DVec3::new(v[0][i], v[1][i], v[2][i]).normalize_or(DVec3::Z);
    Eigen { values: order.map(|i| a[i][i]), vectors: order.map(vector) }
}

/// Makes the element (p, q) zero by a rotation in their plane.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    // The smaller of the two roots, written without cancellation; an infinite theta gives 0.
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    let turn = |x: f64, y: f64| (c * x - s * y, s * x + c * y);
    for row in a.iter_mut() {
        (row[p], row[q]) = turn(row[p], row[q]);
    }
    let (row_p, row_q) = (a[p], a[q]);
    for (k, (&x, &y)) in row_p.iter().zip(&row_q).enumerate() {
        (a[p][k], a[q][k]) = turn(x, y);
    }
    a[p][q] = 0.0;
    a[q][p] = 0.0;
    for row in v {
        (row[p], row[q]) = turn(row[p], row[q]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::Random;

    /// Largest element of `A v - lambda v` over all pairs.
    fn residual(matrix: DMat3, eigen: &Eigen) -> f64 {
        (0..3)
            .map(|i| (matrix * eigen.vectors[i] - eigen.values[i] * eigen.vectors[i]).length())
            .fold(0.0, f64::max)
    }

    #[test]
    fn eigenpairs_of_random_matrices_satisfy_their_equation() {
        let mut random = Random::new(7);
        for _ in 0..1000 {
            let x = random.in_ball();
            let y = random.in_ball() * 1e-3;
            let z = random.in_ball() * 1e-7;
            let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
            let matrix = outer(x) + outer(y) + outer(z);
            let eigen = symmetric(matrix);
            assert!(eigen.values[0] <= eigen.values[1] && eigen.values[1] <= eigen.values[2]);
            // About a hundred roundings of numbers of at most 1.
            assert!(residual(matrix, &eigen) < 1e-14);
            let axes = DMat3::from_cols_array_2d(&eigen.vectors.map(|v| v.to_array()));
            assert!((axes.determinant().abs() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn zero_identity_and_rank_one_matrices_give_orthogonal_axes() {
        let line = DVec3::new(1.0, 1.0, 1.0);
        let rank_one = DMat3::from_cols(line, line, line);
        for matrix in [DMat3::ZERO, DMat3::IDENTITY, rank_one] {
            let eigen = symmetric(matrix);
            assert!(residual(matrix, &eigen) < 1e-15);
            assert!(eigen.vectors[0].dot(eigen.vectors[1]).abs() < 1e-15);
        }
        assert!((symmetric(rank_one).vectors[2].dot(line.normalize_or_zero()).abs() - 1.0) < 1e-15);
    }
}
