//! Surfaces of least bending through scattered heights.
//!
//! Source: Duchon, "Splines minimizing rotation-invariant semi-norms in Sobolev spaces", 1977.

use surfelshop_api::glam::DVec2;

/// A thin plate over a plane.
#[derive(Clone, Debug)]
pub(crate) struct ThinPlate {
    middle: DVec2,
    size: f64,
    centres: Vec<DVec2>,
    weights: Vec<f64>,
    /// Height in the middle, and slopes.
    plane: [f64; 3],
}

impl ThinPlate {
    /// The plate near heights at places of the plane: the larger `slack`, the less near; that of
    /// distances of a hundredth of the plate's size is about a thousandth. `None` where the places are on
    /// a line.
    pub(crate) fn through(places: &[DVec2], heights: &[f64], slack: f64) -> Option<Self> {
        let n = places.len();
        let middle = places.iter().sum::<DVec2>() / n.max(1) as f64;
        let size = places.iter().map(|place| place.distance(middle)).fold(0.0, f64::max);
        if n < 3 || size <= 0.0 {
            return None;
        }
        let centres: Vec<DVec2> = places.iter().map(|place| (*place - middle) / size).collect();
        let side = n + 3;
        let mut matrix = vec![0.0; side * side];
        let mut right = vec![0.0; side];
        for i in 0..n {
            for j in 0..n {
                matrix[i * side + j] = kernel(centres[i].distance_squared(centres[j]));
            }
            matrix[i * side + i] += slack;
            for (k, value) in [1.0, centres[i].x, centres[i].y].into_iter().enumerate() {
                matrix[i * side + n + k] = value;
                matrix[(n + k) * side + i] = value;
            }
            right[i] = heights[i];
        }
        let solution = solved(&mut matrix, right, side)?;
        let (weights, plane) = solution.split_at(n);
        let plane = [plane[0], plane[1], plane[2]];
        Some(Self { middle, size, centres, weights: weights.to_vec(), plane })
    }

    /// The height at a place.
    pub(crate) fn height(&self, place: DVec2) -> f64 {
        let at = (place - self.middle) / self.size;
        let bent = self.centres.iter().zip(&self.weights);
        let bent: f64 = bent.map(|(c, weight)| weight * kernel(c.distance_squared(at))).sum();
        bent + self.plane[0] + self.plane[1] * at.x + self.plane[2] * at.y
    }
}

/// r² log r, of the squared distance.
fn kernel(squared: f64) -> f64 {
    if squared > 0.0 { 0.5 * squared * squared.ln() } else { 0.0 }
}

/// The solution of a system of equations, by elimination with the largest pivot of each column; `None` where
/// there is none.
fn solved(matrix: &mut [f64], mut right: Vec<f64>, side: usize) -> Option<Vec<f64>> {
    for column in 0..side {
        let size = |row: usize| matrix[row * side + column].abs();
        let pivot = (column..side).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
        if size(pivot) <= 1e-12 || !size(pivot).is_finite() {
            return None;
        }
        if pivot != column {
            for k in 0..side {
                matrix.swap(pivot * side + k, column * side + k);
            }
            right.swap(pivot, column);
        }
        let (above, below) = matrix.split_at_mut((column + 1) * side);
        let pivot_row = &above[column * side..];
        for (i, row) in below.chunks_exact_mut(side).enumerate() {
            let factor = row[column] / pivot_row[column];
            if factor != 0.0 {
                for k in column..side {
                    row[k] -= factor * pivot_row[k];
                }
                right[column + 1 + i] -= factor * right[column];
            }
        }
    }
    for row in (0..side).rev() {
        let known: f64 = (row + 1..side).map(|k| matrix[row * side + k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row * side + row];
    }
    right.iter().all(|value| value.is_finite()).then_some(right)
}
