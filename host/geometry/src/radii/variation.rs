//! Tests on clouds whose spacing differs from place to place, and on points that float.

use super::*;
use crate::progress::silent;
use crate::samples::{Random, random_sphere, spiral_sphere};

/// Points of the unit sphere that `spacing` of the height asks for, at random or evenly. Both come
/// from a sampling at the finest spacing, from which points are taken away.
fn varied_sphere(finest: f64, spacing: impl Fn(f64) -> f64, even: bool) -> Vec<Vec3> {
    let count = (4.0 * std::f64::consts::PI / (finest * finest)) as usize;
    let mut random = Random::new(11);
    if !even {
        let keep = |point: &Vec3, random: &mut Random| {
            random.unit() < (finest / spacing(f64::from(point.z))).powi(2)
        };
        let all = random_sphere(count, DVec3::ZERO, 1.0, 12);
        return all.into_iter().filter(|point| keep(point, &mut random)).collect();
    }
    // Dart throwing: no two points are nearer than three quarters of the wanted spacing, which
    // leaves about the wanted number.
    let mut kept: Vec<Vec3> = Vec::new();
    for point in random_sphere(6 * count, DVec3::ZERO, 1.0, 13) {
        let apart = 0.75 * spacing(f64::from(point.z)) as f32;
        if kept.iter().all(|other| other.distance(point) >= apart) {
            kept.push(point);
        }
    }
    kept
}

/// Rays into a sphere that no disc stops before they leave it: of those through its inner part, the
/// shares of the surface that face the rays' origins must be closed by themselves.
fn holes(centre: Vec3, scale: f32, positions: &[Vec3], radii: &[f32], n_rays: usize) -> usize {
    let mut random = Random::new(98);
    (0..n_rays)
        .filter(|_| {
            let through = centre + 0.9 * scale * random.in_ball().as_vec3();
            let direction = random.on_sphere().as_vec3();
            !positions.iter().zip(radii).any(|(&position, &radius)| {
                let normal = (position - centre) / scale;
                let facing = -normal.dot(direction);
                let t = normal.dot(through - position) / facing;
                facing > 0.0 && (through + direction * t).distance(position) <= radius
            })
        })
        .count()
}

#[test]
fn no_ray_enters_a_sphere_whose_spacing_changes_tenfold() {
    let gradual = |z: f64| 0.02 * 10f64.powf((z + 1.0) / 2.0);
    let sudden = |z: f64| if z > 0.1 { 0.2 } else { 0.02 };
    for even in [true, false] {
        for positions in [varied_sphere(0.02, gradual, even), varied_sphere(0.02, sudden, even)] {
            let radii = estimate(&positions, &positions, &silent).unwrap();
            let n = holes(Vec3::ZERO, 1.0, &positions, &radii, 4000);
            println!("even {even} n {} holes {n}", positions.len());
        }
    }
    panic!();
}
