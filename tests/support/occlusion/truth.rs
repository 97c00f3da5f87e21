//! Ambient occlusion from rays against triangles: the truth that methods on points are held to.

use super::scenes::Mesh;
use glam::{DVec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::Ray;
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::Duration;
use surfelshop_geometry::Bounds;

/// Accessibility of each point, and how firm it is.
#[derive(Clone, Debug)]
pub struct Truth {
    /// The mean of two independent runs.
    pub ao: Vec<f32>,
    /// Root mean square of half the difference between the runs: the error of their mean.
    pub noise: f64,
}

/// Height above the surface at which rays start, in diagonals of the bounds, where nobody says
/// otherwise.
const OFFSET: f64 = 1e-4;

/// Traces `rays` rays twice from each point of a mesh, from `offset` times the usual height.
#[must_use]
pub fn truth(mesh: &Mesh, rays: u32, offset: f64) -> Truth {
    let corner = |index: u32| Vec3A::from(mesh.corners[index as usize]);
    let triangle = |face: &[u32; 3]| {
        let [v0, v1, v2] = face.map(corner);
        Triangle { v0, v1, v2 }
    };
    let triangles: Vec<Triangle> = mesh.faces.iter().map(triangle).collect();
    let params = BvhBuildParams::medium_build();
    let bvh = build_cwbvh_from_tris(&triangles, params, &mut Duration::default());
    let diagonal = Bounds::of_positions(&mesh.positions).map_or(0.0, |bounds| bounds.diagonal());
    let height = (offset * OFFSET * diagonal) as f32;
    let share = |i: usize, run: u64| {
        let normal = mesh.normals[i];
        let (u, v) = normal.any_orthonormal_pair();
        let origin = mesh.positions[i] + height * normal;
        let start = shift(2 * i as u64 + run);
        let hits = (0..rays).filter(|&k| {
            let [across, up] = cosine(start, k);
            let direction = u * across.x as f32 + v * across.y as f32 + normal * up.x as f32;
            // Adding zero makes negative zeros positive, which the hierarchy counts on.
            let ray = Ray::new(origin.into(), (direction + Vec3::ZERO).into(), 0.0, f32::INFINITY);
            !bvh.ray_traverse_miss(ray, |ray, place| {
                triangles[bvh.primitive_indices[place] as usize].intersect(ray)
            })
        });
        1.0 - hits.count() as f32 / rays as f32
    };
    let runs: Vec<[f32; 2]> =
        (0..mesh.positions.len()).into_par_iter().map(|i| [share(i, 0), share(i, 1)]).collect();
    let half = |[a, b]: &[f32; 2]| f64::from((a - b) / 2.0).powi(2);
    let noise = (runs.iter().map(half).sum::<f64>() / runs.len().max(1) as f64).sqrt();
    Truth { ao: runs.iter().map(|[a, b]| (a + b) / 2.0).collect(), noise }
}

/// A random start in the unit square (`SplitMix64`, Steele et al. 2014).
fn shift(index: u64) -> DVec2 {
    let mut z = index.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x1234_5678_9abc_def0);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    DVec2::new((z >> 32) as f64, (z & 0xffff_ffff) as f64) / 2f64.powi(32)
}

/// The `k`th of a sequence of directions about +z that follow the cosine: its first two
/// components, and its third.
///
/// Source: the sequence R2 with the plastic number, Roberts 2018; not the sequence of the tool.
fn cosine(start: DVec2, k: u32) -> [DVec2; 2] {
    let step = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);
    let point = (start + f64::from(k) * step).fract();
    let across = DVec2::from_angle(std::f64::consts::TAU * point.y) * point.x.sqrt();
    [across, DVec2::splat((1.0 - point.x).max(0.0).sqrt())]
}
