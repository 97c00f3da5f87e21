//! A round body with bumps, of as many surfels as wanted.

use anyhow::Context as _;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS};
use surfelshop_cloud::{Buffer, Cloud, Column, Loaded, Summary};
use surfelshop_session::input::clouds::Clouds;

/// From the middle to the farthest point at most, surfels included.
pub(super) const REACH: f64 = 1.2;

/// Height of the bumps over a ball of radius 1.
const BUMPS: f64 = 0.08;

/// Waves of the bumps along each axis.
const WAVES: DVec3 = DVec3::new(5.0, 6.0, 7.0);

/// Where the waves begin.
const PHASES: DVec3 = DVec3::new(1.0, 2.0, 3.0);

/// Radii in distances between neighbours, at which discs overlap as in scans.
const OVERLAP: f64 = 1.5;

/// From the middle to the surface along a unit direction.
pub(super) fn height(towards: DVec3) -> f64 {
    let [x, y, z] = (WAVES * towards + PHASES).to_array();
    1.0 + BUMPS * x.sin() * y.sin() * z.sin()
}

/// How the height changes with the direction.
fn slope(towards: DVec3) -> DVec3 {
    let [x, y, z] = (WAVES * towards + PHASES).to_array();
    let ([a, b, c], [d, e, f]) = ([x.sin(), y.sin(), z.sin()], [x.cos(), y.cos(), z.cos()]);
    BUMPS * WAVES * DVec3::new(d * b * c, a * e * c, a * b * f)
}

/// The outward normal of the surface along a unit direction.
fn normal(towards: DVec3) -> DVec3 {
    // The surface is where the distance from the middle less the height is 0, whose gradient this is;
    // the height depends on the direction alone.
    let slope = slope(towards);
    (towards - (slope - towards * slope.dot(towards)) / height(towards)).normalize_or(towards)
}

/// A surfel of the body.
struct Surfel {
    position: Vec3,
    normal: Vec3,
    radius: f32,
    color: [u8; 3],
}

/// Surfel `i` of `n`, on a spiral that gives each as much of the sphere.
fn surfel(i: u32, n: u32) -> Surfel {
    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
    // The golden angle. The fraction of turns keeps its digits where the angle would lose them.
    let turns = f64::from(i) * 0.5 * (3.0 - 5f64.sqrt());
    let (sin, cos) = (TAU * turns.fract()).sin_cos();
    let ring = (1.0 - z * z).max(0.0).sqrt();
    let towards = DVec3::new(ring * cos, z, ring * sin);
    let (height, normal) = (height(towards), normal(towards));
    // What a surfel has of the sphere, on the surface above it.
    let area = 4.0 * PI / f64::from(n) * height * height / normal.dot(towards);
    let shade = |wave: f64, of: f64| (128.0 + 100.0 * (wave * of).sin()) as u8;
    Surfel {
        position: (height * towards).as_vec3(),
        normal: normal.as_vec3(),
        radius: (OVERLAP * area.sqrt()) as f32,
        color: [shade(9.0, towards.x), shade(8.0, towards.y), shade(7.0, towards.z)],
    }
}

/// The body, of so many surfels.
pub fn body(n: u32) -> anyhow::Result<Clouds> {
    let each = || (0..n).into_par_iter().map(|i| surfel(i, n));
    // One column after the other, which keeps memory to what the cloud takes.
    let positions = each().flat_map_iter(|one| one.position.to_array()).collect();
    let normals = each().flat_map_iter(|one| one.normal.to_array()).collect();
    let radii = each().map(|one| one.radius).collect();
    let colors = each().flat_map_iter(|one| one.color).collect();
    let columns = vec![
        Column::new(POSITION, 3, Buffer::F32(positions)),
        Column::new(NORMAL, 3, Buffer::F32(normals)),
        Column::new(RADIUS, 1, Buffer::F32(radii)),
        Column::new(COLOR, 3, Buffer::U8(colors)),
    ];
    let cloud = Cloud::new(DVec3::ZERO, columns).context("the body of a benchmark")?;
    let n_surfels = u64::from(n);
    let summary = Summary { n_in_file: n_surfels, n_surfels, ..Summary::default() };
    Ok(Clouds::of(vec![Loaded { cloud, summary }]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_those_of_the_surface() {
        for i in 0..500 {
            let one = surfel(i, 500);
            let towards = one.position.as_dvec3().normalize_or(DVec3::X);
            let side = towards.any_orthonormal_vector();
            for side in [side, towards.cross(side)] {
                // Finite differences: the error of a central one is the square of the step.
                let at = |step: f64| {
                    let towards = (towards + step * side).normalize_or(DVec3::X);
                    towards * height(towards)
                };
                let along = (at(1e-4) - at(-1e-4)).normalize_or(DVec3::X);
                let found = along.dot(one.normal.as_dvec3());
                assert!(found.abs() < 1e-5, "{i}: {found}");
            }
        }
    }

    #[test]
    fn every_number_of_surfels_is_the_same_body() {
        for n in [10_000, 40_000] {
            let clouds = body(n).unwrap();
            let cloud = &clouds.loaded[0].cloud;
            assert_eq!(cloud.len() as u32, n);
            let reach = |(place, radius): (&Vec3, &f32)| place.length() + radius;
            let reach = cloud.positions().iter().zip(cloud.radii()).map(reach);
            assert!(f64::from(reach.fold(0.0, f32::max)) < REACH);
            // Each covers its share and overlaps: pi * 1.5^2 times the surface in all.
            let area: f64 = cloud.radii().iter().map(|r| PI * f64::from(*r).powi(2)).sum();
            let surface = area / (PI * OVERLAP * OVERLAP);
            assert!((12.0..16.0).contains(&surface), "a ball of radius 1 has 12.6: {surface}");
        }
    }
}
