//! Elementary functions from additions, multiplications, divisions and square roots alone.
//!
//! Those four are rounded alike on every machine; the sine of a C library is not. The sample must
//! come out bit for bit the same wherever it is made, so nothing here calls the platform.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Sine and cosine of an angle in radians. The error stays below 1e-11 for angles up to 1e4.
#[must_use]
pub fn sin_cos(angle: f64) -> (f64, f64) {
    let turn = angle - TAU * (angle / TAU).round();
    // The angle is halved three times, where the series converge fast, and doubled back.
    let x = turn / 8.0;
    let x2 = x * x;
    let mut sin = x * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0))));
    let mut cos = 1.0
        - x2 / 2.0 * (1.0 - x2 / 12.0 * (1.0 - x2 / 30.0 * (1.0 - x2 / 56.0 * (1.0 - x2 / 90.0))));
    for _ in 0..3 {
        (sin, cos) = (2.0 * sin * cos, cos * cos - sin * sin);
    }
    (sin, cos)
}

/// Sine of an angle in radians; see [`sin_cos`].
#[must_use]
pub fn sin(angle: f64) -> f64 {
    sin_cos(angle).0
}

/// The angle of the point (x, y) in (-pi, pi]; 0 for the origin. The error stays below 1e-10.
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    if x == 0.0 && y == 0.0 {
        return 0.0;
    }
    let (low, high) = if x.abs() < y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    let mut angle = atan_of_at_most_one(low / high);
    if x.abs() < y.abs() {
        angle = FRAC_PI_2 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    if y < 0.0 { -angle } else { angle }
}

/// Halves the angle twice by the half-angle formula, then sums the series.
fn atan_of_at_most_one(tangent: f64) -> f64 {
    let half = |t: f64| t / (1.0 + (1.0 + t * t).sqrt());
    let t = half(half(tangent));
    let t2 = t * t;
    let mut sum = 0.0;
    for odd in [17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        sum = 1.0 / odd - t2 * sum;
    }
    4.0 * t * sum
}

/// The exponential function; meant for exponents of moderate size, |x| < 50.
#[must_use]
pub fn exp(x: f64) -> f64 {
    let small = x / 1024.0;
    let series = 1.0 + small * (1.0 + small / 2.0 * (1.0 + small / 3.0 * (1.0 + small / 4.0)));
    // Ten squarings undo the division by 1024.
    (0..10).fold(series, |power, _| power * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_platform() {
        for step in -4000..4000 {
            let angle = f64::from(step) * 0.0173;
            let (sin, cos) = sin_cos(angle);
            assert!((sin - angle.sin()).abs() < 1e-11, "sin({angle})");
            assert!((cos - angle.cos()).abs() < 1e-11, "cos({angle})");
        }
    }

    #[test]
    fn angle_agrees_with_the_platform_in_every_quadrant() {
        for step in 0..720 {
            let angle = f64::from(step).to_radians() / 2.0;
            let (y, x) = (3.0 * angle.sin(), 3.0 * angle.cos());
            assert!((atan2(y, x) - y.atan2(x)).abs() < 1e-10, "at {angle}");
        }
    }

    #[test]
    fn exponential_agrees_with_the_platform() {
        for step in -100..100 {
            let x = f64::from(step) * 0.05;
            assert!((exp(x) / x.exp() - 1.0).abs() < 1e-10, "exp({x})");
        }
    }
}
