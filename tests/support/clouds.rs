//! Clouds with known answers: those that plugins are checked with, and a large one.

use glam::{DVec3, Vec3};
use surfelshop_api::columns;
use surfelshop_cloud::{Buffer, Cloud, Column};

pub use surfelshop_evaluate::conformance::clouds::*;

/// Bytes of a surfel of [`wavy_sphere`].
pub const WAVY_BYTES: usize = 3 * 4 + 3 * 4 + 4 + 3;

/// Surfels where `|p| = 1 + 0.04 sin 9x sin 9y sin 9z`, in the order of a spiral, in columns
/// that take no more memory on the way than they have.
///
/// # Panics
/// Never: the columns have equal lengths.
#[must_use]
pub fn wavy_sphere(n: usize) -> Cloud {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let radius = 1.5 * (4.0 * std::f64::consts::PI / n as f64).sqrt();
    let (mut positions, mut normals) = (Vec::with_capacity(3 * n), Vec::with_capacity(3 * n));
    let mut colors = Vec::with_capacity(3 * n);
    for i in 0..n {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let ring = (1.0 - z * z).sqrt();
        let angle = golden * i as f64;
        let direction = DVec3::new(ring * angle.cos(), z, ring * angle.sin());
        // The waves are flat enough for a few steps of a fixed-point iteration.
        let mut point = direction;
        for _ in 0..4 {
            point = direction * (1.0 + 0.04 * wave(point).0);
        }
        let normal = (direction - 0.04 * wave(point).1).normalize_or(direction);
        positions.extend(point.as_vec3().to_array());
        normals.extend(normal.as_vec3().to_array());
        let shade = normal.as_vec3() * 127.0 + Vec3::splat(128.0);
        colors.extend(shade.to_array().map(|channel| channel as u8));
    }
    Cloud::new(
        DVec3::ZERO,
        vec![
            Column::new(columns::POSITION, 3, Buffer::F32(positions)),
            Column::new(columns::NORMAL, 3, Buffer::F32(normals)),
            Column::new(columns::RADIUS, 1, Buffer::F32(vec![radius.min(1.0) as f32; n])),
            Column::new(columns::COLOR, 3, Buffer::U8(colors)),
        ],
    )
    .expect("test clouds are consistent")
}

/// The height of the waves at a point, and its gradient.
fn wave(point: DVec3) -> (f64, DVec3) {
    let s = DVec3::from_array((9.0 * point).to_array().map(f64::sin));
    let c = DVec3::from_array((9.0 * point).to_array().map(f64::cos));
    let gradient = 9.0 * DVec3::new(c.x * s.y * s.z, s.x * c.y * s.z, s.x * s.y * c.z);
    (s.x * s.y * s.z, gradient)
}
