//! Twin of the WGSL module `surfelshop::filtered` in f64.

use std::f64::consts::{PI, SQRT_2, TAU};

/// A value that varies inside a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Filtered {
    /// Its mean.
    pub mean: f64,
    /// Its standard deviation, at least 0.
    pub deviation: f64,
}

/// As the shader's.
const LEAST_DEVIATION: f64 = 1e-12;

impl Filtered {
    /// A mean and a deviation.
    #[must_use]
    pub fn new(mean: f64, deviation: f64) -> Self {
        Self { mean, deviation }
    }

    /// factor x + offset.
    #[must_use]
    pub fn scaled(self, factor: f64, offset: f64) -> Self {
        Self::new(factor * self.mean + offset, factor.abs() * self.deviation)
    }

    /// x + y, independent.
    #[must_use]
    pub fn sum(self, other: Self) -> Self {
        Self::new(self.mean + other.mean, self.deviation.hypot(other.deviation))
    }

    fn divisor(self) -> f64 {
        self.deviation.max(LEAST_DEVIATION)
    }

    /// |x|.
    #[must_use]
    pub fn magnitude(self) -> Self {
        let s = self.divisor();
        let z = self.mean / s;
        let mean = self.mean * libm::erf(z / SQRT_2) + (2.0 / PI).sqrt() * s * (-0.5 * z * z).exp();
        let variance = self.mean.powi(2) + self.deviation.powi(2) - mean * mean;
        Self::new(mean, variance.max(0.0).sqrt())
    }

    /// The share of x above an edge.
    #[must_use]
    pub fn above(self, edge: f64) -> f64 {
        0.5 * libm::erfc((edge - self.mean) / self.divisor() / SQRT_2)
    }

    /// max(x - edge, 0).
    #[must_use]
    pub fn excess(self, edge: f64) -> f64 {
        let d = self.mean - edge;
        let z = d / self.divisor();
        d * self.above(edge) + self.divisor() / TAU.sqrt() * (-0.5 * z * z).exp()
    }

    /// (x - low) / (high - low) between 0 and 1.
    #[must_use]
    pub fn ramp(self, low: f64, high: f64) -> f64 {
        ((self.excess(low) - self.excess(high)) / (high - low)).clamp(0.0, 1.0)
    }

    /// exp(-(x / width)^2).
    #[must_use]
    pub fn line(self, width: f64) -> f64 {
        let wide = width * width + 2.0 * self.deviation.powi(2);
        width / wide.sqrt() * (-self.mean.powi(2) / wide).exp()
    }

    /// Such lines at every whole number.
    #[must_use]
    pub fn lines(self, width: f64) -> f64 {
        let m = self.mean - self.mean.floor();
        let sum: f64 =
            (-1..=2).map(|k| Self::new(m - f64::from(k), self.deviation).line(width)).sum();
        sum + (PI.sqrt() * width - sum) * self.blurred()
    }

    /// How little of anything of period 1 is left to be seen.
    fn blurred(self) -> f64 {
        let t = ((self.deviation - 0.3) / 0.15).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// sin(2 pi x).
    #[must_use]
    pub fn wave(self) -> f64 {
        (-0.5 * (TAU * self.deviation).powi(2)).exp() * (TAU * self.mean).sin()
    }

    /// 1 in the first `duty` of each period of 1, else 0.
    #[must_use]
    pub fn pulse(self, duty: f64) -> f64 {
        let one = Self::new(self.mean - self.mean.floor(), self.deviation);
        let share: f64 =
            (-1..=1).map(|k| one.above(f64::from(k)) - one.above(f64::from(k) + duty)).sum();
        share + (duty - share) * self.blurred()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a function over a normally distributed value, by the midpoint rule over eight
    /// deviations.
    fn mean_of(x: Filtered, f: impl Fn(f64) -> f64) -> f64 {
        let n = 400_000;
        let step = 16.0 / f64::from(n);
        let z = |i: i32| (f64::from(i) + 0.5) * step - 8.0;
        let density = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt() * step;
        (0..n).map(|i| f(x.mean + x.deviation * z(i)) * density(z(i))).sum()
    }

    /// The closed forms are what sums over the distribution say. Tolerance: the rule's own error at
    /// a jump, a step's share of the density.
    #[test]
    fn means_are_what_sums_over_the_distribution_say() {
        for (mean, deviation) in [(0.0, 0.3), (0.7, 0.05), (-0.2, 1.1), (0.31, 0.0), (3.3, 0.2)] {
            let x = Filtered::new(mean, deviation);
            let same = |found: f64, f: &dyn Fn(f64) -> f64| {
                let expected = mean_of(x, f);
                assert!((found - expected).abs() < 3e-5, "{x:?}: {found} for {expected}");
            };
            same(x.magnitude().mean, &f64::abs);
            same(x.above(0.25), &|x| f64::from(u8::from(x > 0.25)));
            same(x.excess(0.25), &|x| (x - 0.25).max(0.0));
            same(x.ramp(-0.1, 0.4), &|x| ((x + 0.1) / 0.5).clamp(0.0, 1.0));
            same(x.line(0.3), &|x| (-(x / 0.3).powi(2)).exp());
            same(x.wave(), &|x| (TAU * x).sin());
            let second = mean_of(x, |y| (y.abs() - x.magnitude().mean).powi(2));
            assert!((x.magnitude().deviation - second.sqrt()).abs() < 1e-3, "{x:?}");
        }
        // The pulse keeps to three periods: a deviation of 0.3 has 4e-4 beyond them, and one above
        // 0.45 a visible wave of e^-(2 (0.45 pi)^2) = 0.02 that it leaves out.
        for (deviation, tolerance) in
            [(0.0, 3e-5), (0.1, 1e-4), (0.3, 2e-3), (0.45, 0.02), (2.0, 1e-3)]
        {
            for mean in [-0.9, 0.1, 0.4, 0.77, 12.3] {
                let x = Filtered::new(mean, deviation);
                let expected = mean_of(x, |x| f64::from(u8::from(x - x.floor() < 0.36)));
                let found = x.pulse(0.36);
                assert!((found - expected).abs() < tolerance, "{x:?}: {found} for {expected}");
                let expected = mean_of(x, |x| {
                    let to_line = x - x.round();
                    (-1..=1).map(|k| (-((to_line + f64::from(k)) / 0.1).powi(2)).exp()).sum()
                });
                let found = x.lines(0.1);
                assert!((found - expected).abs() < tolerance, "{x:?}: {found} for {expected}");
            }
        }
    }
}
