//! Points of equal area scattered over the triangles of a mesh.

use crate::hashing;
use crate::progress::{Cancelled, Progress, each, map, part};
use glam::{DVec3, Vec3};

/// A place on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshPoint {
    /// Index of the face.
    pub face: u32,
    /// Weights of the face's corners: not negative, with the sum 1.
    pub weights: [f64; 3],
}

impl MeshPoint {
    /// The place in space; the weighted mean of any other vectors at the vertices alike.
    ///
    /// # Panics
    /// Where the face, or one of its corners, does not exist.
    #[must_use]
    pub fn mean(&self, vectors: &[Vec3], faces: &[[u32; 3]]) -> DVec3 {
        let corners = faces[self.face as usize].iter().zip(self.weights);
        corners.map(|(&corner, weight)| weight * vectors[corner as usize].as_dvec3()).sum()
    }
}

/// Numbers that a place takes of the random sequence: one for the face and two within it.
const NUMBERS: u64 = 3;

/// Random places on faces of these `areas`, uniform in area; none where all areas are 0.
///
/// The n-th place follows from `seed` and n alone. A face without area gets none.
///
/// Source: Turk, "Generating Random Points in Triangles", Graphics Gems, 1990.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn scatter(
    areas: &[f64],
    count: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<MeshPoint>, Cancelled> {
    // Only faces with an area, so that no rounding of sums leads to another.
    let (mut faces, mut ends, mut total) = (Vec::new(), Vec::new(), 0.0);
    each(areas.len(), &part(progress, 0.0..0.2), |face| {
        if let Ok(index) = u32::try_from(face)
            && areas[face] > 0.0
            && areas[face].is_finite()
        {
            total += areas[face];
            faces.push(index);
            ends.push(total);
        }
    })?;
    let count = if faces.is_empty() { 0 } else { count };
    map(count, &part(progress, 0.2..1.0), |place| {
        let random = |number| hashing::unit(seed, place as u64 * NUMBERS + number);
        let at = random(0) * total;
        let face = faces[ends.partition_point(|&end| end <= at).min(faces.len() - 1)];
        let (root, share) = (random(1).sqrt(), random(2));
        MeshPoint { face, weights: [1.0 - root, root * (1.0 - share), root * share] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;

    #[test]
    fn places_fall_on_faces_by_area_and_lie_inside() {
        let areas = [0.0, 3.0, 0.0, 1.0, f64::NAN, 0.0];
        let places = scatter(&areas, 40_000, 1, &silent).unwrap();
        let mut counts = [0usize; 6];
        let mut means = [0.0; 3];
        for place in &places {
            counts[place.face as usize] += 1;
            assert!(place.weights.iter().all(|&weight| weight >= 0.0));
            assert!((place.weights.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            means.iter_mut().zip(place.weights).for_each(|(mean, weight)| *mean += weight);
        }
        // Five standard deviations of a share of 3/4 among 40 000, and of a mean of weights.
        assert!((counts[1] as f64 - 30_000.0).abs() < 5.0 * 87.0, "{counts:?}");
        assert_eq!(counts[1] + counts[3], 40_000);
        for mean in means {
            assert!((mean / 40_000.0 - 1.0 / 3.0).abs() < 5.0 * 0.2357 / 200.0, "{means:?}");
        }
        assert_eq!(places[..100], scatter(&areas, 100, 1, &silent).unwrap());
        assert_ne!(places[..100], scatter(&areas, 100, 2, &silent).unwrap());
    }

    #[test]
    fn without_area_there_are_no_places() {
        assert!(scatter(&[0.0, 0.0], 10, 1, &silent).unwrap().is_empty());
        assert!(scatter(&[], 10, 1, &silent).unwrap().is_empty());
        assert!(scatter(&[1.0], 0, 1, &silent).unwrap().is_empty());
    }
}
