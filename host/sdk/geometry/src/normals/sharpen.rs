//! Normals at edges: those of the face that a point lies in, not of the mean of both.

use super::fit::{Fit, Fits};
use crate::neighbours::{Neighbours, Scratch};
use crate::progress::{Cancelled, Progress, map_with, part};
use glam::DVec3;

/// Roughness from which on a point may lie at an edge: a fold by 40 degrees has 0.15.
const ROUGH: f32 = 0.12;

/// Points around in whose surroundings one may lie.
const AROUND: usize = 16;

/// Roughness below which surroundings are flat. Noise is rougher, where the side of an edge that a point is
/// on cannot be told: the mean of both is then nearer to the truth more often.
const FLAT: f32 = 0.04;

/// Surroundings that are this much flatter are of one face: the planes of points at a fold differ by as much from
/// those beside it.
const FLATTER: f32 = 0.5;

/// Distance from a face's plane, over that from its point, up to which a point lies in it: 6 degrees.
const IN_PLANE: f64 = 0.1;

/// The same in standard deviations of the face's own points, where that is more.
const IN_NOISE: f64 = 2.0;

/// Cosine of the angle between normals of one face: 20 degrees.
const ONE_FACE: f64 = 0.94;

/// Cosine of the angle from which on a normal is changed: less is curvature, 10 degrees.
const CHANGED: f64 = 0.985;

/// Points that others are taken for in turn: along an edge the nearest with flat surroundings may be two rings away.
const ROUNDS: usize = 2;

/// Turns the normals of points at edges to those of the faces that they lie in, and gives the number of such points.
/// Their fits become those of the faces.
pub(super) fn edges(
    neighbours: &Neighbours,
    fits: &mut Fits,
    progress: Progress<'_>,
) -> Result<usize, Cancelled> {
    let is_rough = |place: &u32| {
        let fit = fits.at(*place as usize);
        !fit.is_degenerate() && fit.roughness > ROUGH
    };
    let mut open: Vec<u32> = (0..fits.len() as u32).filter(is_rough).collect();
    let mut n_found = 0;
    for round in 0..ROUNDS {
        let step = |round: usize| round as f64 / ROUNDS as f64;
        let step = part(progress, step(round)..step(round + 1));
        let known = &*fits;
        let sharp = map_with(open.len(), &step, Scratch::default, |room, i| {
            face(neighbours, known, open[i] as usize, room)
        })?;
        let mut rest = Vec::new();
        for (&place, sharp) in open.iter().zip(&sharp) {
            let Some(sharp) = sharp else {
                rest.push(place);
                continue;
            };
            let place = place as usize;
            fits.normals[place] = sharp.normal;
            (fits.roughness[place], fits.errors[place]) = (sharp.roughness, sharp.error);
            n_found += 1;
        }
        open = rest;
    }
    Ok(n_found)
}

/// The face that a point lies in, where it is another than its own plane.
fn face(neighbours: &Neighbours, fits: &Fits, place: usize, room: &mut Scratch) -> Option<Fit> {
    let (own, here) = (fits.at(place), neighbours.point(place));
    let near = neighbours.around(place, AROUND, room);
    // How far the point is from the plane of another one, in shares of what is still in it.
    let off = |other: usize| {
        let fit = fits.at(other);
        let away = here - neighbours.point(other);
        let height = away.dot(fit.normal.as_dvec3()).abs();
        height / (IN_PLANE * away.length()).max(IN_NOISE * f64::from(fit.error))
    };
    let flat = near.iter().map(|found| found.place as usize).filter(|&other| {
        let fit = fits.at(other);
        let is_flat = fit.roughness < FLAT && fit.roughness < FLATTER * own.roughness;
        is_flat && !fit.is_degenerate()
    });
    let faces: Vec<(usize, f64)> =
        flat.map(|other| (other, off(other))).filter(|&(_, off)| off < 1.0).collect();
    let &(best, _) = faces.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let towards = fits.normals[best].as_dvec3();
    let sum: DVec3 = faces
        .iter()
        .map(|&(other, _)| fits.normals[other].as_dvec3())
        .filter(|normal| normal.dot(towards).abs() > ONE_FACE)
        .map(|normal| normal * normal.dot(towards).signum())
        .sum();
    let normal = sum.try_normalize()?;
    let changes = normal.dot(own.normal.as_dvec3()).abs() < CHANGED;
    // Its sign is that of the face: signs pass over an edge more surely by what is rounded off.
    changes.then(|| Fit { normal: normal.as_vec3(), ..fits.at(best) })
}
