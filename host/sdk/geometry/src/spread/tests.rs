use super::*;
use crate::mesh;
use crate::neighbours::Neighbours;
use crate::progress::silent;
use crate::samples::{random_sphere, spiral_sphere};

fn chosen(positions: &[Vec3], kept: &[bool]) -> Vec<Vec3> {
    positions.iter().zip(kept).filter(|(_, kept)| **kept).map(|(position, _)| *position).collect()
}

/// The least distance between two of the points.
fn least_distance(points: &[Vec3]) -> f64 {
    let neighbours = Neighbours::build(points, &silent).unwrap();
    (0..points.len()).map(|i| neighbours.nearest(i, 1)[0].distance).fold(f64::INFINITY, f64::min)
}

#[test]
fn thrown_points_keep_their_distance_and_leave_no_room() {
    let mut positions = random_sphere(3000, DVec3::splat(5.0), 1.0, 1);
    positions.extend([Vec3::NAN, positions[9], positions[9]]);
    for seed in [1, 2] {
        let kept = apart(&positions, 0.15, seed, &silent).unwrap();
        let points = chosen(&positions, &kept);
        assert!(least_distance(&points) >= 0.15);
        for position in positions.iter().filter(|position| position.is_finite()) {
            let near = |point: &Vec3| point.as_dvec3().distance(position.as_dvec3()) < 0.15;
            assert!(points.iter().any(near), "{position}");
        }
        // Dart throwing fills 0.547 of the plane with discs of half the distance as radius, where
        // there are darts for every gap; here there are 15 for each point that stays.
        let filled = points.len() as f64 * 0.075f64.powi(2) / 4.0;
        assert!((0.4..0.56).contains(&filled), "{filled}");
    }
    let [a, b] = [1, 2].map(|seed| apart(&positions, 0.15, seed, &silent).unwrap());
    assert_ne!(a, b);
    assert_eq!(a, apart(&positions, 0.15, 1, &silent).unwrap());
}

#[test]
fn a_count_of_points_lies_much_more_evenly_than_random_ones() {
    let candidates = random_sphere(10_000, DVec3::ZERO, 1.0, 3);
    let area = 4.0 * std::f64::consts::PI;
    for count in [500, 2000] {
        let kept = evenly(&candidates, count, area, 7, &silent).unwrap();
        let points = chosen(&candidates, &kept);
        assert_eq!(points.len(), count);
        let most = largest_distance(area, count);
        let even = least_distance(&points) / most;
        let random = least_distance(&candidates[..count]) / most;
        assert!(even > 0.6 && random < 0.1, "{even} {random}");
    }
}

#[test]
fn the_number_of_points_is_kept_whatever_the_area_is_said_to_be() {
    let mut positions = spiral_sphere(2000, 0.1, 5);
    positions.extend(vec![Vec3::ZERO; 500]);
    positions.push(Vec3::INFINITY);
    for area in [0.0, 1e-9, 12.0, 1e9, f64::INFINITY, f64::NAN] {
        for count in [0, 1, 7, 500, 1999] {
            let kept = evenly(&positions, count, area, 1, &silent).unwrap();
            assert_eq!(chosen(&positions, &kept).len(), count, "{area} {count}");
        }
        let kept = evenly(&positions, 99_999, area, 1, &silent).unwrap();
        assert_eq!(chosen(&positions, &kept).len(), 2001, "one of each");
    }
    // A crowd that is tiny beside the distance of those that stay takes no long time.
    let crowd: Vec<Vec3> = spiral_sphere(60_000, 0.1, 6).iter().map(|p| *p * 1e-4).collect();
    let all = [spiral_sphere(2000, 0.1, 7), crowd].concat();
    let kept = evenly(&all, 1000, 4.0 * std::f64::consts::PI, 1, &silent).unwrap();
    assert!(chosen(&all, &kept).iter().filter(|p| p.length() > 0.5).count() > 990);
}

#[test]
fn odd_clouds_and_distances_are_no_harm() {
    let clouds = [vec![], vec![Vec3::X], vec![Vec3::X; 50], vec![Vec3::NAN; 3]];
    for positions in &clouds {
        let n_finite = positions.iter().filter(|p| p.is_finite()).count();
        for distance in [f64::NAN, -1.0, 0.0] {
            let kept = apart(positions, distance, 1, &silent).unwrap();
            assert_eq!(chosen(positions, &kept).len(), n_finite);
        }
        for distance in [1e-300, 1.0, f64::INFINITY] {
            let kept = apart(positions, distance, 1, &silent).unwrap();
            assert_eq!(chosen(positions, &kept).len(), n_finite.min(1));
        }
        let kept = evenly(positions, 1, 1.0, 1, &silent).unwrap();
        assert_eq!(chosen(positions, &kept).len(), n_finite.min(1));
    }
}

#[test]
fn choices_do_not_depend_on_the_number_of_threads() {
    let positions = random_sphere(4000, DVec3::ZERO, 1.0, 3);
    let choices = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let on_mesh = mesh::scatter(&[1.0, 2.0, 0.5], 9000, 4, &silent).unwrap();
            let even = evenly(&positions, 700, 12.0, 1, &silent).unwrap();
            (apart(&positions, 0.1, 1, &silent).unwrap(), even, on_mesh)
        })
    };
    let one = choices(1);
    for threads in [2, 5] {
        assert!(choices(threads) == one, "{threads}");
    }
}
