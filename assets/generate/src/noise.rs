//! Deterministic randomness: a small generator for placing things, and fields for textures.

use glam::{DVec3, I64Vec3};

/// A sequence of pseudo-random numbers: a Weyl sequence whose members are scrambled.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The sequence of this seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number, even in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        unit_from(scramble(self.0))
    }

    /// The next number, even between two bounds.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// The next point in the cube [-1, 1)^3.
    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}

/// Spreads every bit of the input over the whole output.
const fn scramble(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    bits = (bits ^ (bits >> 29)).wrapping_mul(0xa076_1d64_78bd_642f);
    bits ^ (bits >> 32)
}

/// The upper 53 bits as a fraction: all an `f64` can hold.
fn unit_from(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// A number in [0, 1) that belongs to a lattice point.
fn at_lattice(point: I64Vec3, salt: u64) -> f64 {
    let mut bits = salt.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for coordinate in point.to_array() {
        bits = scramble(bits ^ coordinate.cast_unsigned());
    }
    unit_from(bits)
}

/// Smooth noise in [-1, 1] with features of about unit size: lattice values, blended by a quintic
/// so that normals of displaced surfaces stay continuous.
#[must_use]
pub fn smooth(point: DVec3) -> f64 {
    let floor = point.floor();
    let cell = floor.as_i64vec3();
    let t = point - floor;
    let w = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let mut sum = 0.0;
    for corner in 0..8 {
        let offset = I64Vec3::new(corner & 1, (corner >> 1) & 1, corner >> 2);
        let along = |take: i64, weight: f64| if take == 1 { weight } else { 1.0 - weight };
        let weight = along(offset.x, w.x) * along(offset.y, w.y) * along(offset.z, w.z);
        sum += weight * at_lattice(cell + offset, 0);
    }
    sum * 2.0 - 1.0
}

/// Three octaves of [`smooth`], in [-1, 1].
#[must_use]
pub fn rough(point: DVec3) -> f64 {
    let octave = |scale: f64| smooth(point * scale + DVec3::splat(scale * 3.7));
    (octave(1.0) * 4.0 + octave(2.1) * 2.0 + octave(4.3)) / 7.0
}

/// Rounded pebbles side by side: 1 at the middle of a cell of about unit size, falling to about 0
/// at the seams between cells.
#[must_use]
pub fn pebbled(point: DVec3) -> f64 {
    let cell = point.floor().as_i64vec3();
    let mut nearest = f64::MAX;
    for index in 0..27 {
        let neighbour = cell + I64Vec3::new(index % 3 - 1, index / 3 % 3 - 1, index / 9 - 1);
        let jitter = DVec3::new(
            at_lattice(neighbour, 1),
            at_lattice(neighbour, 2),
            at_lattice(neighbour, 3),
        );
        nearest = nearest.min((neighbour.as_dvec3() + jitter).distance_squared(point));
    }
    (1.0 - nearest).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_repeat_with_the_seed() {
        let mut random = Random::new(7);
        let numbers: Vec<f64> = (0..10_000).map(|_| random.unit()).collect();
        let mean = numbers.iter().sum::<f64>() / 10_000.0;
        // The mean of 10 000 even numbers deviates by 0.0029; this allows five times that.
        assert!((mean - 0.5).abs() < 0.015, "mean {mean}");
        assert_eq!(numbers[0].to_bits(), Random::new(7).unit().to_bits());
    }

    #[test]
    fn noise_stays_in_its_range_and_varies() {
        let mut random = Random::new(1);
        let values: Vec<f64> = (0..2_000).map(|_| smooth(random.in_cube() * 50.0)).collect();
        assert!(values.iter().all(|value| value.abs() <= 1.0));
        assert!(values.iter().any(|value| *value > 0.5) && values.iter().any(|v| *v < -0.5));
    }
}
