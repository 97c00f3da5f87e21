//! Normals that light what is no surface.

use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, map, part, report};
use crate::radii::PLANAR;
use glam::{DVec3, Vec3};

/// Leaves of a clump: some 64 points, as those of a twig with its leaves.
const LEAVES: usize = 4;

/// Clumps of a crown: some 512 points, whose own shape is lit besides.
const CLUMPS: usize = 8;

/// Weight of the direction out of a clump, beside that out of the crown.
const CLUMP: f32 = 0.5;

/// Planarity below [`PLANAR`] over which a normal becomes soft.
const FADE: f32 = 0.15;

/// Replaces normals of points that are of no surface, whose planarity is below [`PLANAR`], by soft ones: what some
/// 64 points that lie together face on the mean, and outwards from their middle and from that of some 512. Leaves, each
/// with a plane of its own, are lit as the clump and the crown that they are of. Up to 0.15 below the threshold it goes smoothly from one to the other.
///
/// `normals` and `planarity` have an entry for each position; where planarity lacks, nothing changes.
///
/// # Errors
/// Where `progress` asks to stop; `normals` are then unchanged.
pub fn soften(
    neighbours: &Neighbours,
    normals: &mut [Vec3],
    planarity: &[f32],
    progress: Progress<'_>,
) -> Result<(), Cancelled> {
    if planarity.len() < normals.len() || planarity.iter().all(|&planarity| planarity >= PLANAR) {
        return report(progress, 1.0);
    }
    let tree = neighbours.tree();
    let n_clumps = tree.n_leaves().div_ceil(LEAVES);
    let of_leaves = |leaves: usize, clump: usize| {
        let last = (leaves * (clump + 1)).min(tree.n_leaves()) - 1;
        Clump::of(neighbours, normals, tree.leaf(leaves * clump).start..tree.leaf(last).end)
    };
    let clumps = map(n_clumps, &part(progress, 0.0..0.2), |clump| of_leaves(LEAVES, clump))?;
    let n_crowns = n_clumps.div_ceil(CLUMPS);
    let crowns =
        map(n_crowns, &part(progress, 0.2..0.4), |crown| of_leaves(LEAVES * CLUMPS, crown))?;
    let is_soft = |place: &usize| planarity[neighbours.index(*place)] < PLANAR;
    let places = (0..tree.len()).filter(|&place| neighbours.index(place) < normals.len());
    let places: Vec<usize> = places.filter(is_soft).collect();
    let softened = map(places.len(), &part(progress, 0.4..1.0), |i| {
        let place = places[i];
        let (index, leaf) = (neighbours.index(place), tree.leaf_of(place));
        let soft = (PLANAR - planarity[index]) / FADE;
        let (clump, crown) = (&clumps[leaf / LEAVES], &crowns[leaf / (LEAVES * CLUMPS)]);
        let point = neighbours.point(place);
        let all = clump.facing + CLUMP * clump.outwards(point) + crown.outwards(point);
        let own = normals[index];
        own.lerp(all.normalize_or(own), soft.min(1.0)).try_normalize().unwrap_or(own)
    })?;
    for (&place, softened) in places.iter().zip(softened) {
        normals[neighbours.index(place)] = softened;
    }
    if normals.len() >= neighbours.len() {
        neighbours.copy_to_copies(normals);
    }
    Ok(())
}

/// Points that lie together.
struct Clump {
    middle: DVec3,
    /// The root of the mean squared distance from it.
    extent: f64,
    /// The mean of the normals, shorter where they differ.
    facing: Vec3,
}

impl Clump {
    fn of(neighbours: &Neighbours, normals: &[Vec3], places: std::ops::Range<usize>) -> Self {
        let n = places.len().max(1) as f64;
        let origin = neighbours.point(places.start);
        let mean = |sum: DVec3| sum / n;
        let middle = mean(places.clone().map(|place| neighbours.point(place) - origin).sum());
        let squared = |place| (neighbours.point(place) - origin - middle).length_squared();
        let extent = (places.clone().map(squared).sum::<f64>() / n).sqrt();
        let facing = places.map(|place| normals[neighbours.index(place)].as_dvec3()).sum();
        Self { middle: origin + middle, extent, facing: mean(facing).as_vec3() }
    }

    /// Away from the middle, about 1 long; zero where all points are one.
    fn outwards(&self, point: DVec3) -> Vec3 {
        if self.extent <= 0.0 {
            return Vec3::ZERO;
        }
        ((point - self.middle) / self.extent).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hashing;
    use crate::silent;

    /// A ball of points at random.
    fn ball(n: u64) -> Vec<Vec3> {
        let unit = |i: u64| hashing::fraction(hashing::scattered(i)) as f32 * 2.0 - 1.0;
        let point = |i: u64| Vec3::new(unit(3 * i), unit(3 * i + 1), unit(3 * i + 2));
        (0..).map(point).filter(|p| p.length() < 1.0).take(n as usize).collect()
    }

    /// Invariant: points of no surface are lit by normals that leave their clump
    #[test]
    fn what_is_no_surface_is_lit_from_outside() {
        let positions = ball(64);
        let neighbours = Neighbours::build(&positions, &silent).unwrap();
        let mut normals = vec![Vec3::Z; positions.len()];
        soften(&neighbours, &mut normals, &vec![0.0; positions.len()], &silent).unwrap();
        let outwards = positions.iter().zip(&normals).filter(|(p, n)| p.dot(**n) > 0.0).count();
        assert!(outwards > 45, "{outwards} of 64");
        assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5));
        // Half way down the fade the change is smaller, and a surface keeps its normals.
        let mut faded = vec![Vec3::Z; positions.len()];
        soften(&neighbours, &mut faded, &vec![0.425; positions.len()], &silent).unwrap();
        let nearer = faded.iter().zip(&normals).filter(|(f, n)| f.z >= n.z - 1e-6).count();
        assert_eq!(nearer, positions.len());
        let mut kept = vec![Vec3::Z; positions.len()];
        soften(&neighbours, &mut kept, &vec![0.5; positions.len()], &silent).unwrap();
        assert!(kept.iter().all(|normal| *normal == Vec3::Z));
    }
}
