//! Samples that lie on an edge itself.
//!
//! A vertex of a mesh where faces meet has the mean of their normals, which is that of none of them: a
//! splat for it would stick out. Such a sample is told by its neighbours, since it lies in the planes of
//! those on each face although its normal differs from theirs, where on a smooth surface it would lie
//! half the slope between beside them. It becomes a sample of each face in the same place.

use super::samples::{Samples, within};
use std::ops::Range;
use std::slice;
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;

/// Distance of a sample from the plane of one on a face, in lengths times the sine of the angle between
/// the normals, up to which it lies in the plane; on a smooth surface that is a half.
const IN_PLANE: f64 = 0.25;

/// Samples that make a face.
const FACE: usize = 2;

/// Faces that meet in a corner; more are left out.
const MOST: usize = 4;

/// Gives samples on edges and corners the normal of each face, and returns how many there are. Faces are
/// parts whose normals differ by an angle of cosine `alike` or less.
pub(crate) fn split(
    samples: &mut Samples,
    alike: f64,
    share: Range<f64>,
    job: &Job<'_>,
) -> Result<usize> {
    let n = samples.len();
    let known: &Samples = samples;
    let own = |j: u32| slice::from_ref(&known.normals[j as usize]);
    let [first, second] = [0.5, 0.8].map(|fraction| within(&share, fraction));
    let on_edge = job.map(n, share.start..first, |i| faces(known, alike, i, own).len() > 1)?;
    // Others on edges say nothing of the faces, and in a corner each edge looks like one.
    let on_face = |j: u32| if on_edge[j as usize] { &[][..] } else { own(j) };
    let along_edges = job.map(n, first..second, |i| match on_edge[i] {
        true => faces(known, alike, i, on_face),
        false => Vec::new(),
    })?;
    // In a corner they do, once they are on their faces.
    let split = |j: u32| match &along_edges[j as usize] {
        normals if normals.len() > 1 => normals,
        _ => on_face(j),
    };
    let found = job.map(n, second..share.end, |i| match along_edges[i].len() {
        0 | 1 if on_edge[i] => faces(known, alike, i, split),
        _ => along_edges[i].clone(),
    })?;
    let mut copies: Vec<Range<u32>> = vec![0..0; n];
    let mut n_split = 0;
    for (i, faces) in found.iter().enumerate().filter(|(_, faces)| faces.len() > 1) {
        n_split += 1;
        samples.normals[i] = faces[0];
        let first = samples.len() as u32;
        for &normal in &faces[1..] {
            samples.points.push(samples.points[i]);
            samples.normals.push(normal);
            samples.discs.push(samples.discs[i]);
            samples.index.push(samples.index[i]);
        }
        copies[i] = first..samples.len() as u32;
    }
    if n_split == 0 {
        return Ok(0);
    }
    // Whoever had one near has all of its copies near.
    let with_copies = |near: &[u32], own: u32| -> Vec<u32> {
        let all = near.iter().flat_map(|&j| std::iter::once(j).chain(copies[j as usize].clone()));
        all.filter(|&j| j != own).collect()
    };
    let mut near: Vec<Vec<u32>> = (0..n)
        .map(|i| with_copies(&[&[i as u32], &samples.near[i][..]].concat(), i as u32))
        .collect();
    for (i, copies) in copies.iter().enumerate() {
        for copy in copies.clone() {
            near.push(with_copies(&[&[i as u32], &samples.near[i][..]].concat(), copy));
        }
    }
    samples.near = near;
    Ok(n_split)
}

/// Normals of the faces that meet in a sample, by the normals of each that is near it.
fn faces<'a>(
    samples: &Samples,
    alike: f64,
    i: usize,
    normals: impl Fn(u32) -> &'a [DVec3],
) -> Vec<DVec3> {
    let (point, normal) = (samples.points[i], samples.normals[i]);
    // A quarter of the angle between faces: a mean is half of it from both, a corner's more.
    let differs = (alike.clamp(-1.0, 1.0).acos() * 0.25).sin();
    let mut groups: Vec<(DVec3, usize)> = Vec::new();
    let near =
        samples.near[i].iter().flat_map(|&j| normals(j).iter().map(move |&other| (j, other)));
    for (j, other) in near {
        let offset = samples.point(j) - point;
        let sine = normal.cross(other).length();
        let is_in_plane = other.dot(offset).abs() <= IN_PLANE * sine * offset.length();
        if normal.dot(other) <= 0.0 || sine < differs || !is_in_plane {
            continue;
        }
        let is_alike = |(sum, _): &(DVec3, usize)| sum.normalize_or(other).dot(other) > alike;
        if let Some(known) = groups.iter().position(is_alike) {
            groups[known].0 += other;
            groups[known].1 += 1;
        } else if groups.len() < MOST {
            groups.push((other, 1));
        }
    }
    groups.retain(|(_, count)| *count >= FACE);
    groups.into_iter().map(|(sum, _)| sum.normalize_or(normal)).collect()
}
