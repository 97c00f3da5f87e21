//! Rays between surfels: both ends of one look into the same free space.

use super::surfels::{Surfel, Surfels};
use crate::discs::Discs;
use crate::hashing;
use crate::progress::{Cancelled, Progress, flat_map};
use glam::{Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Parts of the sky: four on each face of a cube whose top is up, so that none crosses the horizon.
pub(super) const SKY: usize = 24;

/// Rays in all. Measured: each costs about 1.5 us.
const RAYS: usize = 2_000_000;

/// Most rays to each side of a surfel.
const MOST: usize = 24;

/// Distance of a ray's start from the surface, in radii.
const START: f32 = 0.25;

/// Hits nearer than so many radii say more about noise than about free space.
const NEAR: f32 = 2.0;

/// Cosine between a ray and a surface below which noise decides on which side the ray arrives.
const GRAZING: f32 = 0.15;

/// Weight of a ray that arrives straight on.
pub(super) const STRAIGHT: f32 = 16.0;

/// A ray from a surfel to another one or to the sky.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) from: u32,
    /// A surfel, or the number of surfels plus a part of the sky.
    pub(super) to: u32,
    /// In [1, `STRAIGHT`].
    pub(super) weight: u8,
    /// Whether it leaves on the side of the normal.
    pub(super) leaves_front: bool,
    /// Whether it arrives on the side of the normal; true for the sky.
    pub(super) arrives_front: bool,
}

/// The part of the sky that a direction leads to; `turn` takes up to +z.
fn sky(direction: Vec3, turn: Quat) -> usize {
    let d = turn * direction;
    let a = d.abs();
    let (axis, u, v) = if a.z >= a.x && a.z >= a.y {
        (2, d.x, d.y)
    } else if a.x >= a.y {
        (0, d.y, d.z)
    } else {
        (1, d.x, d.z)
    };
    let far = usize::from(d[axis] > 0.0);
    (2 * axis + far) * 4 + 2 * usize::from(u > 0.0) + usize::from(v > 0.0)
}

/// Directions of the middles of the parts of the sky, of `sky`.
pub(super) fn sky_directions(turn: Quat) -> [Vec3; SKY] {
    std::array::from_fn(|i| {
        let (axis, far, u, v) = (i / 8, i / 4 % 2, i / 2 % 2, i % 2);
        let half = |one: usize| if one == 1 { 0.45 } else { -0.45 };
        let along = if far == 1 { 1.0 } else { -1.0 };
        let d = match axis {
            2 => Vec3::new(half(u), half(v), along),
            0 => Vec3::new(along, half(u), half(v)),
            _ => Vec3::new(half(u), along, half(v)),
        };
        turn.inverse() * d.normalize_or(Vec3::Z)
    })
}

/// Traces rays from both sides of surfels, in the order of the surfels.
pub(super) fn trace(
    surfels: &Surfels,
    discs: &Discs,
    turn: Quat,
    progress: Progress<'_>,
) -> Result<Vec<Ray>, Cancelled> {
    let all = &surfels.surfels;
    let each_side = (RAYS / (2 * all.len()).max(1)).clamp(1, MOST);
    // Of very many surfels some send rays.
    let stride = all.len().div_ceil(RAYS / 2).max(1);
    flat_map(all.len().div_ceil(stride), progress, |i| {
        let from = i * stride;
        [true, false].into_iter().flat_map(move |front| {
            (0..each_side).filter_map(move |k| ray(all, discs, turn, (from, front), (k, each_side)))
        })
    })
}

/// The `k`th of `count` rays from a side of a surfel; `None` where it says nothing.
fn ray(
    surfels: &[Surfel],
    discs: &Discs,
    turn: Quat,
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
        let to = (surfels.len() + sky(direction, turn)) as u32;
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
    // The second generator of the plane's even sequences: Roberts 2018.
    let u = (k as f32 + shift(0)) / count as f32;
    let v = (k as f32 * 0.754_877_7 + shift(1)).fract();
    let disc = Vec2::from_angle(TAU * v) * u.sqrt();
    let (x, y) = axis.any_orthonormal_pair();
    (disc.x * x + disc.y * y + (1.0 - u).max(0.0).sqrt() * axis).normalize_or(axis)
}
