//! Discs against the mesh that they stand for: holes and overshoot.

use super::cloud::{Cloud, Pattern, Random, scan};
use super::meshes::Mesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use surfelshop_geometry::{Neighbours, normals, radii, silent};

/// Radius of the largest ball about a place of the mesh that may be empty where it was scanned, spacings: lines are 2.2
/// apart, strips 3.1, more where the mesh runs along with the scanner's sweep.
const BARE: f64 = 2.0;

/// Points looked at, on the mesh and on discs.
const SAMPLES: usize = 200_000;

pub(super) fn run(meshes: &[Mesh]) -> anyhow::Result<()> {
    println!(
        "gaps: share of the mesh within two spacings of a place that has no point within two spacings; uncovered: what no disc covers of that; holes: what no disc covers of the rest; overshoot: share of the discs' area that is farther than half a spacing from the mesh; percent"
    );
    println!(
        "mesh         points  pattern     gaps  uncovered   holes  overshoot  mean radius, spacings  largest"
    );
    for mesh in meshes {
        for count in [5_000, 20_000, 80_000] {
            for pattern in [Pattern::Random, Pattern::Lines, Pattern::Strips] {
                let cloud = scan(mesh, count, pattern, 0.0, 2);
                row(mesh, &cloud, count, pattern)?;
            }
        }
    }
    Ok(())
}

fn row(mesh: &Mesh, cloud: &Cloud, count: usize, pattern: Pattern) -> anyhow::Result<()> {
    let area: f64 = surfelshop_geometry::mesh::areas(&mesh.positions, &mesh.faces).iter().sum();
    let spacing = (area / cloud.points.len() as f64).sqrt();
    let neighbours = Neighbours::build(&cloud.points, &silent)?;
    let found = normals::estimate_with(&neighbours, normals::DEFAULT_NEIGHBOURS, &silent)?;
    let radii = radii::estimate_with(&neighbours, &found.normals, &found.planarity, &silent)?;
    let largest = f64::from(radii.iter().copied().fold(0.0, f32::max));
    let truth = scan(mesh, SAMPLES, Pattern::Random, 0.0, 3);
    let grid = Grid::of(&cloud.points, spacing * 2.0);
    // What lies between two lines that are farther apart than any disc may reach is no hole between neighbours.
    let gaps = gaps(&truth.points, &cloud.points, &grid, BARE * spacing);
    let is_covered = |point: Vec3, normal: Vec3| {
        let mut covered = false;
        grid.near(point, largest.min(20.0 * spacing), |i| {
            // Round splats face whoever looks.
            let is_round = found.planarity[i] < radii::PLANAR;
            let facing = if is_round { normal } else { found.normals[i] };
            covered |= is_hit(point, normal, cloud.points[i], facing, radii[i], spacing);
        });
        covered
    };
    let uncovered = |in_gap: bool| {
        let places = truth.points.iter().zip(&truth.normals).zip(&gaps);
        let places = places.filter(|(_, is_gap)| **is_gap == in_gap);
        let (count, open) = places.fold((0, 0), |(count, open), ((point, normal), _)| {
            (count + 1, open + usize::from(!is_covered(*point, *normal)))
        });
        100.0 * open as f64 / count.max(1) as f64
    };
    let dense = scan(mesh, 16 * count.max(20_000), Pattern::Random, 0.0, 4);
    let (mut off, mut random) = (0.0, Random::new(6));
    let reach = 0.5 * spacing;
    let dense_grid = Grid::of(&dense.points, reach);
    let total: f64 = radii.iter().map(|&r| f64::from(r).powi(2)).sum();
    let per_sample = total / SAMPLES as f64;
    let mut pending = 0.0;
    let mut samples = 0.0;
    for ((point, normal), radius) in cloud.points.iter().zip(&found.normals).zip(&radii) {
        pending += f64::from(*radius).powi(2) / per_sample;
        while pending >= 1.0 {
            pending -= 1.0;
            samples += 1.0;
            let (u, v) = normal.any_orthonormal_pair();
            let (r, angle) =
                (random.unit().sqrt() * f64::from(*radius), random.unit() * std::f64::consts::TAU);
            let at = *point + u * (r * angle.cos()) as f32 + v * (r * angle.sin()) as f32;
            let mut is_near = false;
            dense_grid.near(at, reach, |i| {
                is_near |= f64::from(dense.points[i].distance(at)) < reach;
            });
            off += f64::from(u8::from(!is_near));
        }
    }
    let mean = radii.iter().map(|&r| f64::from(r)).sum::<f64>() / radii.len() as f64;
    println!(
        "{:<12} {:>6}  {:<8} {:>7.3} {:>10.1} {:>7.3} {:>10.2} {:>22.2} {:>8.1}",
        mesh.name,
        cloud.points.len(),
        format!("{pattern:?}"),
        100.0 * gaps.iter().filter(|is_gap| **is_gap).count() as f64 / gaps.len() as f64,
        uncovered(true),
        uncovered(false),
        100.0 * off / samples,
        mean / spacing,
        largest / spacing
    );
    Ok(())
}

/// Whether each place lies in a ball of this radius about one of the places that has no point in it.
fn gaps(places: &[Vec3], points: &[Vec3], grid: &Grid, radius: f64) -> Vec<bool> {
    let has_near = |grid: &Grid, points: &[Vec3], place: Vec3| {
        let mut has = false;
        grid.near(place, radius, |i| has |= f64::from(points[i].distance(place)) <= radius);
        has
    };
    let empty = places.iter().filter(|place| !has_near(grid, points, **place));
    let middles: Vec<Vec3> = empty.copied().collect();
    let around = Grid::of(&middles, radius);
    places.iter().map(|place| has_near(&around, &middles, *place)).collect()
}

/// Whether a ray against the normal of a point of the mesh meets a disc near it.
fn is_hit(point: Vec3, along: Vec3, centre: Vec3, normal: Vec3, radius: f32, spacing: f64) -> bool {
    let facing = normal.dot(along);
    if facing.abs() < 1e-3 {
        return false;
    }
    let t = normal.dot(centre - point) / facing;
    f64::from(t.abs()) < 2.0 * spacing && (point + along * t).distance(centre) <= radius
}

/// Points by cubes.
struct Grid {
    edge: f64,
    cubes: HashMap<[i32; 3], Vec<usize>>,
}

impl Grid {
    fn of(points: &[Vec3], edge: f64) -> Self {
        let mut cubes: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
        for (i, point) in points.iter().enumerate() {
            cubes.entry(cube(*point, edge)).or_default().push(i);
        }
        Self { edge, cubes }
    }

    fn near(&self, point: Vec3, reach: f64, mut take: impl FnMut(usize)) {
        let [low, high] = [-1.0, 1.0]
            .map(|side| cube((point.as_dvec3() + DVec3::splat(side * reach)).as_vec3(), self.edge));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    self.cubes.get(&[x, y, z]).into_iter().flatten().for_each(|&i| take(i));
                }
            }
        }
    }
}

fn cube(point: Vec3, edge: f64) -> [i32; 3] {
    (point.as_dvec3() / edge).to_array().map(|at| at.floor() as i32)
}
