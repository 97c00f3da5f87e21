use super::*;
use crate::progress::silent;
use crate::samples::{Random, grid, random_sphere, spiral_sphere};
use std::ops::ControlFlow;

fn normals_of(positions: &[Vec3]) -> Estimate {
    let estimate = estimate(positions, DEFAULT_NEIGHBOURS, &silent).unwrap();
    assert_eq!(estimate.normals.len(), positions.len());
    // Rounding a unit vector to f32 changes its length by at most 2^-23.
    assert!(estimate.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
    estimate
}

/// The largest angle, degrees, between normals and directions from a centre.
fn worst_angle(positions: &[Vec3], normals: &[Vec3], centre: Vec3) -> f32 {
    positions
        .iter()
        .zip(normals)
        .map(|(&p, &n)| (p - centre).normalize_or_zero().dot(n).clamp(-1.0, 1.0).acos())
        .fold(0.0, f32::max)
        .to_degrees()
}

#[test]
fn normals_of_an_even_sphere_face_outwards_within_two_degrees() {
    let positions = spiral_sphere(3000, 0.0, 1);
    let estimate = normals_of(&positions);
    assert!(worst_angle(&positions, &estimate.normals, Vec3::ZERO) < 2.0);
    assert_eq!((estimate.n_degenerate, estimate.n_components), (0, 1));
}

#[test]
fn normals_of_a_random_sphere_face_outwards_within_ten_degrees() {
    // Neighbourhoods of a Poisson sampling are lopsided; they span about 2 * 2.3 spacings.
    let positions = random_sphere(5000, DVec3::ZERO, 1.0, 2);
    let estimate = normals_of(&positions);
    assert!(worst_angle(&positions, &estimate.normals, Vec3::ZERO) < 10.0);
}

#[test]
fn two_separate_spheres_each_face_outwards() {
    let centres = [DVec3::new(-5.0, 0.0, 0.0), DVec3::new(4.0, 1.0, 2.0)];
    let mut positions = random_sphere(2000, centres[0], 1.0, 3);
    positions.extend(random_sphere(2000, centres[1], 2.0, 4));
    let estimate = normals_of(&positions);
    assert_eq!(estimate.n_components, 2);
    for (part, centre) in [0..2000, 2000..4000].into_iter().zip(centres) {
        let angle =
            worst_angle(&positions[part.clone()], &estimate.normals[part], centre.as_vec3());
        assert!(angle < 15.0, "{angle}");
    }
}

/// Points beside a body lie farther out than all of it, but say nothing of its sides. Costs 0.15 s.
#[test]
fn a_few_strays_do_not_turn_a_body_inwards() {
    for (count, n_strays, size, away) in
        [(900, 3, 1, 3.0), (900, 12, 1, 2.5), (10_000, 10, 1, 3.0), (10_000, 30, 3, 1e6)]
    {
        for seed in 0..6 {
            let mut random = Random::new(40 + seed);
            let mut positions = random_sphere(count, DVec3::ZERO, 1.0, 30 + seed);
            for _ in 0..n_strays / size {
                let group = away * random.on_sphere();
                positions.extend((0..size).map(|_| (group + 0.01 * random.in_ball()).as_vec3()));
            }
            let normals = normals_of(&positions).normals;
            let body = positions.iter().zip(&normals).take(count);
            let right = body.filter(|(position, normal)| position.dot(**normal) > 0.0).count();
            assert!(right > count * 99 / 100, "{n_strays} at {away}, {seed}: {right}");
        }
    }
}

#[test]
fn the_faces_of_a_cube_face_outwards() {
    let side = 20;
    let step = 2.0 / (side - 1) as f32;
    let mut positions = Vec::new();
    for (u, v, w) in
        [(Vec3::X, Vec3::Y, Vec3::Z), (Vec3::Y, Vec3::Z, Vec3::X), (Vec3::Z, Vec3::X, Vec3::Y)]
    {
        for sign in [-1.0, 1.0] {
            positions.extend(grid(side, u * step, v * step).iter().map(|&p| p - u - v + w * sign));
        }
    }
    let estimate = normals_of(&positions);
    assert_eq!(estimate.n_components, 1);
    for (position, normal) in positions.iter().zip(&estimate.normals) {
        assert!(position.dot(*normal) > 0.0, "{position} {normal}");
    }
}

#[test]
fn a_plane_has_one_normal_with_a_positive_largest_component() {
    for (u, v, up) in [
        (Vec3::X, Vec3::Y, Vec3::Z),
        (Vec3::X, Vec3::Z, Vec3::Y),
        (Vec3::new(2.0, 1.0, 0.0), Vec3::Z, Vec3::new(0.2f32.sqrt(), -(0.8f32.sqrt()), 0.0)),
    ] {
        let estimate = normals_of(&grid(30, u, v));
        let first = estimate.normals[0];
        assert!(estimate.normals.iter().all(|n| n.dot(first) > 0.999_999));
        assert!(first.dot(up).abs() > 0.999_999);
        let largest = first.to_array().into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        assert!(largest.unwrap() > 0.0);
        assert_eq!(estimate.n_degenerate, 0);
    }
}

#[test]
fn neither_scale_nor_a_far_origin_changes_normals() {
    let unit = spiral_sphere(1000, 0.0, 5);
    let expected = normals_of(&unit).normals;
    for scale in [1e-20f32, 1e-6, 1e20, 1e28, 1e37] {
        let scaled: Vec<Vec3> = unit.iter().map(|&p| p * scale).collect();
        for (a, b) in normals_of(&scaled).normals.iter().zip(&expected) {
            assert!(a.dot(*b) > 0.9999);
        }
    }
    let far: Vec<Vec3> = unit.iter().map(|&p| p + Vec3::splat(1e4)).collect();
    // f32 coordinates of 1e4 are 1e-3 apart: half a hundredth of the spacing of 0.11.
    for (a, b) in normals_of(&far).normals.iter().zip(&expected) {
        assert!(a.dot(*b) > 0.995);
    }
}

#[test]
fn degenerate_neighbourhoods_give_stated_unit_normals() {
    assert_eq!(normals_of(&[]).n_components, 0);
    assert_eq!(normals_of(&[Vec3::ONE]).normals, [Vec3::Z]);
    assert_eq!(normals_of(&[Vec3::ONE; 10_000]).normals, [Vec3::Z; 10_000]);
    assert_eq!(normals_of(&[Vec3::ZERO, Vec3::X]).normals, [Vec3::Z; 2]);
    let line: Vec<Vec3> = (0..50).map(|i| Vec3::new(1.0, 1.0, 0.0) * i as f32 * 0.1).collect();
    let estimate = normals_of(&line);
    assert_eq!(estimate.n_degenerate, 50);
    assert!(estimate.normals.iter().all(|n| n.z > 0.999_999));
    let upright: Vec<Vec3> = (0..50).map(|i| Vec3::Z * i as f32).collect();
    assert!(normals_of(&upright).normals.iter().all(|n| n.y.abs() > 0.999_999));
    assert_eq!(normals_of(&[Vec3::NAN, Vec3::ZERO]).n_degenerate, 2);
}

/// Rounding scatters them about the line, and so do sums over many of them.
#[test]
fn points_at_random_along_a_slanted_line_span_no_plane() {
    let mut random = Random::new(24);
    let (end, away) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(30.0, -400.0, 7.0));
    for (end, start) in [
        (end, DVec3::ZERO),
        (DVec3::new(-7.0, 0.1, 2.0), DVec3::ZERO),
        (DVec3::splat(1e-9), DVec3::ZERO),
        (end, away),
    ] {
        let line: Vec<Vec3> = (0..5000).map(|_| (start + end * random.unit()).as_vec3()).collect();
        let estimate = normals_of(&line);
        assert_eq!(estimate.n_degenerate, 5000, "{end} {start}");
        let along = end.as_vec3().normalize_or_zero();
        assert!(estimate.normals.iter().all(|normal| normal.dot(along).abs() < 0.01));
    }
}

#[test]
fn copies_of_points_change_nothing() {
    let sphere = spiral_sphere(500, 0.0, 6);
    let mut copied = sphere.clone();
    copied.extend(std::iter::repeat_n(sphere[7], 1000));
    let expected = normals_of(&sphere).normals;
    let normals = normals_of(&copied).normals;
    assert_eq!(normals[..500], expected);
    assert!(normals[500..].iter().all(|&n| n == expected[7]));
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    // Enough edges that they are sorted in pieces.
    let positions = random_sphere(60_000, DVec3::ZERO, 1.0, 7);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let normals = normals_of(&positions).normals;
            let radii = crate::radii::estimate(&positions, &normals, &silent).unwrap();
            (normals, radii)
        })
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn the_order_of_points_does_not_matter() {
    let positions = random_sphere(3000, DVec3::ONE, 1.0, 13);
    let reversed: Vec<Vec3> = positions.iter().rev().copied().collect();
    let (ahead, back) = (normals_of(&positions).normals, normals_of(&reversed).normals);
    for (a, b) in ahead.iter().zip(back.iter().rev()) {
        assert!(a.dot(*b) > 0.999_999);
    }
}

#[test]
fn a_flat_ellipsoid_faces_outwards_around_its_sharp_rim() {
    // At the rim the surface turns within half a spacing.
    let flat = 0.15;
    let positions: Vec<Vec3> =
        spiral_sphere(8000, 0.2, 14).iter().map(|p| Vec3::new(p.x, p.y, p.z * flat)).collect();
    let estimate = normals_of(&positions);
    assert_eq!(estimate.n_components, 1);
    for (position, normal) in positions.iter().zip(&estimate.normals) {
        let outwards = Vec3::new(position.x, position.y, position.z / (flat * flat));
        assert!(outwards.dot(*normal) > 0.0, "{position} {normal}");
    }
}

#[test]
fn estimation_stops_when_asked() {
    let positions = random_sphere(20_000, DVec3::ZERO, 1.0, 8);
    let stop = |fraction: f64| {
        if fraction > 0.2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    assert_eq!(estimate(&positions, 16, &stop), Err(Cancelled));
}

#[test]
fn invalid_normals_are_repaired_and_valid_ones_keep_their_bits() {
    let positions = spiral_sphere(2000, 0.0, 9);
    let mut normals: Vec<Vec3> = positions.iter().map(|p| *p * 1.5).collect();
    let original = normals.clone();
    let broken = [Vec3::ZERO, Vec3::NAN, Vec3::new(f32::INFINITY, 0.0, 0.0)];
    for (i, index) in (0..2000).step_by(7).enumerate() {
        normals[index] = broken[i % 3];
    }
    let neighbours = Neighbours::build(&positions, &silent).unwrap();
    let done = repair(&neighbours, &mut normals, 16, &silent).unwrap();
    assert_eq!(done, Repair { n_from_neighbours: 286, n_estimated: 0 });
    for (i, normal) in normals.iter().enumerate() {
        if i % 7 == 0 {
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!(normal.dot(positions[i]) > 0.99);
        } else {
            assert_eq!(*normal, original[i]);
        }
    }
}

#[test]
fn a_large_patch_of_invalid_normals_is_filled_from_its_border() {
    let positions = spiral_sphere(4000, 0.0, 10);
    // The normals face inwards, which only the valid ones can tell.
    let mut normals: Vec<Vec3> = positions.iter().map(|p| -*p).collect();
    for (normal, position) in normals.iter_mut().zip(&positions) {
        if position.z > 0.8 {
            *normal = Vec3::ZERO;
        }
    }
    let done = repair(&Neighbours::build(&positions, &silent).unwrap(), &mut normals, 16, &silent)
        .unwrap();
    assert_eq!(done.n_estimated, 0);
    for (normal, position) in normals.iter().zip(&positions) {
        assert!(normal.dot(*position) < -0.7);
    }
}

#[test]
fn normals_that_are_all_invalid_are_estimated() {
    let positions = spiral_sphere(1000, 0.0, 11);
    let mut normals = vec![Vec3::ZERO; positions.len()];
    let done = repair(&Neighbours::build(&positions, &silent).unwrap(), &mut normals, 16, &silent)
        .unwrap();
    assert_eq!(done, Repair { n_from_neighbours: 0, n_estimated: 1000 });
    assert!(worst_angle(&positions, &normals, Vec3::ZERO) < 3.0);
}

#[test]
fn normalising_survives_every_magnitude() {
    let mut random = Random::new(12);
    for exponent in [-44, -38, -20, 0, 20, 37] {
        let direction = random.on_sphere();
        let scaled = (direction * 10f64.powi(exponent)).as_vec3();
        assert!((normalised(scaled).length() - 1.0).abs() < 1e-6);
    }
    assert_eq!(normalised(Vec3::ZERO), Vec3::Z);
    assert_eq!(normalised(Vec3::NAN), Vec3::Z);
}
