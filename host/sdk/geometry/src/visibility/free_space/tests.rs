//! All of them cost a few seconds of one processor.

use super::*;
use crate::progress::silent;
use crate::visibility::scenes::{self, Scene};
use std::ops::ControlFlow;

const EYES: Standing = Standing { up: Vec3::Z, eye_height: Some(1.6) };
const MID_AIR: Standing = Standing { up: Vec3::Z, eye_height: None };

fn places(scene: &Scene, standing: Standing, wanted: usize) -> Vec<Place> {
    let normals = Some(&scene.normals[..]);
    let found = viewpoints(&scene.positions, normals, standing, wanted, &silent).unwrap();
    assert!(found.len() <= wanted);
    for place in &found {
        let nearest = scene.positions.iter().map(|p| p.distance(place.position));
        let nearest = nearest.fold(f32::INFINITY, f32::min);
        // Both ends are anywhere in their cubes, which are less than 0.35 wide in these scenes.
        assert!((place.clearance - nearest).abs() < 0.6, "{place:?} {nearest}");
        assert!((0.0..=1.0).contains(&place.enclosure) && (0.0..=1.0).contains(&place.sees));
    }
    found
}

#[test]
fn one_stands_on_the_floor_of_a_room_and_sees_most_of_it() {
    for standing in [EYES, MID_AIR] {
        let found = places(&scenes::room(150.0), standing, 5);
        assert!(!found.is_empty());
        let best = found[0];
        let p = best.position;
        assert!((0.3..4.7).contains(&p.x) && (0.3..3.7).contains(&p.y), "{best:?}");
        assert!((0.5..2.3).contains(&p.z), "{best:?}");
        assert!(best.enclosure > 0.9 && best.sees > 0.6, "{best:?}");
        assert!(is_seen_from_within(&found));
    }
    for place in places(&scenes::room(150.0), EYES, 5) {
        // Above the floor, the table or a chest, within a cube.
        let floors = [0.0, 0.76, 0.5, 0.9];
        let height = |floor: f32| (place.position.z - floor - 1.6).abs();
        assert!(floors.into_iter().any(|floor| height(floor) < 0.2), "{place:?}");
    }
}

#[test]
fn one_stands_on_the_ground_and_not_in_crowns() {
    let mut scene = Scene { positions: Vec::new(), normals: Vec::new() };
    let mut add = |x: f32, y: f32, z: f32| {
        scene.positions.push(Vec3::new(x, y, z));
        scene.normals.push(Vec3::Z);
    };
    // Ground, and crowns of 4 m over it, through which a tenth of the ground is seen, as from the air.
    for i in 0..120 * 120 {
        let (x, y) = ((i % 120) as f32 * 0.25, (i / 120) as f32 * 0.25);
        let is_below = (x % 10.0).min(y % 10.0) > 3.0 && (x % 10.0).max(y % 10.0) < 7.0;
        if is_below {
            add(x, y, 10.0 + 0.3 * ((i * 7) % 10) as f32 / 10.0);
        }
        if !is_below || i % 10 == 0 {
            add(x, y, 0.0);
        }
    }
    let found = places(&scene, EYES, 20);
    assert!(!found.is_empty());
    assert!(found.iter().all(|place| place.position.z < 3.0), "{found:?}");
}

#[test]
fn both_of_two_rooms_have_places() {
    let found = places(&scenes::two_rooms(120.0), EYES, 8);
    let is_first = |place: &&Place| place.position.x < 5.0;
    let is_second = |place: &&Place| place.position.x > 5.2;
    assert!(found.iter().any(|p| is_first(&p)) && found.iter().any(|p| is_second(&p)), "{found:?}");
}

#[test]
fn corridors_streets_and_woods_are_seen_from_within() {
    let (corridor, street, wood) =
        (scenes::corridor(120.0), scenes::street(30.0), scenes::wood(30.0));
    for scene in [&corridor, &street] {
        let found = places(scene, EYES, 4);
        assert!(is_seen_from_within(&found), "{found:?}");
    }
    // Leaves have no front.
    let found = viewpoints(&wood.positions, None, EYES, 4, &silent).unwrap();
    assert!(is_seen_from_within(&found), "{found:?}");
}

#[test]
fn bodies_and_land_are_seen_from_outside() {
    let bodies = [scenes::sphere(6000), scenes::cube(6000), scenes::torus(6000)];
    for scene in bodies.into_iter().chain([scenes::figure(8000)]) {
        let found = places(&scene, MID_AIR, 4);
        assert!(!is_seen_from_within(&found), "{found:?}");
    }
    for scene in [scenes::terrain(8000), scenes::hemisphere(6000)] {
        for standing in [EYES, MID_AIR] {
            let found = places(&scene, standing, 4);
            assert!(!is_seen_from_within(&found), "{found:?}");
        }
    }
}

/// As measured: between the coils of the Stanford dragon, and in a wood whose leaves have fronts.
#[test]
fn between_the_coils_of_a_body_is_not_within() {
    let place = |enclosure: f32, sees: f32, from_outside: f32| Place {
        position: Vec3::ZERO,
        clearance: 1.0,
        enclosure,
        sees,
        from_outside,
    };
    assert!(!is_seen_from_within(&[place(0.68, 0.19, 0.99)]));
    assert!(is_seen_from_within(&[place(0.89, 0.39, 0.9)]));
    // One of many rooms, whose walls have their fronts within.
    assert!(is_seen_from_within(&[place(1.0, 0.16, 0.5)]));
    let figure = places(&scenes::figure(8000), MID_AIR, 1);
    assert!(figure[0].from_outside > 0.95, "{figure:?}");
    let room = places(&scenes::room(150.0), EYES, 1);
    assert!(room[0].from_outside < 0.6, "{room:?}");
}

#[test]
fn up_may_be_any_direction_and_strays_do_no_harm() {
    let mut room = scenes::room(150.0);
    let turn = |v: &Vec3| Vec3::new(v.z, v.x, v.y);
    room.positions = room.positions.iter().map(turn).collect();
    room.normals = room.normals.iter().map(turn).collect();
    for i in 0..20 {
        room.positions[i * 7] = Vec3::splat(200.0 + i as f32);
    }
    let standing = Standing { up: 5.0 * Vec3::X, eye_height: Some(1.6) };
    let normals = Some(&room.normals[..]);
    let found = viewpoints(&room.positions, normals, standing, 3, &silent).unwrap();
    assert!(is_seen_from_within(&found), "{found:?}");
    assert!((1.3..1.9).contains(&found[0].position.x), "{found:?}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let scene = scenes::room(60.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| places(&scene, EYES, 5))
    };
    assert_eq!(run(1), run(5));
}

#[test]
fn odd_clouds_have_no_places() {
    let line: Vec<Vec3> = (0..100).map(|i| Vec3::X * i as f32).collect();
    for cloud in [vec![], vec![Vec3::ONE], vec![Vec3::ONE; 9], vec![Vec3::NAN; 3], line] {
        for standing in [EYES, MID_AIR, Standing { up: Vec3::ZERO, eye_height: Some(f32::NAN) }] {
            let found = viewpoints(&cloud, None, standing, 3, &silent).unwrap();
            assert!(!is_seen_from_within(&found), "{found:?}");
        }
    }
    assert!(viewpoints(&scenes::room(20.0).positions, None, EYES, 0, &silent).unwrap().is_empty());
}

#[test]
fn the_search_stops_when_asked() {
    let scene = scenes::room(30.0);
    for limit in [0.1, 0.3, 0.5, 0.8] {
        let stop = |fraction: f64| {
            if fraction > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let stopped = viewpoints(&scene.positions, None, EYES, 3, &stop);
        assert_eq!(stopped, Err(Cancelled));
    }
}
