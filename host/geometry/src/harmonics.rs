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

use glam::DVec3;

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

/// The coefficients of what a white diffuse surface radiates, by its normal, up to an order;
/// `window` is the strength of a Laplacian window, 0 for none.
#[must_use]
pub fn of_diffuse_surface(light: &Coefficients, order: usize, window: f64) -> Coefficients {
    let mut result = [[0.0; 3]; MAX_COEFFICIENTS];
    for (i, (to, from)) in result.iter_mut().zip(light).enumerate() {
        let l = order_of(i);
        if l <= order {
            let square = (l * (l + 1)) as f64;
            let weight =
                CLAMPED_COSINE[l] / std::f64::consts::PI / (1.0 + window * square * square);
            *to = from.map(|value| value * weight);
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

/// The smallest value of any channel over the sphere, to about a millionth of the largest
/// coefficient.
#[must_use]
pub fn minimum(coefficients: &Coefficients) -> f64 {
    let least = |n: DVec3| evaluate(coefficients, n).into_iter().fold(f64::INFINITY, f64::min);
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

/// The weakest window, if any is needed, under which no diffuse surface is darker than black, to
/// one part in a thousand of itself.
///
/// Zero where the light needs none, and where it is black or negative everywhere, which no window
/// mends.
#[must_use]
pub fn window_against_ringing(light: &Coefficients, order: usize) -> f64 {
    let minimum = |window: f64| minimum(&of_diffuse_surface(light, order, window));
    if minimum(0.0) >= 0.0 || light[0].iter().any(|mean| mean.is_nan() || *mean <= 0.0) {
        return 0.0;
    }
    // A lone point of light needs 0.178 at order 2; orders above are damped more by the same.
    let (mut low, mut high) = (0.0, 0.25);
    while minimum(high) < 0.0 && high < 1e6 {
        (low, high) = (high, 4.0 * high);
    }
    while high - low > 1e-3 * high {
        let middle = 0.5 * (low + high);
        if minimum(middle) < 0.0 { low = middle } else { high = middle }
    }
    high
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
        let least = minimum(&of_diffuse_surface(&light, 2, 0.0));
        let expected = 2.0 * (3.0 / 32.0 - 8.0 / 15.0 / 4.0) / PI;
        assert!((least - expected).abs() < 1e-6, "{least} instead of {expected}");
        let window = window_against_ringing(&light, 2);
        assert!((window - 0.178).abs() < 0.001, "{window}");
        for order in 1..=MAX_ORDER {
            let window = window_against_ringing(&light, order);
            let least = minimum(&of_diffuse_surface(&light, order, window));
            assert!(least >= -1e-12, "order {order}: {least}");
        }
    }

    #[test]
    fn even_light_stays_as_it_is() {
        let mut light = [[0.0; 3]; MAX_COEFFICIENTS];
        light[0] = [(4.0 * PI).sqrt() * 0.7; 3];
        assert_eq!(window_against_ringing(&light, 4), 0.0);
        let surface = of_diffuse_surface(&light, 4, 0.0);
        for n in directions(50) {
            assert!((evaluate(&surface, n)[1] - 0.7).abs() < 1e-12);
        }
        assert_eq!(window_against_ringing(&[[0.0; 3]; MAX_COEFFICIENTS], 2), 0.0);
    }
}
