//! Tests on clouds whose spacing differs from place to place, and on points that float.

use super::*;
use crate::progress::silent;
use crate::samples::{Random, random_sphere, spiral_sphere};
use glam::DVec3;

/// Random points of the unit sphere with the `spacing` that the height asks for, of which `finest`
/// is the least.
fn varied_sphere(finest: f64, spacing: impl Fn(f64) -> f64) -> Vec<Vec3> {
    let count = (4.0 * std::f64::consts::PI / (finest * finest)) as usize;
    let mut random = Random::new(11);
    let mut points = random_sphere(count, DVec3::ZERO, 1.0, 12);
    points.retain(|point| random.unit() < (finest / spacing(f64::from(point.z))).powi(2));
    points
}

/// Rays that enter a sphere through none of the discs which face them. They pass its middle at less
/// than 0.9 radii, since nearer to the rim discs stand out of a sphere.
fn holes(centre: Vec3, scale: f32, positions: &[Vec3], radii: &[f32], n_rays: usize) -> usize {
    let mut random = Random::new(98);
    (0..n_rays)
        .filter(|_| {
            let through = centre + 0.9 * scale * random.in_ball().as_vec3();
            let direction = random.on_sphere().as_vec3();
            !positions.iter().zip(radii).any(|(&position, &radius)| {
                let normal = (position - centre) / scale;
                let facing = normal.dot(direction);
                let t = normal.dot(position - through) / facing;
                facing < 0.0 && (through + direction * t).distance(position) <= radius
            })
        })
        .count()
}

fn median_of(radii: &[f32]) -> f32 {
    median(radii.iter().map(|&radius| f64::from(radius))).unwrap() as f32
}

#[test]
fn no_ray_enters_a_sphere_whose_spacing_changes_tenfold() {
    let gradual = |z: f64| 0.03 * 10f64.powf((z + 1.0) / 2.0);
    let sudden = |z: f64| if z > 0.1 { 0.3 } else { 0.03 };
    for positions in [varied_sphere(0.03, gradual), varied_sphere(0.03, sudden)] {
        let radii = estimate(&positions, &positions, &silent).unwrap();
        assert_eq!(holes(Vec3::ZERO, 1.0, &positions, &radii, 5000), 0);
        // The fine side is not covered by plates: most points belong to it.
        assert!(median_of(&radii) < 3.0 * 0.03);
    }
}

#[test]
fn no_ray_enters_two_spheres_of_which_one_is_ten_times_coarser() {
    let fine = random_sphere(8000, DVec3::ZERO, 1.0, 14);
    let away = Vec3::new(2.5, 0.0, 0.0);
    let mut normals = fine.clone();
    normals.extend(random_sphere(80, DVec3::ZERO, 1.0, 15));
    let mut positions = normals.clone();
    positions[fine.len()..].iter_mut().for_each(|position| *position += away);
    let radii = estimate(&positions, &normals, &silent).unwrap();
    let (fine, coarse) = positions.split_at(fine.len());
    let (fine_radii, coarse_radii) = radii.split_at(fine.len());
    assert_eq!(holes(Vec3::ZERO, 1.0, fine, fine_radii, 5000), 0);
    assert_eq!(holes(away, 1.0, coarse, coarse_radii, 5000), 0);
}

#[test]
fn every_point_of_a_random_sphere_belongs_to_its_surface() {
    let positions = random_sphere(100_000, DVec3::ZERO, 1.0, 16);
    let neighbours = Neighbours::build(&positions, &silent).unwrap();
    let surface = Surface::of(&neighbours, &positions, &[], &silent).unwrap();
    let cells = surface.cover_all(&silent).unwrap();
    let (odd, on_surface) = limits::Gaps::between(&surface, &cells).sort_out(&silent).unwrap();
    // Some are asked about, or the answer would mean nothing.
    assert!(!odd.is_empty() && on_surface.iter().all(|&on| on));
}

/// A sphere and a group of points within `reach` of a place outside of it: the largest radius of the
/// group and the median of all.
fn group_beside_a_sphere(count: usize, place: Vec3, reach: f32) -> (f32, f32) {
    let sphere = spiral_sphere(5000, 0.2, 17);
    let mut random = Random::new(18);
    let mut positions = sphere.clone();
    positions.extend((0..count).map(|_| place + reach * random.in_ball().as_vec3()));
    let mut normals = sphere;
    normals.extend((0..count).map(|_| random.on_sphere().as_vec3()));
    let radii = estimate(&positions, &normals, &silent).unwrap();
    let largest = radii[positions.len() - count..].iter().copied().fold(0.0, f32::max);
    (largest, median_of(&radii))
}

#[test]
fn groups_that_float_get_no_larger_discs_than_the_surface() {
    for count in [1, 2, 5, 9, 20] {
        for place in [1.2, 2.0, 50.0] {
            for reach in [1e-3, 0.05] {
                let (largest, median) = group_beside_a_sphere(count, Vec3::X * place, reach);
                assert!(largest < 1.5 * median, "{count} at {place}: {largest}, {median}");
            }
        }
    }
}

#[test]
fn two_groups_that_float_beside_each_other_do_not_vouch_for_each_other() {
    let mut positions = spiral_sphere(5000, 0.2, 19);
    let mut random = Random::new(20);
    for place in [Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 0.4, 0.0)] {
        positions.extend((0..5).map(|_| place + 0.005 * random.in_ball().as_vec3()));
    }
    let radii = estimate(&positions, &positions, &silent).unwrap();
    assert!(radii[5000..].iter().all(|&radius| radius < 1.5 * median_of(&radii)));
}

#[test]
fn a_large_group_is_a_surface_of_its_own_and_keeps_its_scale() {
    // A hundredth of the large sphere's size: its spacing is what counts, not the gap around it.
    let mut positions = spiral_sphere(2000, 0.2, 21);
    let small = spiral_sphere(60, 0.0, 22);
    let normals = [positions.clone(), small.clone()].concat();
    positions.extend(small.iter().map(|&point| point * 0.01 + Vec3::X * 3.0));
    let radii = estimate(&positions, &normals, &silent).unwrap();
    let (positions, radii) = (&positions[2000..], &radii[2000..]);
    assert_eq!(holes(Vec3::X * 3.0, 0.01, positions, radii, 5000), 0);
    assert!(radii.iter().all(|&radius| radius < 0.01));
}
