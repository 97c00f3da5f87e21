//! Selections by what is near: grown, shrunk, and all that hangs together.

use super::{Selection, SelectionError};
use crate::cloud::Cloud;
use glam::{DVec3, Vec3};
use surfelshop_geometry::octree::Octree;
use surfelshop_geometry::silent;

/// Surfels of a leaf.
const LEAF: usize = 16;

/// Radii that lie between neighbours where nobody says how far they are apart: discs that cover a surface without
/// gaps are at most this far from each other.
const RADII: f64 = 2.0;

/// The distance at which surfels of a cloud are neighbours where nobody says so: twice their median radius; without
/// radii, what as many on the faces of their box would have between them. Scene units.
#[must_use]
pub fn usual_distance(cloud: &Cloud) -> f64 {
    let mut radii: Vec<f32> =
        cloud.radii().iter().copied().filter(|radius| *radius > 0.0).collect();
    if radii.is_empty() {
        let bounds = surfelshop_geometry::Bounds::of_positions(cloud.positions());
        let extent = bounds.map_or(0.0, |bounds| bounds.diagonal());
        return RADII * extent / (cloud.len().max(1) as f64).sqrt();
    }
    let middle = radii.len() / 2;
    let (_, median, _) = radii.select_nth_unstable_by(middle, f32::total_cmp);
    RADII * f64::from(*median)
}

/// The selection with all surfels that are at most so far from one of it, scene units.
///
/// # Errors
/// Where the selection is of another cloud, the distance is none, or there is no memory.
pub fn grown(
    cloud: &Cloud,
    selection: &Selection,
    distance: f64,
) -> Result<Selection, SelectionError> {
    let positions = checked(cloud, selection, distance)?;
    let chosen: Vec<Vec3> = selection.indices().map(|i| positions[i]).collect();
    let near = Near::of(chosen, distance);
    Selection::of(cloud.len(), |i| selection.contains(i) || near.any(positions[i]))
}

/// The selection without the surfels that are at most so far from one that is not of it, scene units.
///
/// # Errors
/// As [`grown`].
pub fn shrunk(
    cloud: &Cloud,
    selection: &Selection,
    distance: f64,
) -> Result<Selection, SelectionError> {
    Ok(grown(cloud, &selection.inverted(), distance)?.inverted())
}

/// All surfels that can be reached from the one nearest to a place in world space by steps of at most so far, scene
/// units; none where the cloud is empty.
///
/// # Errors
/// Where the distance is none, or there is no memory.
pub fn component(cloud: &Cloud, place: DVec3, distance: f64) -> Result<Selection, SelectionError> {
    let mut first = Selection::none(cloud.len())?;
    let positions = checked(cloud, &first, distance)?;
    let at = place - cloud.origin();
    let squared = |position: &Vec3| position.as_dvec3().distance_squared(at);
    let nearest = (0..positions.len())
        .filter(|&i| positions[i].is_finite())
        .min_by(|&a, &b| squared(&positions[a]).total_cmp(&squared(&positions[b])));
    if let Some(nearest) = nearest {
        first.insert(nearest);
    }
    connected(cloud, &first, distance)
}

/// The selection with all surfels that can be reached from it by steps of at most so far, scene units.
///
/// # Errors
/// As [`grown`].
pub fn connected(
    cloud: &Cloud,
    selection: &Selection,
    distance: f64,
) -> Result<Selection, SelectionError> {
    let positions = checked(cloud, selection, distance)?;
    let near = Near::of(positions.to_vec(), distance);
    let mut found = selection.clone();
    let mut open: Vec<usize> = selection.indices().collect();
    while let Some(next) = open.pop() {
        near.each(positions[next], |other| {
            if !found.contains(other) {
                found.insert(other);
                open.push(other);
            }
        });
    }
    Ok(found)
}

/// The positions of a cloud that a selection is of and that can be numbered.
fn checked<'a>(
    cloud: &'a Cloud,
    selection: &Selection,
    distance: f64,
) -> Result<&'a [Vec3], SelectionError> {
    if selection.len() != cloud.len() {
        let (expected, found) = (cloud.len(), selection.len());
        return Err(SelectionError::Length { expected, found });
    }
    if u32::try_from(cloud.len()).is_err() {
        return Err(SelectionError::TooMany { found: cloud.len() });
    }
    // Squares of what is smaller are no numbers in single precision.
    if !(distance > 1e-18 && distance < 1e18) {
        return Err(SelectionError::Distance { found: distance });
    }
    Ok(cloud.positions())
}

/// Places, found by where they are.
struct Near {
    places: Vec<Vec3>,
    tree: Octree,
    distance: f32,
}

impl Near {
    fn of(places: Vec<Vec3>, distance: f64) -> Self {
        // Nothing asks it to stop.
        let tree = Octree::build(&places, LEAF, &silent).unwrap_or_default();
        Self { places, tree, distance: distance as f32 }
    }

    /// Calls `found` with the number of each place that is near another.
    fn each(&self, other: Vec3, mut found: impl FnMut(usize)) {
        let squared = self.distance * self.distance;
        self.tree.leaves_near((other, other), self.distance, |leaf| {
            let range = leaf.surfels.start as usize..leaf.surfels.end as usize;
            for &place in &self.tree.order()[range] {
                if self.places[place as usize].distance_squared(other) <= squared {
                    found(place as usize);
                }
            }
        });
    }

    fn any(&self, other: Vec3) -> bool {
        let mut is_near = false;
        self.each(other, |_| is_near = true);
        is_near
    }
}
