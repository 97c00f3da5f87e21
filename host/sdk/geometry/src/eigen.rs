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

/// Eigenvalues in ascending order and the unit eigenvector of the least one, of a symmetric matrix with finite
/// elements, without the rotations of [`symmetric`].
///
/// The eigenvalues are the roots of the characteristic polynomial by its trigonometric solution, and the vector
/// is perpendicular to two rows of the matrix less the root. Where the two least are nearly the same those
/// rows are nearly parallel, and [`symmetric`] takes over.
///
/// Source: Smith, Eigenvalues of a symmetric 3 x 3 matrix, Communications of the ACM 4(4), 1961.
#[must_use]
pub fn least(matrix: DMat3) -> ([f64; 3], DVec3) {
    let by_rotations = || {
        let eigen = symmetric(matrix);
        (eigen.values, eigen.vectors[0])
    };
    let diagonal = DVec3::new(matrix.x_axis.x, matrix.y_axis.y, matrix.z_axis.z);
    let (xy, xz, yz) = (matrix.y_axis.x, matrix.z_axis.x, matrix.z_axis.y);
    let mean = diagonal.element_sum() / 3.0;
    let away = diagonal - mean;
    let size = ((away.length_squared() + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    if size.is_nan() || size <= EVEN * mean.abs() {
        return by_rotations();
    }
    let determinant = away.x * (away.y * away.z - yz * yz) - xy * (xy * away.z - yz * xz)
        + xz * (xy * yz - away.y * xz);
    let angle = (determinant / (2.0 * size * size * size)).clamp(-1.0, 1.0).acos() / 3.0;
    let (sine, cosine) = angle.sin_cos();
    let largest = mean + 2.0 * size * cosine;
    // The cosine of the angle and a third of a turn.
    let smallest = mean - size * (cosine + 3f64.sqrt() * sine);
    let rows = [
        DVec3::new(diagonal.x - smallest, xy, xz),
        DVec3::new(xy, diagonal.y - smallest, yz),
        DVec3::new(xz, yz, diagonal.z - smallest),
    ];
    let normals = [rows[0].cross(rows[1]), rows[0].cross(rows[2]), rows[1].cross(rows[2])];
    let longest = normals.into_iter().fold(DVec3::ZERO, |longest, normal| {
        if normal.length_squared() > longest.length_squared() { normal } else { longest }
    });
    let length = longest.length();
    if length.is_nan() || length <= EVEN * size * size {
        return by_rotations();
    }
    ([smallest, 3.0 * mean - largest - smallest, largest], longest / length)
}

/// Share of the matrix below which differences of eigenvalues are those of rounding: the roots are exact to
/// about the square root of a rounding error where two coincide.
const EVEN: f64 = 1e-6;

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
    fn the_least_is_that_of_rotations() {
        let mut random = Random::new(8);
        for i in 0..3000 {
            let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
            let size = [1.0, 0.1, 1e-4][i % 3];
            let matrix =
                outer(random.in_ball()) + outer(random.in_ball()) + outer(random.in_ball() * size);
            let (values, vector) = least(matrix);
            let expected = symmetric(matrix);
            for (value, expected) in values.iter().zip(expected.values) {
                assert!((value - expected).abs() < 1e-13, "{value} {expected}");
            }
            // Rounding errors of the least, over its distance from the next.
            let apart = expected.values[1] - expected.values[0];
            let angle = vector.cross(expected.vectors[0]).length();
            assert!(angle < 1e-12 / apart, "{angle} {apart}");
        }
        for matrix in
            [DMat3::ZERO, DMat3::IDENTITY, DMat3::from_diagonal(DVec3::new(1.0, 0.0, 0.0))]
        {
            let (values, vector) = least(matrix);
            assert!((matrix * vector - values[0] * vector).length() < 1e-15);
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
