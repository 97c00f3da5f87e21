//! Twin of the WGSL module `surfelshop::noise` in f64; the hash is the same numbers.

use super::filtered::Filtered;
use glam::{DVec3, UVec3, Vec3};

/// A pixel's place in a pattern.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Where it is.
    pub position: DVec3,
    /// The axes of its outline.
    pub across: DVec3,
    /// The second.
    pub along: DVec3,
    /// Moves every lattice by so many cells: to see what an error of that size changes.
    pub jitter: DVec3,
}

/// Where a place lies in a lattice.
#[derive(Clone, Copy, Debug)]
pub struct Lattice {
    /// The cell, as the shader's 32 bits have it.
    pub cell: UVec3,
    /// 0 to 1 in there.
    pub rest: DVec3,
}

/// What is drawn from a lattice.
#[derive(Clone, Copy, Debug)]
pub struct Seed {
    /// Moves the hash.
    pub key: [u32; 3],
    /// Bits of the cells' numbers that count.
    pub mask: u32,
}

/// A frequency as it counts: its 12 leading bits.
#[must_use]
pub fn counted(frequency: Vec3) -> DVec3 {
    let bits = |f: f32| f32::from_bits(f.to_bits() & 0xffff_f000);
    Vec3::from(frequency.to_array().map(bits)).as_dvec3()
}

/// The lattice of a frequency.
#[must_use]
pub fn lattice(at: &Place, frequency: Vec3) -> Lattice {
    let start = Lattice { cell: UVec3::ZERO, rest: DVec3::ZERO };
    start.moved(at.position * counted(frequency) + at.jitter)
}

impl Lattice {
    /// The place moved by so many cells.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        let rest = self.rest + by;
        let whole = rest.floor();
        // In the shader's longest period, 2^28 cells.
        let added = whole.to_array().map(|cells| cells.rem_euclid(268_435_456.0) as u32);
        let cell = UVec3::from_array([0, 1, 2].map(|k| self.cell[k].wrapping_add(added[k])));
        Self { cell, rest: rest - whole }
    }
}

/// Three hashes of three numbers.
///
/// Source: Jarzynski & Olano 2020, "Hash Functions for GPU Rendering".
#[must_use]
pub fn pcg3d(seed: [u32; 3]) -> [u32; 3] {
    let [mut x, mut y, mut z] = seed.map(|v| v.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mut round = || {
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
    };
    round();
    let round = |x: u32, y: u32, z: u32| {
        let (mut x, mut y, mut z) = (x ^ (x >> 16), y ^ (y >> 16), z ^ (z >> 16));
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
        [x, y, z]
    };
    round(x, y, z)
}

fn gradient(bits: u32) -> DVec3 {
    DVec3::from([bits, bits >> 10, bits >> 20].map(|b| f64::from(b & 1023) * 2.0 / 1023.0 - 1.0))
}

/// Perlin's fade.
#[must_use]
pub fn fade(t: f64) -> f64 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Standard deviation of noise, averaged over its cells.
pub const DEVIATION: f64 = 0.25;

/// The factor that makes it so.
///
/// With gradients whose components have the variance v, the noise at x has the variance
/// `v sum_c |x - c|^2 W(x - c)^2` over the corners c with their weights W, whose mean over a cell
/// is `3 v a b^2` with `b = 2 int F^2 = 181 / 231` and `a = 2 int x^2 F^2` over [0, 1] for
/// `F = 1 - fade`. Components are evenly among 1024 numbers: `v = 1025 / 3069`.
#[must_use]
pub fn to_a_quarter() -> f64 {
    let n = 20_000;
    let x = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
    let integral = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(x(i))).sum::<f64>() / f64::from(n);
    let b = 2.0 * integral(&|x| (1.0 - fade(x)).powi(2));
    let a = 2.0 * integral(&|x| (x * (1.0 - fade(x))).powi(2));
    DEVIATION / (3.0 * 1025.0 / 3069.0 * a * b * b).sqrt()
}

/// As the shader's; [`to_a_quarter`] to six digits, by test.
const TO_A_QUARTER: f64 = 1.308_01;

/// Three noises of mean 0 and deviation 1/4; the first is the scalar one.
#[must_use]
pub fn vector(l: &Lattice, seed: &Seed) -> DVec3 {
    let weight = DVec3::from(l.rest.to_array().map(fade));
    let mut sum = DVec3::ZERO;
    for corner in 0..8u32 {
        let at = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2);
        let cell = [0, 1, 2]
            .map(|k| (l.cell[k].wrapping_add(at[k]) & seed.mask).wrapping_add(seed.key[k]));
        let h = pcg3d(cell);
        let from_corner = l.rest - at.as_dvec3();
        let w: f64 = (0..3).map(|k| if at[k] == 1 { weight[k] } else { 1.0 - weight[k] }).product();
        sum += w * DVec3::from(h.map(|bits| gradient(bits).dot(from_corner)));
    }
    TO_A_QUARTER * sum
}

/// The first of them.
#[must_use]
pub fn scalar(l: &Lattice, seed: &Seed) -> f64 {
    vector(l, seed).x
}

/// How wide the pixel's outline is in a lattice, cells.
#[must_use]
pub fn widths(at: &Place, frequency: Vec3) -> [f64; 2] {
    [at.across, at.along].map(|axis| (axis * frequency.as_dvec3()).length())
}

/// What a pixel of such widths leaves of the noise at its centre.
#[must_use]
pub fn attenuation(widths: [f64; 2]) -> f64 {
    let q = widths.map(|w| {
        let w = w.min(1e4);
        let bent = 0.15 * w * w * w;
        1.0 + w * w * (0.5676 + 1.496 * bent) / (1.0 + bent)
    });
    (q[0] * q[1]).sqrt().recip()
}

/// Noise over a pixel, from its value at the centre.
#[must_use]
pub fn over_pixel(value: f64, widths: [f64; 2]) -> Filtered {
    let a = attenuation(widths);
    Filtered::new(a * value, DEVIATION * (1.0 - a * a).max(0.0).sqrt())
}
