//! Random numbers that depend on pixel, sample and seed alone.

use surfelshop_api::glam::{Vec2, Vec3};

/// A sequence of numbers (`SplitMix64`, Steele et al. 2014).
pub(crate) struct Random(u64);

impl Random {
    /// The sequence of a sample of a pixel.
    pub(crate) fn of(seed: u32, pixel: [u32; 2], sample: u32) -> Self {
        let mut random = Self(u64::from(seed) << 32 | u64::from(sample));
        // Two rounds take neighbours apart before the pixel comes in.
        random.0 = random.next() ^ (u64::from(pixel[0]) << 32 | u64::from(pixel[1]));
        random.0 = random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Evenly in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// Evenly in the unit square.
    pub(crate) fn square(&mut self) -> Vec2 {
        Vec2::new(self.unit(), self.unit())
    }

    /// Around a normal with a density of its cosine over pi.
    pub(crate) fn around(&mut self, normal: Vec3) -> Vec3 {
        let at = self.square();
        let (sin, cos) = (std::f32::consts::TAU * at.x).sin_cos();
        let (u, v) = normal.any_orthonormal_pair();
        let r = at.y.sqrt();
        (u * (r * cos) + v * (r * sin) + normal * (1.0 - at.y).max(0.0).sqrt()).normalize_or(normal)
    }
}
