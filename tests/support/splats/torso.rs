//! A body like a torso, smooth everywhere and with features of several sizes.

use glam::{DVec2, DVec3};
use surfelshop_api::columns;
use surfelshop_cloud::{Buffer, Cloud, Column};

/// Where the surface bulges out or in: the middle of it as a direction, its height as a share of the
/// radius, and how narrow it is.
const BULGES: [([f64; 3], f64, f64); 15] = [
    // Chest, shoulder blades, shoulders.
    ([0.45, 0.45, 0.8], 0.16, 9.0),
    ([-0.45, 0.45, 0.8], 0.16, 9.0),
    ([0.5, 0.5, -0.8], 0.09, 14.0),
    ([-0.5, 0.5, -0.8], 0.09, 14.0),
    ([0.9, 0.62, 0.0], 0.3, 8.0),
    ([-0.9, 0.62, 0.0], 0.3, 8.0),
    // Neck, waist from both sides, hips.
    ([0.0, 1.0, 0.0], 0.28, 22.0),
    ([1.0, -0.15, 0.0], -0.24, 7.0),
    ([-1.0, -0.15, 0.0], -0.24, 7.0),
    ([0.7, -0.75, 0.1], 0.12, 7.0),
    ([-0.7, -0.75, 0.1], 0.12, 7.0),
    // Navel, spine, and two smaller ones.
    ([0.0, -0.12, 1.0], -0.06, 250.0),
    ([0.0, 0.1, -1.0], -0.08, 30.0),
    ([0.42, 0.36, 0.9], 0.02, 900.0),
    ([-0.42, 0.36, 0.9], 0.02, 900.0),
];

/// The point of the body in a direction.
fn point(direction: DVec3) -> DVec3 {
    let bulge = |(middle, height, narrow): &([f64; 3], f64, f64)| {
        let cosine = direction.dot(DVec3::from_array(*middle).normalize_or(DVec3::Z));
        height * (-narrow * (1.0 - cosine)).exp()
    };
    // Ribs and belly.
    let ribs = 0.006 * (22.0 * direction.y).sin() * (-6.0 * (direction.y + 0.05).powi(2)).exp();
    let radius = 1.0 + BULGES.iter().map(bulge).sum::<f64>() + ribs;
    direction * radius * DVec3::new(0.95, 1.35, 0.6)
}

/// So many samples of the body, with normals and radii at which discs cover it.
///
/// # Panics
/// Never: the columns have equal lengths.
#[must_use]
pub fn torso(n: usize) -> Cloud {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spacing = (4.0 * std::f64::consts::PI / n as f64).sqrt();
    let (mut positions, mut normals, mut radii) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..n {
        let y = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
        let across = DVec2::from_angle(golden * i as f64) * (1.0 - y * y).sqrt();
        let direction = DVec3::new(across.x, y, across.y);
        let (u, v) = direction.any_orthonormal_pair();
        // The function is smooth at this step, and f64 keeps ten digits of the difference.
        let step = 1e-6;
        let slope = |axis: DVec3| {
            let at = |s: f64| point((direction + s * axis).normalize_or(DVec3::Z));
            (at(step) - at(-step)) / (2.0 * step)
        };
        let (du, dv) = (slope(u), slope(v));
        let normal = du.cross(dv).normalize_or(DVec3::Z);
        let normal = normal * normal.dot(direction).signum();
        positions.extend(point(direction).as_vec3().to_array());
        normals.extend(normal.as_vec3().to_array());
        let stretch = du.length().max(dv.length());
        radii.push((1.2 * spacing * stretch) as f32);
    }
    let columns = vec![
        Column::new(columns::POSITION, 3, Buffer::F32(positions)),
        Column::new(columns::NORMAL, 3, Buffer::F32(normals)),
        Column::new(columns::RADIUS, 1, Buffer::F32(radii)),
    ];
    Cloud::new(DVec3::ZERO, columns).expect("test clouds are consistent")
}
