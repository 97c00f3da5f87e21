//! Noise is as theory says: mean, variance, spectrum, and what a pixel leaves of it. The twin stands
//! for the shader, which equals it.

use glam::{DVec3, UVec3};
use surfelshop_tests::procedural::noise::{
    DEVIATION, Lattice, Seed, attenuation, fade, scalar, to_a_quarter, vector,
};

fn seed(number: u32) -> [u32; 3] {
    [0x9e37_79b9u32, 0x85eb_ca6b, 0xc2b2_ae35].map(|odd| odd.wrapping_mul(number))
}

/// Cells after which the noise of these tests repeats, and samples a cell.
const PERIOD: usize = 8;
const PER_CELL: usize = 4;
const SIDE: usize = PERIOD * PER_CELL;

/// One period of noise; which of the three fields.
fn period(number: u32, field: usize) -> Vec<f64> {
    let seed = Seed { key: seed(number), mask: PERIOD as u32 - 1 };
    let place = |i: usize| {
        let index =
            UVec3::new((i % SIDE) as u32, (i / SIDE % SIDE) as u32, (i / SIDE / SIDE) as u32);
        // Off the lattice's corners, where noise is 0.
        (index.as_dvec3() + 0.5) / PER_CELL as f64
    };
    let start = Lattice { cell: UVec3::ZERO, rest: DVec3::ZERO };
    (0..SIDE.pow(3)).map(|i| vector(&start.moved(place(i)), &seed)[field]).collect()
}

/// F and x F of the noise's kernel, F = 1 - fade, -1 to 1.
fn kernel(x: f64) -> [f64; 2] {
    let f = if x.abs() < 1.0 { 1.0 - fade(x.abs()) } else { 0.0 };
    [f, x * f]
}

const STEPS: i32 = 400;

/// The integral of a function over -1 to 1 by the midpoint rule.
fn integral(f: impl Fn(f64) -> f64) -> f64 {
    let h = 2.0 / f64::from(STEPS);
    (0..STEPS).map(|i| f((f64::from(i) + 0.5) * h - 1.0) * h).sum()
}

#[test]
fn the_factor_makes_the_deviation_a_quarter() {
    assert!((to_a_quarter() - 1.308_01).abs() < 1e-5, "{}", to_a_quarter());
}

/// 24 periods of 8^3 independent gradients: the variance of 12,288 samples' worth of independent
/// numbers is known to 1.3 %, and five of that are allowed; the mean to a quarter / sqrt(12,288).
#[test]
fn mean_and_variance_are_those_of_theory() {
    for field in 0..3 {
        let (mut sum, mut squares, mut n) = (0.0, 0.0, 0.0);
        for number in 0..24 {
            for value in period(number, field) {
                sum += value;
                squares += value * value;
                n += 1.0;
            }
        }
        let (mean, variance): (f64, f64) = (sum / n, squares / n);
        assert!(mean.abs() < 5.0 * DEVIATION / 12_288f64.sqrt(), "{mean}");
        let ratio = variance / DEVIATION.powi(2);
        assert!((ratio - 1.0).abs() < 0.065, "{field}: {ratio}");
    }
}

/// The three fields, and those of different seeds, have nothing to do with each other.
#[test]
fn fields_and_seeds_are_independent() {
    let correlation = |a: &[f64], b: &[f64]| -> f64 {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    };
    let fields = [(1, 0), (1, 1), (1, 2), (2, 0), (65_535, 0)].map(|(n, field)| period(n, field));
    for (i, a) in fields.iter().enumerate() {
        for b in &fields[..i] {
            // 512 gradients: 1 / sqrt(512) is one deviation.
            assert!(correlation(a, b).abs() < 5.0 / 512f64.sqrt(), "{}", correlation(a, b));
        }
    }
}

/// Power by the length of the wave vector, waves along the period rounded to whole numbers.
fn shells(power: impl Fn([i32; 3]) -> f64) -> Vec<f64> {
    let most = SIDE as i32 / 2;
    let mut shells = vec![0.0; most as usize];
    for x in -most..most {
        for y in -most..most {
            for z in -most..most {
                let length = f64::from(x * x + y * y + z * z).sqrt().round() as usize;
                if length < shells.len() {
                    shells[length] += power([x, y, z]);
                }
            }
        }
    }
    shells
}

/// The discrete Fourier transform along one axis after the other; real and imaginary parts.
fn transformed(values: Vec<f64>) -> Vec<[f64; 2]> {
    let turn = |k: usize| {
        let angle = -std::f64::consts::TAU * k as f64 / SIDE as f64;
        [angle.cos(), angle.sin()]
    };
    let turns: Vec<[f64; 2]> = (0..SIDE).map(turn).collect();
    let mut data: Vec<[f64; 2]> = values.into_iter().map(|v| [v, 0.0]).collect();
    for stride in [1, SIDE, SIDE * SIDE] {
        let mut next = vec![[0.0; 2]; data.len()];
        for (i, out) in next.iter_mut().enumerate() {
            let k = i / stride % SIDE;
            let base = i - k * stride;
            for j in 0..SIDE {
                let ([a, b], [c, d]) = (data[base + j * stride], turns[j * k % SIDE]);
                out[0] += a * c - b * d;
                out[1] += a * d + b * c;
            }
        }
        data = next;
    }
    data
}

/// The power of noise is that of its kernel: noise is a sum of kernels `(g . x) F(x) F(y) F(z)` at
/// the lattice's corners with independent gradients g, so its spectrum is the squared transform of
/// the kernel's three parts. Sampling folds frequencies beyond 2 a cell back; next to nothing is there.
///
/// Invariant: noise has the mean, variance and spectrum of theory, and a pixel leaves of it what
/// its autocorrelation says
#[test]
fn the_spectrum_is_that_of_the_kernel_and_peaks_where_it_does() {
    let transforms: Vec<[f64; 2]> = (0..=SIDE as i32 / 2)
        .map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / PERIOD as f64;
            let even = integral(|x| kernel(x)[0] * (angle * x).cos());
            let odd = integral(|x| kernel(x)[1] * (angle * x).sin());
            [even * even, odd * odd]
        })
        .collect();
    let theory = shells(|wave| {
        let [x, y, z] = wave.map(|k| transforms[k.unsigned_abs() as usize]);
        x[1] * y[0] * z[0] + x[0] * y[1] * z[0] + x[0] * y[0] * z[1]
    });
    let mut measured = vec![0.0; theory.len()];
    for number in 0..12 {
        let data = transformed(period(100 + number, 0));
        let index = |k: i32| k.rem_euclid(SIDE as i32) as usize;
        let found = shells(|[x, y, z]| {
            let [a, b] = data[index(x) + SIDE * (index(y) + SIDE * index(z))];
            a * a + b * b
        });
        measured.iter_mut().zip(found).for_each(|(sum, found)| *sum += found);
    }
    let normed = |shells: &[f64]| -> Vec<f64> {
        let all: f64 = shells.iter().sum();
        shells.iter().map(|power| power / all).collect()
    };
    let (theory, measured) = (normed(&theory), normed(&measured));
    let peak = |shells: &[f64]| {
        let larger = |a: &usize, b: &usize| shells[*a].total_cmp(&shells[*b]);
        (0..shells.len()).max_by(larger).unwrap_or(0)
    };
    let at = peak(&theory);
    // Between a half and one wave a cell.
    assert!((PERIOD / 2..=PERIOD).contains(&at), "{at}");
    assert!(measured[0] < 1e-3, "no mean");
    assert!(measured[at] > 0.97 * measured[peak(&measured)], "{measured:?}, {theory:?}");
    for (k, (measured, theory)) in measured.iter().zip(&theory).enumerate().skip(2) {
        // A shell has half of 4 pi k^2 independent waves in 12 periods; each power is as uncertain as
        // it is large.
        let deviation = theory / (0.5 * 12.566 * (k * k) as f64 * 12.0).sqrt();
        assert!((measured - theory).abs() < 5.0 * deviation + 2e-4, "{k}: {measured} for {theory}");
    }
}

/// Autocorrelation of the kernel's parts at a distance along an axis.
fn autocorrelation(distance: f64) -> [f64; 2] {
    [0, 1].map(|part| integral(|x| kernel(x)[part] * kernel(x + distance)[part]))
}

#[test]
fn a_pixel_leaves_what_the_autocorrelation_says() {
    // By distance in hundredths of a cell; 0 beyond 2.
    let table: Vec<[f64; 2]> = (0..=200).map(|i| autocorrelation(f64::from(i) * 0.01)).collect();
    let of = |x: f64| {
        let t = x.abs() * 100.0;
        let i = t as usize;
        if i >= 200 {
            return [0.0; 2];
        }
        [0, 1].map(|part| table[i][part] + (table[i + 1][part] - table[i][part]) * (t - i as f64))
    };
    let rho = |at: DVec3| {
        let [x, y, z] = at.to_array().map(of);
        let [b, a] = table[0];
        (x[1] * y[0] * z[0] + x[0] * y[1] * z[0] + x[0] * y[0] * z[1]) / (3.0 * a * b * b)
    };
    // Directions evenly over the sphere, and one at right angles to each.
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let n = 400;
    let frames: Vec<(DVec3, DVec3)> = (0..n)
        .map(|i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
            let (r, phi) = ((1.0 - z * z).sqrt(), golden * f64::from(i));
            let u = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            let (a, b) = u.any_orthonormal_pair();
            (u, a * (1.7 * f64::from(i)).cos() + b * (1.7 * f64::from(i)).sin())
        })
        .collect();
    let left = |across: f64, along: f64| -> f64 {
        let steps = |width: f64| if width > 0.0 { 24 } else { 1 };
        let (m, k) = (steps(across), steps(along));
        let mut sum = 0.0;
        for (u, v) in &frames {
            for i in 0..m * k {
                let place =
                    |i: i32, m: i32, w: f64| ((f64::from(i) + 0.5) / f64::from(m) - 0.5) * w;
                sum += rho(place(i % m, m, across) * *u + place(i / m, k, along) * *v);
            }
        }
        sum / (frames.len() as f64 * f64::from(m * k))
    };
    for w in [0.1, 0.3, 0.6, 1.0, 1.3, 1.7, 2.2, 3.0, 4.0] {
        let exact = left(w, 0.0);
        assert!((attenuation([w, 0.0]) - exact).abs() < 0.0065, "{w}: {exact}");
    }
    for (u, v) in [(0.5, 0.5), (1.0, 1.0), (2.0, 2.0), (0.5, 3.0), (1.0, 4.0), (3.0, 3.0)] {
        let exact = left(u, v);
        assert!((attenuation([u, v]) - exact).abs() < 0.03, "{u} {v}: {exact}");
    }
}

#[test]
fn the_scalar_noise_is_the_first_of_three() {
    let start = Lattice { cell: UVec3::ZERO, rest: DVec3::ZERO };
    let l = start.moved(DVec3::new(-3.7, 1e6 + 0.3, 12.01));
    let seed = Seed { key: seed(3), mask: (1 << 28) - 1 };
    assert_eq!(scalar(&l, &seed), vector(&l, &seed).x);
    assert_eq!(l.cell.x, (1 << 28) - 4);
}
