//! Real spherical harmonics up to order 5 and what they say of the light on a surface.
//!
//! Coefficients are ordered `l (l + 1) + m`; the basis is orthonormal over the sphere and has no
//! Condon-Shortley sign: order 1 is `0.488603 (y, z, x)` for m = -1, 0, 1.
//!
//! A surface of albedo 1 under the radiance `sum L_lm Y_lm` has the radiance
//! `sum A_l / pi L_lm Y_lm(n)`: the clamped cosine keeps orders 0, 1 and the even ones.
//!
//! Source: Ramamoorthi & Hanrahan 2001, "An Efficient Representation for Irradiance Environment
//! Maps", equations 3 to 8; errata T2, T3, T4 and T8 of the thesis that repeats them. Window:
//! Sloan 2008, "Stupid Spherical Harmonics Tricks", section "Windowing".

mod rotation;

use glam::DVec3;
pub use rotation::rotation;

/// The highest order.
pub const MAX_ORDER: usize = 5;

/// Number of coefficients up to [`MAX_ORDER`].
pub const MAX_COEFFICIENTS: usize = (MAX_ORDER + 1) * (MAX_ORDER + 1);

/// Number of coefficients up to an order.
#[must_use]
pub const fn n_coefficients(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// What the clamped cosine makes of each order: `A_l sqrt(4 pi / (2 l + 1))` of the paper, so that
/// irradiance is `sum` of this times `L_lm Y_lm`.
///
/// Source: Ramamoorthi & Hanrahan 2001, equation 8; erratum T8.
pub const CLAMPED_COSINE: [f64; MAX_ORDER + 1] = {
    use std::f64::consts::PI;
    [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0, 0.0]
};

/// All basis functions up to [`MAX_ORDER`] at a unit direction. NaN where the direction is.
#[must_use]
pub fn basis(n: DVec3) -> [f64; MAX_COEFFICIENTS] {
    let mut values = [0.0; MAX_COEFFICIENTS];
    // cos(m phi) and sin(m phi) times sin(theta)^m, as polynomials: no pole needs care.
    let (mut cosine, mut sine) = (1.0, 0.0);
    // P_mm over sin(theta)^m, without the sign (-1)^m.
    let mut p_mm = 1.0;
    for m in 0..=MAX_ORDER {
        if m > 0 {
            (cosine, sine) = (n.x * cosine - n.y * sine, n.x * sine + n.y * cosine);
            p_mm *= (2 * m - 1) as f64;
        }
        let (mut before, mut p) = (0.0, p_mm);
        for l in m..=MAX_ORDER {
            if l > m {
                let (lf, mf) = (l as f64, m as f64);
                let next = ((2.0 * lf - 1.0) * n.z * p - (lf + mf - 1.0) * before) / (lf - mf);
                (before, p) = (p, next);
            }
            let middle = l * (l + 1);
            let k = normalisation(l, m) * p;
            if m == 0 {
                values[middle] = k;
            } else {
                values[middle + m] = std::f64::consts::SQRT_2 * k * cosine;
                values[middle - m] = std::f64::consts::SQRT_2 * k * sine;
            }
        }
    }
    values
}

/// `sqrt((2 l + 1) (l - m)! / (4 pi (l + m)!))`.
fn normalisation(l: usize, m: usize) -> f64 {
    let ratio: f64 = (l - m + 1..=l + m).map(|k| k as f64).product();
    ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI * ratio)).sqrt()
}

/// The order of a coefficient.
#[must_use]
pub const fn order_of(index: usize) -> usize {
    let mut l = 0;
    while n_coefficients(l) <= index {
        l += 1;
    }
    l
}

/// Colours of light on the sphere: one coefficient for each of three channels.
pub type Coefficients = [[f64; 3]; MAX_COEFFICIENTS];

/// Adds light that arrives from a direction: radiance times solid angle, linear.
pub fn add(coefficients: &mut Coefficients, towards: DVec3, radiance_times_angle: [f64; 3]) {
    for (sum, y) in coefficients.iter_mut().zip(basis(towards)) {
        for (channel, light) in sum.iter_mut().zip(radiance_times_angle) {
            *channel += y * light;
        }
    }
}

/// How orders are weighted against ringing, for one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Strength of the Laplacian window `1 / (1 + strength l^2 (l + 1)^2)`; 0 for none.
    pub strength: f64,
    /// The first order that is weighted.
    pub from: usize,
}

impl Window {
    /// The weight of an order, in (0, 1].
    #[must_use]
    pub fn weight(self, order: usize) -> f64 {
        let square = if order < self.from { 0.0 } else { (order * (order + 1)) as f64 };
        1.0 / (1.0 + self.strength * square * square)
    }
}

/// The coefficients of what a white diffuse surface radiates, by its normal, up to an order.
#[must_use]
pub fn of_diffuse_surface(
    light: &Coefficients,
    order: usize,
    windows: [Window; 3],
) -> Coefficients {
    let mut result = [[0.0; 3]; MAX_COEFFICIENTS];
    for (i, (to, from)) in result.iter_mut().zip(light).enumerate() {
        let l = order_of(i);
        if l <= order {
            for ((to, from), window) in to.iter_mut().zip(from).zip(windows) {
                *to = from * CLAMPED_COSINE[l] / std::f64::consts::PI * window.weight(l);
            }
        }
    }
    result
}

/// The value of each channel in a direction.
#[must_use]
pub fn evaluate(coefficients: &Coefficients, n: DVec3) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (coefficient, y) in coefficients.iter().zip(basis(n)) {
        for (channel, value) in sum.iter_mut().zip(coefficient) {
            *channel += y * value;
        }
    }
    sum
}

/// Directions the minimum is looked for in; order 5 has no two minima closer than they are apart.
const N_DIRECTIONS: usize = 2048;

/// The smallest value of a channel over the sphere, to about a millionth of the largest
/// coefficient.
#[must_use]
pub fn minimum(coefficients: &Coefficients, channel: usize) -> f64 {
    let least = |n: DVec3| {
        let sum = coefficients.iter().zip(basis(n)).map(|(value, y)| value[channel] * y);
        sum.sum::<f64>()
    };
    let mut found: Vec<(f64, DVec3)> = directions(N_DIRECTIONS).map(|n| (least(n), n)).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best = f64::INFINITY;
    for &(value, n) in found.iter().take(4) {
        best = best.min(descend(&least, value, n));
    }
    best
}

/// Walks downhill from a direction, with steps that halve.
fn descend(least: &impl Fn(DVec3) -> f64, mut value: f64, mut n: DVec3) -> f64 {
    let mut step = 4.0 / (N_DIRECTIONS as f64).sqrt();
    while step > 1e-4 {
        let (u, v) = n.any_orthonormal_pair();
        let tries = [u, -u, v, -v].map(|t| (n + step * t).normalize_or(n));
        let better = tries.into_iter().map(|t| (least(t), t)).min_by(|a, b| a.0.total_cmp(&b.0));
        match better {
            Some((lower, t)) if lower < value => (value, n) = (lower, t),
            _ => step *= 0.5,
        }
    }
    value
}

/// Directions evenly over the sphere, on a spiral.
///
/// Source: the golden-angle spiral; Gonzalez 2010, "Measurement of Areas on a Sphere Using
/// Fibonacci and Latitude-Longitude Lattices".
pub fn directions(n: usize) -> impl Iterator<Item = DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..n).map(move |i| {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
        let (s, c) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * c, r * s, z)
    })
}

/// Darkness below black, as a share of the mean, that is left to be cut off: where truth is dark
/// that is nearer to it than what a window does to everything else.
pub const CUT_OFF: f64 = 0.05;

/// Windows, one for each channel that needs one, under which no diffuse surface is darker than
/// minus [`CUT_OFF`] of the mean: of those that weight all orders and those that leave order 1 alone, the one that changes
/// the channel less.
///
/// None where the light is black or negative everywhere, which no window mends.
///
/// Source: Sloan 2008, "Stupid Spherical Harmonics Tricks", for the window; finding it channel by
/// channel is Filament's way.
#[must_use]
pub fn windows_against_ringing(light: &Coefficients, order: usize) -> [Window; 3] {
    [0, 1, 2].map(|channel| {
        let plain = of_diffuse_surface(light, order, [Window::default(); 3]);
        let mean = plain[0][channel] * basis(DVec3::Z)[0];
        let allowed = -CUT_OFF * mean;
        if mean.is_nan() || mean <= 0.0 || minimum(&plain, channel) >= allowed {
            return Window::default();
        }
        let change = |window: Window| -> f64 {
            let part = |(i, value): (usize, &[f64; 3])| {
                (value[channel] * (1.0 - window.weight(order_of(i)))).powi(2)
            };
            plain.iter().enumerate().map(part).sum()
        };
        let found = [1, 2].into_iter().filter_map(|from| weakest(&plain, channel, from, allowed));
        found.min_by(|a, b| change(*a).total_cmp(&change(*b))).unwrap_or_default()
    })
}

/// The weakest window from an order on under which a channel stays above a value, to one part in a
/// thousand; `None` where none suffices.
fn weakest(plain: &Coefficients, channel: usize, from: usize, allowed: f64) -> Option<Window> {
    let least = |strength: f64| {
        let window = Window { strength, from };
        let mut weighted = *plain;
        for (i, value) in weighted.iter_mut().enumerate() {
            value[channel] *= window.weight(order_of(i));
        }
        minimum(&weighted, channel)
    };
    // A lone point of light needs 0.178 at order 2; orders above are damped more by the same.
    let (mut low, mut high) = (0.0, 0.25);
    while least(high) < allowed {
        (low, high) = (high, 4.0 * high);
        if high > 1e6 {
            return None;
        }
    }
    while high - low > 1e-3 * high {
        let middle = 0.5 * (low + high);
        if least(middle) < allowed { low = middle } else { high = middle }
    }
    Some(Window { strength: high, from })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn low_orders_are_those_of_the_papers() {
        let n = DVec3::new(0.36, 0.48, 0.8);
        let y = basis(n);
        let expected = [
            0.282_094_791_8,
            0.488_602_511_9 * n.y,
            0.488_602_511_9 * n.z,
            0.488_602_511_9 * n.x,
            1.092_548_430_6 * n.x * n.y,
            1.092_548_430_6 * n.y * n.z,
            0.315_391_565_3 * (3.0 * n.z * n.z - 1.0),
            1.092_548_430_6 * n.x * n.z,
            0.546_274_215_3 * (n.x * n.x - n.y * n.y),
        ];
        for (i, (a, b)) in y.iter().zip(expected).enumerate() {
            assert!((a - b).abs() < 1e-9, "{i}: {a} instead of {b}");
        }
    }

    #[test]
    fn the_basis_is_orthonormal() {
        let n = 40_000;
        let mut products = vec![[0.0; MAX_COEFFICIENTS]; MAX_COEFFICIENTS];
        for direction in directions(n) {
            let y = basis(direction);
            for (row, a) in products.iter_mut().zip(y) {
                row.iter_mut().zip(y).for_each(|(sum, b)| *sum += a * b * 4.0 * PI / n as f64);
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                // The spiral's own error at this number of directions.
                assert!((value - expected).abs() < 2e-3, "{i} {j}: {value}");
            }
        }
    }

    #[test]
    fn the_cosine_s_orders_are_its_integrals() {
        let n = 20_000;
        for (l, expected) in CLAMPED_COSINE.into_iter().enumerate() {
            // The zonal coefficient of max(cos, 0), turned into a factor.
            let zonal: f64 = (0..n)
                .map(|i| {
                    let z = (f64::from(i) + 0.5) / f64::from(n);
                    let direction = DVec3::new((1.0 - z * z).sqrt(), 0.0, z);
                    z * basis(direction)[l * (l + 1)] * 2.0 * PI / f64::from(n)
                })
                .sum();
            let factor = zonal * (4.0 * PI / (2 * l + 1) as f64).sqrt();
            assert!((factor - expected).abs() < 1e-6, "order {l}: {factor}, {expected}");
        }
    }

    fn lone_light() -> Coefficients {
        let mut light = [[0.0; 3]; MAX_COEFFICIENTS];
        add(&mut light, DVec3::new(0.6, 0.0, 0.8), [1.0, 0.5, 2.0]);
        light
    }

    #[test]
    fn a_lone_light_rings_as_derived_and_the_window_ends_it() {
        // Of a lone light's order-2 irradiance 3/32 + t/2 + 15/32 t^2 over pi, at t = -8/15.
        let light = lone_light();
        let least = minimum(&of_diffuse_surface(&light, 2, [Window::default(); 3]), 2);
        let expected = 2.0 * (3.0 / 32.0 - 8.0 / 15.0 / 4.0) / PI;
        assert!((least - expected).abs() < 1e-6, "{least} instead of {expected}");
        let window =
            weakest(&of_diffuse_surface(&light, 2, [Window::default(); 3]), 2, 1, 0.0).unwrap();
        assert!((window.strength - 0.178).abs() < 0.001, "{window:?}");
        for order in 1..=MAX_ORDER {
            let windows = windows_against_ringing(&light, order);
            let surface = of_diffuse_surface(&light, order, windows);
            for channel in 0..3 {
                let least = minimum(&surface, channel);
                let mean = surface[0][channel] * basis(DVec3::Z)[0];
                assert!(least >= -1.001 * CUT_OFF * mean, "order {order}: {least}");
            }
        }
    }

    #[test]
    fn a_channel_that_does_not_ring_is_left_alone() {
        let mut light = lone_light();
        light[0] = [0.3, (4.0 * PI).sqrt() * 5.0, 0.6];
        let [red, green, blue] = windows_against_ringing(&light, 2);
        assert_eq!(green, Window::default());
        assert!(red.strength > 0.0 && blue.strength > 0.0, "{red:?} {blue:?}");
        // A little ringing costs order 1 nothing.
        light[0][0] = 0.9 * (4.0 * PI).sqrt() * 0.25;
        let [red, ..] = windows_against_ringing(&light, 2);
        assert!(red.strength == 0.0 || red.from == 2, "{red:?}");
    }

    #[test]
    fn even_light_stays_as_it_is() {
        let mut light = [[0.0; 3]; MAX_COEFFICIENTS];
        light[0] = [(4.0 * PI).sqrt() * 0.7; 3];
        assert_eq!(windows_against_ringing(&light, 4), [Window::default(); 3]);
        let surface = of_diffuse_surface(&light, 4, [Window::default(); 3]);
        for n in directions(50) {
            assert!((evaluate(&surface, n)[1] - 0.7).abs() < 1e-12);
        }
        let black = windows_against_ringing(&[[0.0; 3]; MAX_COEFFICIENTS], 2);
        assert_eq!(black, [Window::default(); 3]);
    }
}
