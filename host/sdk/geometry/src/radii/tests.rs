use super::covering::COVER;
use super::*;
use crate::normals;
use crate::progress::silent;
use crate::samples::{Random, grid, random_sphere, spiral_sphere};
use glam::DVec3;

/// Rays through the unit sphere that hit none of the discs.
fn missing_rays(positions: &[Vec3], normals: &[Vec3], radii: &[f32], n_rays: usize) -> usize {
    let mut random = Random::new(99);
    (0..n_rays)
        .filter(|_| {
            let through = random.in_ball().as_vec3();
            let direction = random.on_sphere().as_vec3();
            !positions.iter().zip(normals).zip(radii).any(|((&position, &normal), &radius)| {
                let t = normal.dot(position - through) / normal.dot(direction);
                (through + direction * t).distance(position) <= radius
            })
        })
        .count()
}

fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted[sorted.len() / 2]
}

/// Mean spacing sqrt(area / n) of points on the unit sphere.
fn sphere_spacing(count: usize) -> f32 {
    (4.0 * std::f32::consts::PI / count as f32).sqrt()
}

#[test]
fn no_ray_misses_a_random_sphere() {
    let positions = random_sphere(2000, DVec3::ZERO, 1.0, 1);
    let radii = estimate(&positions, &positions, &silent).unwrap();
    assert_eq!(missing_rays(&positions, &positions, &radii, 5000), 0);
    assert!(median(&radii) < 2.5 * sphere_spacing(2000));
}

#[test]
fn no_ray_misses_a_sphere_with_estimated_normals() {
    for positions in [random_sphere(2000, DVec3::ZERO, 1.0, 2), spiral_sphere(2000, 0.4, 2)] {
        let normals = normals::estimate(&positions, 16, &silent).unwrap().normals;
        let radii = estimate(&positions, &normals, &silent).unwrap();
        assert_eq!(missing_rays(&positions, &normals, &radii, 5000), 0);
    }
}

#[test]
fn no_ray_misses_an_even_sphere_and_its_discs_stay_small() {
    for jitter in [0.0, 0.2, 0.5] {
        let positions = spiral_sphere(2000, jitter, 3);
        let radii = estimate(&positions, &positions, &silent).unwrap();
        assert_eq!(missing_rays(&positions, &positions, &radii, 5000), 0);
        assert!(median(&radii) < 1.2 * sphere_spacing(2000));
    }
}

#[test]
fn no_ray_misses_a_coarse_sphere() {
    let positions = spiral_sphere(40, 0.0, 4);
    let radii = estimate(&positions, &positions, &silent).unwrap();
    assert_eq!(missing_rays(&positions, &positions, &radii, 20_000), 0);
}

#[test]
fn the_discs_of_a_square_grid_reach_just_over_half_a_diagonal() {
    let positions = grid(20, Vec3::X, Vec3::Y);
    let normals = vec![Vec3::Z; positions.len()];
    let radii = estimate(&positions, &normals, &silent).unwrap();
    let expected = (COVER * 0.5f64.sqrt()) as f32;
    assert!(radii.iter().all(|r| (r / expected - 1.0).abs() < 1e-5));
}

#[test]
fn the_back_of_a_thin_sheet_makes_no_holes_in_its_front() {
    // Back points stand behind the middles of the front's cells, a tenth of a spacing away.
    let mut positions = grid(20, Vec3::X, Vec3::Y);
    let mut normals = vec![Vec3::Z; positions.len()];
    let back: Vec<Vec3> = positions.iter().map(|&p| p + Vec3::new(0.5, 0.5, -0.1)).collect();
    normals.extend(vec![-Vec3::Z; back.len()]);
    positions.extend(back);
    let radii = estimate(&positions, &normals, &silent).unwrap();
    let needed = 0.5f32.sqrt();
    assert!(radii.iter().all(|&r| r >= needed && r < 2.0 * needed));
}

#[test]
fn an_outlier_gets_no_giant_disc() {
    let mut positions = spiral_sphere(1000, 0.0, 5);
    positions.push(Vec3::new(50.0, 0.0, 0.0));
    let mut normals = positions.clone();
    normals[1000] = Vec3::X;
    let radii = estimate(&positions, &normals, &silent).unwrap();
    assert!(radii[1000] < 4.0 * median(&radii));
}

#[test]
fn radii_follow_scale() {
    let unit = spiral_sphere(500, 0.1, 6);
    let expected = estimate(&unit, &unit, &silent).unwrap();
    for scale in [1e-30f32, 1e-20, 1e20, 1e28, 1e37] {
        let scaled: Vec<Vec3> = unit.iter().map(|&p| p * scale).collect();
        let radii = estimate(&scaled, &unit, &silent).unwrap();
        for (radius, expected) in radii.iter().zip(&expected) {
            assert!((radius / scale / expected - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn lone_and_coincident_points_get_a_visible_radius() {
    assert!(estimate(&[], &[], &silent).unwrap().is_empty());
    assert_eq!(estimate(&[Vec3::ONE], &[Vec3::Z], &silent).unwrap(), [LONE_RADIUS]);
    let copies = vec![Vec3::ONE; 10_000];
    assert_eq!(estimate(&copies, &[], &silent).unwrap(), vec![LONE_RADIUS; 10_000]);
    let huge = estimate(&[Vec3::splat(1e28)], &[Vec3::Z], &silent).unwrap()[0];
    assert!(huge > 1e21 && huge.is_finite());
}

#[test]
fn points_on_a_line_and_pairs_touch() {
    let line: Vec<Vec3> = (0..100).map(|i| Vec3::X * i as f32).collect();
    let normals = vec![Vec3::Z; 100];
    let radii = estimate(&line, &normals, &silent).unwrap();
    assert!(radii.iter().all(|&r| r > 0.5 && r < 1.0), "{radii:?}");
    let pair = estimate(&[Vec3::ZERO, Vec3::X], &[Vec3::Z; 2], &silent).unwrap();
    assert!(pair.iter().all(|&r| r > 0.5 && r < 1.0));
}

#[test]
fn positions_and_normals_that_are_not_finite_give_finite_radii() {
    let positions = [Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::Y, Vec3::ONE];
    let radii = estimate(&positions, &[Vec3::NAN; 5], &silent).unwrap();
    assert!(radii.iter().all(|&r| r > 0.0 && r.is_finite()));
}
