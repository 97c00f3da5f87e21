//! Rays between surfels: both ends of one look into the same free space.

use crate::discs::Discs;
use crate::hashing;
use crate::progress::{Cancelled, Progress, flat_map};
use crate::visibility::surfels::Surfel;
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Rays in all, each about 1.2 us. Measured: with more than twice as many no shape of the tests has more normals right.
const RAYS: usize = 500_000;

/// Most rays to each side of a surfel.
const MOST: usize = 16;

/// Distance of a ray's start from the surface, in radii.
const START: f32 = 0.33;

/// Hits nearer than so many radii say more about noise than about free space.
const NEAR: f32 = 3.0;

/// Cosine between a ray and a surface below which noise decides on which side the ray arrives.
const GRAZING: f32 = 0.15;

/// Weight of a ray that arrives straight on.
pub(super) const STRAIGHT: f32 = 16.0;

/// A ray from a surfel to another one, to the sky or to a viewpoint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) from: u32,
    /// A surfel; or the number of surfels plus a part of the sky; or behind these a viewpoint.
    pub(super) to: u32,
    /// Above 0; that of a ray that arrives straight on is `STRAIGHT`.
    pub(super) weight: u8,
    /// Whether it leaves on the side of the normal.
    pub(super) leaves_front: bool,
    /// Whether it arrives on the side of the normal; true for sky and viewpoints.
    pub(super) arrives_front: bool,
}

/// The directions that lead out of a scan, in parts.
pub(super) struct Sky {
    /// Takes up to +z.
    turn: Quat,
}

impl Sky {
    /// Its parts: four on each face of a cube whose top is up, so that none crosses the horizon.
    pub(super) const PARTS: usize = 24;

    /// A sky above the ground that this unit vector is up from; above any where there is none.
    pub(super) fn above(up: Option<Vec3>) -> Self {
        Self { turn: up.map_or(Quat::IDENTITY, |up| Quat::from_rotation_arc(up, Vec3::Z)) }
    }

    /// The part that a direction leads to.
    fn part(&self, direction: Vec3) -> usize {
        let d = self.turn * direction;
        let a = d.abs();
        let (axis, u, v) = if a.z >= a.x && a.z >= a.y {
            (2, d.x, d.y)
        } else if a.x >= a.y {
            (0, d.y, d.z)
        } else {
            (1, d.x, d.z)
        };
        let half = |positive: bool| usize::from(positive);
        (2 * axis + half(d[axis] > 0.0)) * 4 + 2 * half(u > 0.0) + half(v > 0.0)
    }

    /// The height of the middle of a part: the sine of its elevation, about.
    pub(super) fn height(part: usize) -> f64 {
        let (axis, far, v) = (part / 8, part / 4 % 2, part % 2);
        let sign = |positive: usize| if positive == 1 { 1.0 } else { -1.0 };
        if axis == 2 { 0.85 * sign(far) } else { 0.4 * sign(v) }
    }
}

/// Traces rays from both sides of surfels, in the order of the surfels.
pub(super) fn trace(
    surfels: &[Surfel],
    discs: &Discs,
    sky: &Sky,
    progress: Progress<'_>,
) -> Result<Vec<Ray>, Cancelled> {
    let each_side = (RAYS / (2 * surfels.len()).max(1)).clamp(1, MOST);
    // Of very many surfels some send rays.
    let stride = surfels.len().div_ceil(RAYS / 2).max(1);
    flat_map(surfels.len().div_ceil(stride), progress, |i| {
        let from = i * stride;
        [true, false].into_iter().flat_map(move |front| {
            let side = (from, front);
            (0..each_side).filter_map(move |k| ray(surfels, discs, sky, side, (k, each_side)))
        })
    })
}

/// The `k`th of `count` rays from a side of a surfel; `None` where it says nothing.
fn ray(
    surfels: &[Surfel],
    discs: &Discs,
    sky: &Sky,
    (from, front): (usize, bool),
    (k, count): (usize, usize),
) -> Option<Ray> {
    let surfel = &surfels[from];
    if surfel.radius <= 0.0 {
        return None;
    }
    let normal = if front { surfel.normal } else { -surfel.normal };
    let direction = direction(normal, 2 * from as u64 + u64::from(front), k, count);
    let origin = surfel.position + normal * (START * surfel.radius);
    let (from, leaves_front) = (from as u32, front);
    let Some(hit) = discs.nearest(origin, direction, 0.0..f32::MAX, |_| true) else {
        let to = (surfels.len() + sky.part(direction)) as u32;
        return Some(Ray { from, to, weight: STRAIGHT as u8, leaves_front, arrives_front: true });
    };
    let cosine = surfels[hit.index as usize].normal.dot(direction).abs();
    let tells = hit.distance > NEAR * surfel.radius && cosine > GRAZING && hit.index != from;
    let weight = (STRAIGHT * cosine).round().max(1.0) as u8;
    tells.then_some(Ray { from, to: hit.index, weight, leaves_front, arrives_front: hit.front })
}

/// A direction of a hemisphere, more of them near its axis: the cosine of the angle is the density.
/// The `count` directions are spread evenly, another way for each seed.
fn direction(axis: Vec3, seed: u64, k: usize, count: usize) -> Vec3 {
    let shift = |place: u64| hashing::unit(seed, place) as f32;
    // Multiples of a number whose multiples fall evenly: Roberts 2018.
    let u = (k as f32 + shift(0)) / count as f32;
    let v = (k as f32 * 0.754_877_7 + shift(1)).fract();
    let disc = Vec2::from_angle(TAU * v) * u.sqrt();
    let (x, y) = axis.any_orthonormal_pair();
    (disc.x * x + disc.y * y + (1.0 - u).max(0.0).sqrt() * axis).normalize_or(axis)
}
