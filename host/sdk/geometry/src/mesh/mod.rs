//! Triangle meshes: areas, normals and covering discs of their vertices.
//!
//! A face is three indices into the positions, counterclockwise seen from outside. Faces with an
//! index out of range or a corner that is not finite count for nothing. All sums run in the order of
//! the faces, in f64, so that results do not depend on threads.

mod scatter;

use crate::bounds::Bounds;
use crate::normals::{is_valid, normalised};
use crate::radii::{COVER, in_range};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

pub use scatter::{MeshPoint, scatter};

/// The corners of a face; `None` where it counts for nothing.
fn corners(positions: &[Vec3], face: &[u32; 3]) -> Option<[DVec3; 3]> {
    let corner = |index: u32| positions.get(index as usize).map(|position| position.as_dvec3());
    let corners = [corner(face[0])?, corner(face[1])?, corner(face[2])?];
    corners.iter().all(|corner| corner.is_finite()).then_some(corners)
}

/// Normal of a triangle times twice its area.
fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The area of each face, squared scene units; 0 for those without extent.
#[must_use]
pub fn areas(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<f64> {
    let area = |face| corners(positions, face).map_or(0.0, |at| 0.5 * cross(at).length());
    faces.par_iter().map(area).collect()
}

/// The unit normal of each face; zero where it has no area.
#[must_use]
pub fn face_normals(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<Vec3> {
    let normal = |face| {
        let across = corners(positions, face).map_or(DVec3::ZERO, cross);
        across.normalize_or_zero().as_vec3()
    };
    faces.par_iter().map(normal).collect()
}

/// A third of the areas of each vertex's faces: what the vertex stands for as a surface element.
/// They add up to the mesh's area.
///
/// Source: Bunnell, "Dynamic Ambient Occlusion and Indirect Lighting", GPU Gems 2, 2005; Liu 2006,
/// section 2.8.
#[must_use]
pub fn vertex_areas(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<f64> {
    let mut sums = vec![0.0; positions.len()];
    for (face, area) in faces.iter().zip(areas(positions, faces)) {
        // A face with an index out of range has no area; what it has in range gets none.
        for &corner in face.iter().filter(|_| area > 0.0) {
            sums[corner as usize] += area / 3.0;
        }
    }
    sums
}

/// Share of the areas around a vertex that has to be left of their sum as vectors: less is rounding
/// of f32 positions, as where a sheet has faces on both sides.
const CANCELLED: f64 = 1e-6;

/// Unit normals of the vertices, means of those of their faces weighted by area; zero where there
/// are no faces with an area or they cancel out.
#[must_use]
pub fn vertex_normals(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); positions.len()];
    for face in faces {
        let Some(at) = corners(positions, face) else { continue };
        let across = cross(at);
        for &corner in face {
            let (sum, total) = &mut sums[corner as usize];
            *sum += across;
            *total += across.length();
        }
    }
    let normal = |&(sum, total): &(DVec3, f64)| {
        let is_left = sum.length() > CANCELLED * total;
        if is_left { sum.normalize_or_zero().as_vec3() } else { Vec3::ZERO }
    };
    sums.par_iter().map(normal).collect()
}

/// Distances of the farthest points of a triangle that are nearest to each corner.
///
/// In an acute triangle that is the middle of the circle through the corners, for all three. In an
/// obtuse one that middle lies outside, and what counts is where the bisectors of the short edges
/// meet the long one.
fn reaches([a, b, c]: [DVec3; 3]) -> [f64; 3] {
    // Squares of the edges opposite to the corners.
    let edges = [b.distance_squared(c), c.distance_squared(a), a.distance_squared(b)];
    let longest = (0..3).max_by(|&i, &j| edges[i].total_cmp(&edges[j])).unwrap_or(0);
    let (left, right) = ((longest + 1) % 3, (longest + 2) % 3);
    let mut reaches = [0.0; 3];
    if edges[longest] >= edges[left] + edges[right] {
        // `left` lies opposite to its own edge, so its short edge is that of `right`.
        let reach = |corner: usize, short: usize| {
            let along = edges[short] + edges[longest] - edges[corner];
            if along > 0.0 { edges[short] * edges[longest].sqrt() / along } else { 0.0 }
        };
        reaches[left] = reach(left, right);
        reaches[right] = reach(right, left);
        reaches[longest] = reaches[left].max(reaches[right]);
    } else {
        let product = edges.iter().map(|edge| edge.sqrt()).product::<f64>();
        let area = 0.5 * cross([a, b, c]).length();
        reaches = [product / (4.0 * area); 3];
    }
    reaches
}

/// Smallest cosine between the normals of a vertex and of a face that its disc makes up for. A
/// disc that is tilted to a face by more than 60 degrees hardly covers any of it, however large.
const STEEPEST: f64 = 0.5;

/// Radii at which discs at the vertices cover the mesh without holes; 0 at vertices without a face
/// of any extent.
///
/// A triangle is covered where each of its points lies in the disc of the nearest corner. So the
/// radius reaches the farthest of these points in every face around, times 1.15 for curvature,
/// and is divided by the cosine between the face and the disc, which lies askew at a sharp edge. The
/// longest edge around would do as well, but with more than twice the area: in an equilateral
/// triangle the farthest point is 0.58 of an edge away. `normals` are vectors of any length, one per
/// position; where they are missing, zero or not finite, discs count as lying in the faces.
#[must_use]
pub fn vertex_radii(positions: &[Vec3], normals: &[Vec3], faces: &[[u32; 3]]) -> Vec<f32> {
    let mut radii = vec![0.0f64; positions.len()];
    for face in faces {
        let Some(at) = corners(positions, face) else { continue };
        let across = cross(at).normalize_or_zero();
        for (&corner, reach) in face.iter().zip(reaches(at)) {
            let normal = normals.get(corner as usize).filter(|normal| is_valid(**normal));
            let tilt = normal.map_or(1.0, |n| normalised(*n).as_dvec3().dot(across).abs());
            let cosine = if across == DVec3::ZERO { 1.0 } else { tilt.clamp(STEEPEST, 1.0) };
            let radius = &mut radii[corner as usize];
            *radius = radius.max(COVER * reach / cosine);
        }
    }
    let usable = |radius: f64| if radius > 0.0 { in_range(radius) } else { 0.0 };
    radii.into_iter().map(usable).collect()
}

/// Whether a mesh is closed and its faces are clockwise seen from outside.
///
/// It is closed where each edge is passed as often in one direction as in the other; of such a
/// mesh the faces enclose a volume, whose sign tells. Any other mesh has no outside that faces
/// alone would tell, and false is the answer.
#[must_use]
pub fn is_inside_out(positions: &[Vec3], faces: &[[u32; 3]]) -> bool {
    let centre = Bounds::of_positions(positions).map_or(DVec3::ZERO, |bounds| bounds.centre());
    let volume = |face: &[u32; 3]| {
        corners(positions, face).map_or(0.0, |at| {
            let [a, b, c] = at.map(|corner| corner - centre);
            a.dot(b.cross(c))
        })
    };
    faces.iter().map(volume).sum::<f64>() < 0.0 && is_closed(faces)
}

/// Whether each edge is passed as often in one direction as in the other.
fn is_closed(faces: &[[u32; 3]]) -> bool {
    let edges = |turned: bool| -> Vec<[u32; 2]> {
        let of_face = |[a, b, c]: &[u32; 3]| {
            let edges = [[*a, *b], [*b, *c], [*c, *a]];
            if turned { edges.map(|[from, to]| [to, from]) } else { edges }
        };
        let mut all: Vec<[u32; 2]> = faces.iter().flat_map(of_face).collect();
        all.par_sort_unstable();
        all
    };
    !faces.is_empty() && edges(false) == edges(true)
}

#[cfg(test)]
mod tests;
