//! All of them cost about 30 s of one processor; most of each is some 400 000 rays.

use super::*;
use crate::progress::silent;
use crate::samples::Random;
use crate::visibility::scenes::{self, Scene};
use std::ops::ControlFlow;

const METRES: Hints = Hints { metres: Some(1.0), up: None, device: None, interior: None };
const UP: Hints = Hints { up: Some(Vec3::Z), metres: None, device: None, interior: None };

/// The share of right sides after signs were scrambled, and what was said of them.
fn found(scene: &Scene, hints: &Hints) -> (f64, Sides) {
    let mut normals = scene.scrambled(11);
    let before = normals.clone();
    let sides = by_visibility(&scene.positions, &mut normals, hints, &silent).unwrap();
    let turned = before.iter().zip(&normals).filter(|(a, b)| a != b).count();
    assert_eq!(sides.turned, turned);
    assert!(before.iter().zip(&normals).all(|(a, b)| *a == *b || *a == -*b));
    assert_eq!(sides.confidence.len(), scene.len());
    assert!(sides.confidence.iter().all(|confidence| (0.0..=1.0).contains(confidence)));
    assert_eq!(sides.decided + sides.uncertain, scene.len());
    (scene.right(&normals), sides)
}

/// The scene with normals that are fitted to its points.
fn fitted(scene: &Scene) -> Scene {
    let estimate = crate::normals::estimate(&scene.positions, 16, &silent).unwrap();
    let turned = |(&n, &truth): (&Vec3, &Vec3)| if n.dot(truth) < 0.0 { -n } else { n };
    let normals = estimate.normals.iter().zip(&scene.normals).map(turned).collect();
    Scene { positions: scene.positions.clone(), normals }
}

#[test]
fn closed_bodies_face_outwards() {
    for scene in [scenes::sphere(8000), scenes::cube(8000), scenes::torus(8000)] {
        let (right, sides) = found(&scene, &Hints::default());
        assert!(right >= 0.999, "{right}");
        assert!(!sides.interior);
        assert!(sides.certainty > 0.4 && sides.uncertain < scene.len() / 100, "{sides:?}");
    }
}

#[test]
fn bodies_that_touch_face_outwards_each() {
    let (right, sides) = found(&scenes::figure(30_000), &Hints::default());
    assert!(right >= 0.99, "{right}");
    assert!(!sides.interior);
}

#[test]
fn an_open_sheet_faces_the_side_where_it_is_convex() {
    let (right, _) = found(&scenes::hemisphere(8000), &Hints::default());
    assert!(right >= 0.99, "{right}");
}

#[test]
fn land_faces_up_whichever_axis_that_is() {
    let land = scenes::terrain(8000);
    let (right, sides) = found(&land, &UP);
    assert!(right >= 0.99, "{right}");
    assert!(!sides.interior && sides.certainty > 0.9);
    let turn = |v: &Vec3| Vec3::new(v.y, -v.z, -v.x);
    let turned = Scene {
        positions: land.positions.iter().map(turn).collect(),
        normals: land.normals.iter().map(turn).collect(),
    };
    let hints = Hints { up: Some(Vec3::new(0.0, -3.0, 0.0)), ..Hints::default() };
    let (right, _) = found(&turned, &hints);
    assert!(right >= 0.99, "{right}");
}

#[test]
fn a_street_faces_those_who_walk_in_it() {
    let (right, _) = found(&scenes::street(30.0), &UP);
    assert!(right >= 0.99, "{right}");
}

#[test]
fn rooms_and_corridors_face_inwards_and_what_is_in_them_outwards() {
    for scene in [scenes::room(150.0), scenes::two_rooms(120.0), scenes::corridor(120.0)] {
        let (right, sides) = found(&scene, &METRES);
        assert!(right >= 0.98, "{right}");
        assert!(sides.interior);
    }
}

#[test]
fn what_the_caller_knows_decides() {
    let room = scenes::room(150.0);
    let (right, sides) = found(&room, &Hints { interior: Some(false), ..METRES });
    assert!(right < 0.02 && !sides.interior, "{right}");
    let sphere = scenes::sphere(5000);
    for hints in [
        Hints { interior: Some(true), ..Hints::default() },
        Hints { device: Some(Vec3::new(3.1, -1.2, 0.5)), ..Hints::default() },
    ] {
        let (right, sides) = found(&sphere, &hints);
        assert!(right < 0.01 && sides.interior && sides.certainty > 0.9, "{right}");
    }
}

/// Half a spacing and a whole one; normals are fitted to the noisy points. The spheres have 25 points
/// a square of 0.1.
#[test]
fn noise_of_a_spacing_turns_few() {
    for (noise, least) in [(0.01, 0.99), (0.02, 0.98)] {
        let body = fitted(&scenes::sphere(30_000).noisy(noise, 3));
        let (right, _) = found(&body, &Hints::default());
        assert!(right >= least, "{noise}: {right}");
        // A spacing of 0.08.
        let room = fitted(&scenes::room(150.0).noisy(4.0 * noise, 3));
        let (right, _) = found(&room, &METRES);
        assert!(right >= 0.97, "{noise}: {right}");
    }
}

#[test]
fn points_in_a_layer_of_three_spacings_are_turned_together() {
    let body = fitted(&scenes::sphere(60_000).noisy(0.044, 3));
    let (right, _) = found(&body, &Hints::default());
    assert!(right >= 0.9, "{right}");
}

#[test]
fn uneven_density_turns_few() {
    let sparse = |p: Vec3| if p.x > 3.0 { 1.0 } else { 0.04 };
    let (right, _) = found(&scenes::sphere(30_000).thinned(2, sparse), &Hints::default());
    assert!(right >= 0.99, "{right}");
    // As from a device in a corner: the far side has a sixteenth of the density.
    let near = Vec3::new(1.3, 1.3, 1.5);
    let falling = |p: Vec3| f64::from(1.0 / p.distance_squared(near).max(1.0));
    let (right, _) = found(&scenes::room(900.0).thinned(2, falling), &METRES);
    assert!(right >= 0.98, "{right}");
}

#[test]
fn what_one_device_saw_of_a_room_faces_it() {
    let device = Vec3::new(2.0, 1.6, 1.5);
    let scene = scenes::room(300.0).seen_from(&[device]);
    let (right, _) = found(&scene, &Hints { device: Some(device), ..Hints::default() });
    assert!(right >= 0.98, "{right}");
    // What stands in the room hides parts of walls and floor.
    let (right, _) = found(&scene, &Hints { up: Some(Vec3::Z), ..METRES });
    assert!(right >= 0.98, "{right}");
}

#[test]
fn points_of_a_million_follow_those_that_decide() {
    // 160 000 points, of which about 100 000 decide.
    let scene = scenes::torus(160_000);
    let (right, sides) = found(&scene, &Hints::default());
    assert!(right >= 0.999, "{right}");
    assert!(sides.uncertain < scene.len() / 100, "{}", sides.uncertain);
}

#[test]
fn neither_scale_nor_copies_nor_lengths_matter() {
    let sphere = scenes::sphere(2000);
    for scale in [1e-30f32, 1e-6, 1e30] {
        let mut scaled = sphere.clone();
        scaled.positions.iter_mut().for_each(|p| *p *= scale);
        // Products of shorter ones would be zero in the comparison.
        scaled.normals.iter_mut().for_each(|n| *n *= scale.clamp(1e-15, 1e15));
        let (right, _) = found(&scaled, &Hints::default());
        assert!(right >= 0.99, "{scale}: {right}");
    }
    let mut copied = sphere.clone();
    copied.add(&sphere);
    let (right, _) = found(&copied, &Hints::default());
    assert!(right >= 0.99, "{right}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scene = scenes::room(60.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| found(&scene, &METRES))
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn odd_points_are_left_alone() {
    let mut scene = scenes::sphere(3000);
    let (nan, zero) = (Vec3::NAN, Vec3::ZERO);
    scene.positions[5] = nan;
    scene.positions[6] = Vec3::INFINITY;
    let mut normals = scene.normals.clone();
    normals[7] = zero;
    let sides = by_visibility(&scene.positions, &mut normals, &Hints::default(), &silent).unwrap();
    assert_eq!((sides.turned, sides.decided + sides.uncertain), (0, 2997));
    assert_eq!((normals[5], normals[6], normals[7]), (scene.normals[5], scene.normals[6], zero));
    assert_eq!(sides.confidence[5..8], [0.0; 3]);
    let wild = Hints { up: Some(zero), metres: Some(f32::NAN), device: Some(nan), interior: None };
    for count in [0, 1, 2, 3, 12] {
        for positions in [vec![Vec3::ONE; count], scene.positions[20..20 + count].to_vec()] {
            let mut normals = vec![Vec3::X; count];
            let sides = by_visibility(&positions, &mut normals, &wild, &silent).unwrap();
            assert!(normals.iter().all(|normal| normal.abs() == Vec3::X));
            assert_eq!(sides.decided + sides.uncertain, count);
            // Fewer or more normals than positions.
            let mut few = vec![Vec3::X; count / 2];
            by_visibility(&positions, &mut few, &wild, &silent).unwrap();
            let mut many = vec![Vec3::X; count + 3];
            by_visibility(&positions, &mut many, &wild, &silent).unwrap();
            assert_eq!(many[count..], [Vec3::X; 3]);
        }
    }
}

#[test]
fn the_search_stops_when_asked() {
    let scene = scenes::sphere(3000);
    for limit in [0.1, 0.4, 0.7, 0.85] {
        let stop = |fraction: f64| {
            if fraction > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut normals = scene.scrambled(1);
        let before = normals.clone();
        let stopped = by_visibility(&scene.positions, &mut normals, &Hints::default(), &stop);
        assert_eq!((stopped, normals), (Err(Cancelled), before));
    }
}

/// At 1000 times the extent some sides turned before strays were left out, at 10,000 times as many as by chance, and
/// farther away the hierarchy of discs had one place for all. Costs 6 s.
#[test]
fn a_few_strays_change_no_sides_however_far_they_are() {
    for away in [3.0, 1e4, 1e9, 1e30] {
        let scenes = [(scenes::room(150.0), METRES), (scenes::sphere(20_000), Hints::default())];
        for (mut scene, hints) in scenes {
            let count = scene.len();
            let mut random = Random::new(51);
            for _ in 0..10 {
                scene.positions.push((away * random.on_sphere()).as_vec3());
                scene.normals.push(random.on_sphere().as_vec3());
            }
            let (right, sides) = found(&scene, &hints);
            assert!(right >= 0.99 && sides.certainty > 0.4, "{away}: {right}, {sides:?}");
            let n_undecided = sides.confidence[count..].iter().filter(|&&c| c == 0.0).count();
            assert!(away < 10.0 || n_undecided == 10, "{away}: {n_undecided}");
        }
    }
}

/// Those of which some decide for the others, too, and a device's zeros far from what it has seen. Costs 2 s.
#[test]
fn strays_of_many_points_are_undecided() {
    let mut scene = scenes::torus(150_000);
    let count = scene.len();
    scene.positions.extend([Vec3::new(5e5, 5.4e6, 0.0); 10_000]);
    scene.normals.extend([Vec3::Z; 10_000]);
    let (_, sides) = found(&scene, &Hints::default());
    assert!(sides.confidence[count..].iter().all(|&confidence| confidence == 0.0));
    assert!(sides.uncertain < 11_000 && sides.certainty > 0.4, "{}", sides.uncertain);
    let surfels = Surfels::choose(
        &scene.positions,
        &scene.normals,
        Choice { count: 9000, refit: false },
        &silent,
    );
    assert!(surfels.unwrap().frame.scale <= 4.0);
}
