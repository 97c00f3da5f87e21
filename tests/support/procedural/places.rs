//! Places to look at patterns.

use super::{Spot, noise};
use glam::{DVec3, Vec3};
use surfelshop_api::ObjectFrame;

/// Numbers that look random, the same every time, in 0 to 1.
pub fn numbers(seed: u32) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        let [x, y, _] = noise::pcg3d([state, 7, seed]);
        state = x;
        (y >> 8) as f32 / (1 << 24) as f32
    }
}

/// Spots all over a cube of this size around the origin, in every direction, as wide as a share of
/// it up to `widest`.
#[must_use]
pub fn spots(n: usize, size: f32, widest: f32, seed: u32) -> Vec<Spot> {
    let mut next = numbers(seed);
    let mut vector = || Vec3::new(next(), next(), next()) - 0.5;
    (0..n)
        .map(|_| {
            let offset = vector() * size;
            let normal = vector().normalize_or(Vec3::Y);
            // Most are small, few are large: as far as powers of ten.
            let radius = size * widest * 10f32.powf(-4.0 * (vector().x + 0.5));
            Spot { offset, normal, radius, albedo: Vec3::new(0.9, 0.8, 0.7) }
        })
        .collect()
}

/// A box around a point, of this size.
#[must_use]
pub fn boxed(center: DVec3, size: f64) -> ObjectFrame {
    ObjectFrame { center, size, ..ObjectFrame::default() }
}
