//! Point sets that the tests of this crate share, made from a fixed random sequence.

use glam::{DVec3, Vec3};

/// A small generator with a fixed sequence (`SplitMix64`, Steele et al. 2014), so that tests do not
/// change with a library's version.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the ball of radius 1.
    pub(crate) fn in_ball(&mut self) -> DVec3 {
        loop {
            let point = DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
            if point.length_squared() <= 1.0 {
                return point;
            }
        }
    }

    /// Uniform on the unit sphere.
    pub(crate) fn on_sphere(&mut self) -> DVec3 {
        let z = self.unit() * 2.0 - 1.0;
        let angle = self.unit() * std::f64::consts::TAU;
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    }
}

/// Random points on a sphere: a Poisson process, the worst case for holes.
pub(crate) fn random_sphere(count: usize, centre: DVec3, radius: f64, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(seed);
    (0..count).map(|_| (centre + radius * random.on_sphere()).as_vec3()).collect()
}

/// Points on a Fibonacci spiral over the unit sphere, moved by up to `jitter` spacings.
pub(crate) fn spiral_sphere(count: usize, jitter: f64, seed: u64) -> Vec<Vec3> {
    let mut random = Random::new(seed);
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let spacing = (4.0 * std::f64::consts::PI / count as f64).sqrt();
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let r = (1.0 - z * z).max(0.0).sqrt();
            let angle = golden * i as f64;
            let point = DVec3::new(r * angle.cos(), r * angle.sin(), z);
            (point + random.in_ball() * jitter * spacing).normalize_or(DVec3::Z).as_vec3()
        })
        .collect()
}

/// A square grid of `side * side` points in the plane spanned by two axes.
pub(crate) fn grid(side: usize, u: Vec3, v: Vec3) -> Vec<Vec3> {
    (0..side * side).map(|i| u * (i % side) as f32 + v * (i / side) as f32).collect()
}
