use std::collections::HashMap;

use super::*;
use crate::tiles::REACH;

/// Area of a wall, scene units squared.
const WALL: f64 = 4.0;

fn ball_area() -> f64 {
    Shape::Ball { center: DVec3::ZERO, radius: 1.0 }.area()
}

/// Positions, normals and radii.
fn surfels(cloud: &Cloud) -> Vec<(DVec3, DVec3, f64)> {
    let vectors = cloud.positions().iter().zip(cloud.normals()).zip(cloud.radii());
    vectors.map(|((p, n), r)| (p.as_dvec3(), n.as_dvec3(), f64::from(*r))).collect()
}

/// What square tiles with these radii measure together.
fn area_of_radii(cloud: &Cloud) -> f64 {
    cloud.radii().iter().map(|radius| (f64::from(*radius) / REACH).powi(2)).sum()
}

#[test]
fn clouds_have_about_as_many_points_as_asked_for() {
    for (n_points, most) in [(5_000, 0.03), (N_POINTS, 0.01)] {
        let clouds = [
            cornell_box(n_points).unwrap(),
            empty_box(n_points).unwrap(),
            furnace_sphere(n_points, 0.5).unwrap(),
            furnace_box(n_points, 0.5).unwrap(),
        ];
        for cloud in clouds {
            let share = cloud.len() as f64 / n_points as f64;
            assert!((share - 1.0).abs() < most, "{} of {n_points}", cloud.len());
        }
    }
}

#[test]
fn radii_tell_the_area() {
    let things: f64 = things().iter().map(Shape::area).sum();
    let clouds = [
        (cornell_box(N_POINTS).unwrap(), 5.0 * WALL + things),
        (empty_box(N_POINTS).unwrap(), 5.0 * WALL),
        (furnace_box(N_POINTS, 0.5).unwrap(), 6.0 * WALL),
        (furnace_sphere(N_POINTS, 0.5).unwrap(), ball_area()),
    ];
    for (cloud, area) in clouds {
        let found = area_of_radii(&cloud);
        assert!((found / area - 1.0).abs() < 0.01, "{found} instead of {area}");
    }
}

#[test]
fn walls_look_inwards_and_have_their_colours() {
    let cloud = empty_box(20_000).unwrap();
    let colors = cloud.linear_colors().unwrap();
    let mut on_wall = [0; 6];
    for ((position, normal, _), color) in surfels(&cloud).into_iter().zip(colors) {
        let index = OUTWARDS.iter().position(|outwards| normal == -*outwards).unwrap();
        assert_eq!(position.dot(OUTWARDS[index]), 1.0, "{position} lies on its wall");
        assert!(position.abs().max_element() <= 1.0);
        on_wall[index] += 1;
        let wanted = match index {
            0 => [0.63, 0.065, 0.05],
            1 => [0.14, 0.45, 0.09],
            _ => [0.73; 3],
        };
        // Half a code of 8 bits is at most 0.0045 linear.
        assert!(color.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 0.0045));
    }
    assert!(on_wall[..5].iter().all(|n| *n == on_wall[0]), "{on_wall:?}");
    assert_eq!(on_wall[5], 0, "the front is open");
}

#[test]
fn things_look_outwards() {
    // Light that leaves a closed surface along its normals would need the volume below zero.
    let closed: [(&str, Vec<Shape>, f64); 4] = [
        ("block", block(DVec3::ZERO, 0.3, DVec3::new(0.9, 0.4, 0.6)), 0.9 * (0.4 + SUNK) * 0.6),
        ("ring", ring(DVec3::ONE, 0.2, 0.3, 0.1), 0.05 * std::f64::consts::PI * (0.1 + SUNK)),
        ("ball", vec![Shape::Ball { center: DVec3::ONE, radius: 0.5 }], ball_area() / 24.0),
        ("front", OUTWARDS.map(wall).to_vec(), -8.0),
    ];
    for (name, shapes, volume) in closed {
        let tiles = tiles_of(&shapes, 50_000).concat();
        let flux: f64 =
            tiles.iter().map(|tile| tile.position.dot(tile.normal) * tile.area / 3.0).sum();
        assert!((flux / volume - 1.0).abs() < 1e-3, "{name}: {flux} instead of {volume}");
    }
    for (_, normal, _) in surfels(&cornell_box(20_000).unwrap()) {
        assert!((normal.length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn things_stand_in_the_room_and_apart() {
    for tile in tiles_of(&things(), 20_000).concat() {
        let Tile { position: DVec3 { x, y, z }, radius, .. } = tile;
        assert!(y >= FLOOR - SUNK - 1e-9, "below the floor: {y}");
        assert!([x, z].iter().all(|place| place.abs() + radius < 0.99) && y < 0.5);
    }
    let [_, torus, ring] = [0, 13, 14].map(|first| tiles_of(&things()[first..], 5_000));
    for tile in &torus[0] {
        let near = ring.concat().into_iter().map(|other| other.position.distance(tile.position));
        assert!(near.fold(f64::MAX, f64::min) > 0.1, "the torus touches the ring");
    }
}

#[test]
fn every_place_of_the_walls_is_covered() {
    for (cloud, n_walls) in
        [(cornell_box(20_000).unwrap(), 5), (furnace_box(3_000, 0.5).unwrap(), 6)]
    {
        let surfels = surfels(&cloud);
        for outwards in &OUTWARDS[..n_walls] {
            let on_wall: Vec<_> = surfels
                .iter()
                .filter(|(position, normal, _)| {
                    *normal == -*outwards && position.dot(*outwards) == 1.0
                })
                .collect();
            // Found by squares as wide as the largest disc.
            let widest = on_wall.iter().map(|(_, _, radius)| *radius).fold(0.0, f64::max);
            let square = |place: DVec3| (place / widest).floor().as_i64vec3();
            let mut squares: HashMap<_, Vec<_>> = HashMap::new();
            for surfel in &on_wall {
                squares.entry(square(surfel.0)).or_default().push(*surfel);
            }
            let across = DVec3::new(outwards.z, outwards.x, outwards.y);
            let along = outwards.cross(across);
            for index in 0..251 * 251 {
                let share = |part: i32| f64::from(part) / 125.0 - 1.0;
                let place = *outwards + across * share(index / 251) + along * share(index % 251);
                let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j)));
                let covered = around
                    .map(|(i, j)| place + (across * f64::from(i) + along * f64::from(j)) * widest)
                    .filter_map(|near| squares.get(&square(near)))
                    .flatten()
                    .any(|(position, _, radius)| position.distance(place) <= *radius);
                assert!(covered, "hole at {place}");
            }
        }
    }
}

#[test]
fn furnaces_have_exactly_the_albedo() {
    let clouds = [furnace_sphere(2_000, 0.7).unwrap(), furnace_box(2_000, 0.7).unwrap()];
    for cloud in &clouds {
        assert!(cloud.linear_colors().unwrap().iter().all(|color| *color == [0.7; 3]));
    }
    for (position, normal, _) in surfels(&clouds[0]) {
        assert!((position + normal).length() < 1e-6, "{normal} at {position}");
    }
}

#[test]
fn the_same_box_is_made_again() {
    let bits = |cloud: &Cloud| -> Vec<u32> {
        cloud.positions().iter().flat_map(|p| p.to_array().map(f32::to_bits)).collect()
    };
    let [one, other] = [0; 2].map(|_| cornell_box(10_000).unwrap());
    assert_eq!(bits(&one), bits(&other));
    // Written down when the box was made first; another machine must come to the same.
    let sum = bits(&one).into_iter().fold(0_u64, |sum, bits| {
        sum.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(u64::from(bits))
    });
    assert_eq!(sum, 4_561_381_873_979_751_027);
}
