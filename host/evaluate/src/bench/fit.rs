//! How fast something grows.

/// Points at the end that count: what is fixed for each frame hides growth at the beginning.
const LAST: usize = 3;

/// The power of x that y grows with over the last points, by least squares of the logarithms; `None`
/// where fewer than two points have both above 0, or x stays the same.
pub(super) fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let is_sound = |value: f64| value.is_finite() && value > 0.0;
    let points: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| is_sound(*x) && is_sound(*y))
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let last = points.get(points.len().saturating_sub(LAST)..)?;
    let n = last.len() as f64;
    let (x, y) = last.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (over, under) = last
        .iter()
        .map(|(a, b)| ((a - x) * (b - y), (a - x).powi(2)))
        .fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (under > 0.0).then(|| over / under)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_found() {
        for power in [-0.5, 0.0, 1.0, 1.7] {
            let points: Vec<_> =
                [1e4, 3e4, 1e5, 3e5, 1e6].iter().map(|&n: &f64| (n, 0.2 * n.powf(power))).collect();
            let found = exponent(&points).unwrap();
            // Rounding of logarithms alone.
            assert!((found - power).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn what_is_fixed_at_the_beginning_does_not_count() {
        let time = |n: f64| if n < 1e5 { 50.0 } else { n * 1e-3 };
        let all = [1e3, 1e4, 1e5, 2e5, 4e5, 8e5].map(|n| (n, time(n)));
        assert!((exponent(&all).unwrap() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn one_point_says_nothing() {
        assert_eq!(exponent(&[]), None);
        assert_eq!(exponent(&[(1.0, 2.0)]), None);
        assert_eq!(exponent(&[(2.0, 2.0), (2.0, 3.0)]), None);
        assert_eq!(exponent(&[(1.0, 2.0), (2.0, 0.0), (0.0, 1.0), (3.0, f64::NAN)]), None);
    }
}
