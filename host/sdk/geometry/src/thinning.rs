//! One point for each cube of space.

use crate::bounds::Bounds;
use crate::grid::Grid;
use crate::progress::{Cancelled, Progress, part, report};
use glam::{DVec3, Vec3};

/// Keeps, in each cube of this `edge`, the point that is nearest to the mean of all in it, the first
/// of several: one entry per position. Cubes begin at the lower corner of the bounds.
///
/// Positions that are not finite are not kept. Where `edge` is not above 0 all finite ones are.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn one_per_cube(
    positions: &[Vec3],
    edge: f64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    report(progress, 0.0)?;
    if edge.is_nan() || edge <= 0.0 {
        report(progress, 1.0)?;
        return Ok(positions.iter().map(|position| position.is_finite()).collect());
    }
    let points = wide(positions);
    let grid = Grid::build(&points, edge, &part(progress, 0.0..0.8))?;
    let mut kept = vec![false; positions.len()];
    for cube in grid.cubes() {
        let inside = || cube.iter().map(|&(_, index)| (index as usize, points[index as usize]));
        let mean = inside().map(|(_, point)| point).sum::<DVec3>() / cube.len() as f64;
        let distance = |point: DVec3| point.distance_squared(mean);
        let nearest = inside().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
        if let Some((index, _)) = nearest {
            kept[index] = true;
        }
    }
    report(progress, 1.0)?;
    Ok(kept)
}

/// Edges tried; each brings the number of cubes nearer by about its square root.
const TRIES: usize = 16;

/// Share of the count within which an edge is good enough.
const CLOSE: f64 = 0.005;

/// The edge of cubes of which about `count` hold points; 0 where that is no fewer than there are
/// finite positions.
///
/// How many cubes a surface meets jumps with their edge, so that some counts cannot be had; the
/// nearest of what was tried is returned, half a percent away where it can be had.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn edge_for(
    positions: &[Vec3],
    count: usize,
    progress: Progress<'_>,
) -> Result<f64, Cancelled> {
    report(progress, 0.0)?;
    let n_finite = positions.iter().filter(|position| position.is_finite()).count();
    let extent = Bounds::of_positions(positions).map_or(0.0, |bounds| bounds.diagonal());
    if count >= n_finite || extent <= 0.0 {
        report(progress, 1.0)?;
        return Ok(if count >= n_finite { 0.0 } else { f64::INFINITY });
    }
    let points = wide(positions);
    let wanted = count.max(1) as f64;
    // A surface meets about as many cubes as its diagonal has edges, squared.
    let mut edge = extent / wanted.sqrt();
    let (mut best, mut error) = (edge, f64::INFINITY);
    let (mut low, mut high) = (0.0, 4.0 * extent);
    for step in 0..TRIES {
        let share = |step: usize| step as f64 / TRIES as f64;
        let grid = Grid::build(&points, edge, &part(progress, share(step)..share(step + 1)))?;
        let found = grid.cubes().count() as f64;
        if (found / wanted).ln().abs() < error {
            (best, error) = (edge, (found / wanted).ln().abs());
        }
        if error <= CLOSE {
            break;
        }
        if found > wanted {
            low = edge;
        } else {
            high = edge;
        }
        let next = edge * (found / wanted).sqrt();
        let inside = next > low && next < high;
        edge = if inside { next } else { (low.max(0.5 * high.min(edge)) + high) * 0.5 };
    }
    report(progress, 1.0)?;
    Ok(best)
}

fn wide(positions: &[Vec3]) -> Vec<DVec3> {
    positions.iter().map(|position| position.as_dvec3()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::{Random, random_sphere};
    use std::collections::BTreeMap;

    fn n_kept(kept: &[bool]) -> usize {
        kept.iter().filter(|kept| **kept).count()
    }

    #[test]
    fn each_cube_keeps_the_point_nearest_to_its_mean() {
        let mut random = Random::new(2);
        let mut positions: Vec<Vec3> = (0..900).map(|_| random.in_ball().as_vec3()).collect();
        positions.extend([Vec3::NAN, positions[4], positions[4]]);
        let edge = 0.37;
        let kept = one_per_cube(&positions, edge, &silent).unwrap();
        let min = Bounds::of_positions(&positions).unwrap().min;
        let mut cubes: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
        for (index, position) in positions.iter().enumerate().filter(|(_, p)| p.is_finite()) {
            let place = ((position.as_dvec3() - min) / edge).to_array().map(|c| c as i64);
            cubes.entry(place).or_default().push(index);
        }
        assert_eq!(n_kept(&kept), cubes.len());
        for inside in cubes.values() {
            let points: Vec<DVec3> = inside.iter().map(|&i| positions[i].as_dvec3()).collect();
            let mean = points.iter().sum::<DVec3>() / points.len() as f64;
            let chosen = inside.iter().position(|&index| kept[index]).unwrap();
            let nearest = points.iter().map(|point| point.distance(mean)).fold(9.0, f64::min);
            assert_eq!(points[chosen].distance(mean), nearest);
        }
    }

    #[test]
    fn edges_are_found_for_a_number_of_points() {
        let positions = random_sphere(20_000, DVec3::ZERO, 2.0, 6);
        for count in [1, 10, 300, 5000, 15_000] {
            let edge = edge_for(&positions, count, &silent).unwrap();
            let found = n_kept(&one_per_cube(&positions, edge, &silent).unwrap());
            let allowed = if count < 100 { 3.0 } else { 1.03 };
            let ratio = found as f64 / count as f64;
            assert!(ratio < allowed && ratio > 1.0 / allowed, "{found} for {count}");
        }
        assert_eq!(edge_for(&positions, 20_000, &silent).unwrap(), 0.0);
    }

    #[test]
    fn odd_clouds_and_edges_are_no_harm() {
        let clouds = [vec![], vec![Vec3::X], vec![Vec3::X; 50], vec![Vec3::NAN; 3]];
        for positions in &clouds {
            for edge in [f64::NAN, -1.0, 0.0, 1e-300, 1.0, f64::INFINITY] {
                let kept = one_per_cube(positions, edge, &silent).unwrap();
                assert_eq!(kept.len(), positions.len());
            }
            let edge = edge_for(positions, 1, &silent).unwrap();
            let kept = n_kept(&one_per_cube(positions, edge, &silent).unwrap());
            assert_eq!(kept, usize::from(positions.iter().any(|p| p.is_finite())));
        }
    }
}
