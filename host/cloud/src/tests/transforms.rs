//! Clouds scaled, turned and moved, against the same in f64.

use crate::{Buffer, Cloud, CloudError, Column, Rotation, Transform};
use glam::{DMat3, DQuat, DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};

/// Surfels in a box of edge 2 around zero, with an origin of their own.
fn cloud(origin: DVec3) -> Cloud {
    let points: Vec<Vec3> = (0..500)
        .map(|i| (Vec3::new(0.618, 0.414, 0.732) * i as f32).fract() * 2.0 - Vec3::ONE)
        .collect();
    let flat = |vectors: Vec<Vec3>| Buffer::F32(bytemuck::cast_vec(vectors));
    let normals = points.iter().map(|point| point.normalize_or(Vec3::Z)).collect();
    let radii = points.iter().map(|point| 0.01 + 0.1 * point.x.abs()).collect();
    let columns = vec![
        Column::new(NORMAL, 3, flat(normals)),
        Column::new(TANGENT_U, 3, flat(points.iter().map(|p| *p * 0.1 + Vec3::X).collect())),
        Column::new(TANGENT_V, 3, flat(points.iter().map(|p| *p * 0.2 + Vec3::Y).collect())),
        Column::new(RADIUS, 1, Buffer::F32(radii)),
        Column::new("label", 1, Buffer::U8(vec![7; points.len()])),
        Column::new(POSITION, 3, flat(points)),
    ];
    Cloud::new(origin, columns).unwrap()
}

fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

fn turn() -> Rotation {
    Rotation::Quaternion(DQuat::from_xyzw(0.3, -0.5, 1.1, 0.7))
}

#[test]
fn without_a_change_everything_is_shared() {
    let cloud = cloud(DVec3::splat(3.0));
    for rotation in [
        Rotation::default(),
        Rotation::Euler(DVec3::ZERO),
        Rotation::Quaternion(DQuat::from_xyzw(0.0, 0.0, 0.0, -2.5)),
    ] {
        let same = cloud.transformed(&Transform { rotation, ..Transform::default() }).unwrap();
        assert_eq!(same.origin(), cloud.origin());
        assert_eq!(generations(&same), generations(&cloud));
    }
}

/// Invariant: a moved cloud shares its columns and keeps its millimetres
#[test]
fn moving_changes_the_origin_and_shares_all_columns() {
    let cloud = cloud(DVec3::splat(0.25));
    let old_bounds = cloud.facts().bounds_min;
    let translation = DVec3::new(5e6, -4e6, 0.001);
    let moved = cloud.transformed(&Transform { translation, ..Transform::default() }).unwrap();
    assert_eq!(moved.origin(), DVec3::splat(0.25) + translation);
    assert_eq!(generations(&moved), generations(&cloud));
    // f64 coordinates of 5e6 are 1e-9 apart.
    assert!((moved.facts().bounds_min - old_bounds - translation).length() < 2e-9);
}

#[test]
fn every_column_of_lengths_and_directions_follows_f64() {
    for (origin, translation) in [
        (DVec3::ZERO, DVec3::ZERO),
        (DVec3::new(-3.0, 2.0, 9.0), DVec3::new(0.5, 0.0, -8.0)),
        (DVec3::splat(5e6), DVec3::new(5e6, -5e6, 1e6)),
    ] {
        let cloud = cloud(origin);
        let transform = Transform { translation, rotation: turn(), scale: 2.5 };
        let turned = cloud.transformed(&transform).unwrap();
        let rotation = DMat3::from_quat(DQuat::from_xyzw(0.3, -0.5, 1.1, 0.7).normalize());
        let near = |found: Vec3, expected: DVec3, what: &str| {
            // One rounding to f32 of values below 8, whose halves of a step are 2.4e-7.
            let error = (found.as_dvec3() - expected).length();
            assert!(error < 5e-7, "{what}: {found} for {expected}");
        };
        for i in 0..cloud.len() {
            let world = rotation * (2.5 * cloud.world_position(i).unwrap()) + translation;
            let error = (turned.world_position(i).unwrap() - world).length();
            // As above, and f64 coordinates of 3e7, whose steps are 4e-9.
            assert!(error < 5e-7, "{error:e}");
            near(turned.normals()[i], rotation * cloud.normals()[i].as_dvec3(), "normal");
            for name in [TANGENT_U, TANGENT_V] {
                let expected = rotation * (2.5 * cloud.vectors(name)[i].as_dvec3());
                near(turned.vectors(name)[i], expected, name);
            }
            assert_eq!(turned.radii()[i], (2.5 * f64::from(cloud.radii()[i])) as f32);
        }
        let label = |cloud: &Cloud| cloud.column("label").unwrap().generation();
        assert_eq!(label(&turned), label(&cloud), "other columns are shared");
    }
}

#[test]
fn offsets_far_from_their_origin_keep_their_precision_when_turned() {
    // Multiples of 1/2 at 5e6, which f32 holds; turned by 45 degrees, it would not hold them.
    let points: Vec<Vec3> = (0..64).map(|i| Vec3::new(5e6 + 0.5 * i as f32, 0.0, 1.0)).collect();
    let position = Column::new(POSITION, 3, Buffer::F32(bytemuck::cast_vec(points)));
    let cloud = Cloud::new(DVec3::ZERO, vec![position]).unwrap();
    let rotation = Rotation::Euler(DVec3::new(0.0, 0.0, FRAC_PI_2 / 2.0));
    let turned = cloud.transformed(&Transform { rotation, ..Transform::default() }).unwrap();
    let matrix = DMat3::from_rotation_z(FRAC_PI_2 / 2.0);
    for i in 0..cloud.len() {
        let expected = matrix * cloud.world_position(i).unwrap();
        // Offsets of at most 16 are 1e-6 apart, coordinates of 5e6 1e-9.
        assert!((turned.world_position(i).unwrap() - expected).length() < 2e-6);
    }
}

#[test]
fn angles_turn_about_x_first_and_about_z_last() {
    let turned = |angles: DVec3, vector: DVec3| {
        Rotation::Euler(angles).quaternion().unwrap().mul_vec3(vector)
    };
    let quarter = FRAC_PI_2;
    assert!((turned(DVec3::new(0.0, quarter, 0.0), DVec3::Z) - DVec3::X).length() < 1e-15);
    // About x, y becomes z; about z, z stays.
    let both = DVec3::new(quarter, 0.0, quarter);
    assert!((turned(both, DVec3::Y) - DVec3::Z).length() < 1e-15);
    assert!((turned(both, DVec3::X) - DVec3::Y).length() < 1e-15);
}

#[test]
fn quaternions_of_any_length_turn_alike() {
    let unit = DQuat::from_xyzw(0.5, -0.5, 0.5, 0.5);
    for length in [1e-300, 1e-20, 1.0, 7.0, 1e300] {
        let found = Rotation::Quaternion(unit * length).quaternion().unwrap();
        assert!((found - unit).length() < 1e-15, "{length:e}: {found}");
    }
}

#[test]
fn transforms_that_cannot_be_held_are_refused() {
    let cloud = cloud(DVec3::ZERO);
    let refused = |transform: Transform, words: &str| {
        let error = cloud.transformed(&transform).unwrap_err();
        assert!(matches!(error, CloudError::Transform { .. }));
        assert!(error.to_string().contains(words), "{error}");
    };
    let plain = Transform::default();
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        refused(Transform { scale, ..plain }, "expected a scale above 0, found");
    }
    for bad in [f64::NAN, f64::INFINITY] {
        let translation = DVec3::new(0.0, bad, 0.0);
        refused(Transform { translation, ..plain }, "expected a finite translation");
        let rotation = Rotation::Quaternion(DQuat::from_xyzw(0.0, bad, 0.0, 1.0));
        refused(Transform { rotation, ..plain }, "expected a rotation");
        refused(Transform { rotation: Rotation::Euler(translation), ..plain }, "a rotation");
    }
    let rotation = Rotation::Quaternion(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
    refused(Transform { rotation, ..plain }, "expected a rotation");
    refused(Transform { scale: 1e39, ..plain }, "found 1e39, which column");
    refused(Transform { scale: 1e-60, ..plain }, "found 1e-60, which column");
    refused(Transform { scale: 1.5e38, ..plain }, "coordinates of at most 8.5e37");
    let translation = DVec3::splat(1e38);
    refused(Transform { translation, ..plain }, "coordinates of at most 8.5e37, found 1e38");
    assert!(cloud.transformed(&Transform { scale: 1e-30, ..plain }).is_ok());
}

#[test]
fn empty_clouds_are_turned() {
    let transform = Transform { rotation: turn(), ..Transform::default() };
    assert!(Cloud::default().transformed(&transform).unwrap().is_empty());
}

/// What textures are fastened to goes with a cloud and stays through edits.
#[test]
fn the_box_of_a_cloud_is_moved_with_it_and_stays_through_edits() {
    let positions = [Vec3::ZERO, Vec3::new(4.0, 0.0, 0.0), Vec3::new(1.0, 2.0, 0.0)];
    let flat = positions.iter().flat_map(Vec3::to_array).collect();
    let column = Column::new(POSITION, 3, Buffer::F32(flat));
    let cloud = Cloud::new(DVec3::new(10.0, 0.0, 0.0), vec![column]).unwrap();
    let object = cloud.object();
    assert_eq!((object.center, object.size), (DVec3::new(12.0, 1.0, 0.0), 4.0));
    // Fewer surfels, the same box; and other columns.
    let fewer = cloud.keep(&[true, false, true]).unwrap();
    assert_eq!(fewer.object(), object);
    assert_eq!(fewer.facts().objects, [object]);
    let more = fewer.with_columns(vec![Column::new("more", 1, Buffer::F32(vec![0.0; 2]))]).unwrap();
    assert_eq!(more.object(), object);
    let turn = DQuat::from_rotation_z(FRAC_PI_2);
    let rotation = Rotation::Quaternion(turn);
    let transform = Transform { translation: DVec3::Z, rotation, scale: 0.5 };
    let moved = cloud.transformed(&transform).unwrap();
    let place = DVec3::new(11.0, 2.0, 0.5);
    let there = turn * (place * 0.5) + DVec3::Z;
    let [a, b] = [object.box_from_world(place), moved.object().box_from_world(there)];
    assert!((a - b).length() < 1e-12, "{a} {b}");
    assert_eq!(moved.keep(&[true; 3]).unwrap().object(), moved.object());
}
