//! Points far apart from the rest: they say nothing of it, but would make its box so large that all others lie in one
//! place of it.

use crate::Bounds;
use glam::Vec3;

/// Distance from the middle half of the points from which on others are strays, in its extents. Nothing that a device sees
/// is as far, whose middle half is the ground within some metres; and a box so many times as large as the rest
/// changes no side yet: of rooms and bodies that were tried some turn from 1000 times on.
const FAR: f64 = 64.0;

/// Share of the points from which on those that are as far are no strays: there is a small thing in a large scene.
const FEW: f64 = 0.05;

/// Removes the indices of strays. Those that coincide count once: devices write what they have not seen as zeros.
pub(super) fn leave_out(positions: &[Vec3], indices: &mut Vec<u32>) {
    let at = |index: u32| positions[index as usize].as_dvec3();
    let Some(half) = Bounds::of_most(indices.len(), |i| at(indices[i]), 0.25) else { return };
    let near = half.grown(FAR * half.extent());
    let is_far = |index: &u32| !near.holds(at(*index));
    let bits = |index: u32| (positions[index as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut far: Vec<[u32; 3]> = indices.iter().copied().filter(is_far).map(bits).collect();
    far.sort_unstable();
    far.dedup();
    if !far.is_empty() && far.len() as f64 <= FEW * indices.len() as f64 {
        indices.retain(|index| !is_far(index));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::random_sphere;
    use glam::DVec3;

    fn left(positions: &[Vec3]) -> Vec<u32> {
        let mut indices = (0..positions.len() as u32).collect();
        leave_out(positions, &mut indices);
        indices
    }

    #[test]
    fn a_few_that_are_far_are_left_out() {
        for away in [1e3, 1e9, 1e30] {
            let mut positions = random_sphere(1000, DVec3::ONE, 1.0, 1);
            positions.extend(random_sphere(40, DVec3::ZERO, away, 2));
            positions.extend([Vec3::splat(2.0 * away as f32); 200]);
            assert_eq!(left(&positions), (0..1000).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn what_is_near_and_many_that_are_far_stay() {
        for (count, away) in [(40, 40.0), (100, 1e9), (500, 1e9)] {
            let mut positions = random_sphere(1000, DVec3::ONE, 1.0, 1);
            positions.extend(random_sphere(count, DVec3::ZERO, away, 2));
            assert_eq!(left(&positions).len(), positions.len());
        }
        assert_eq!(left(&[]), []);
        assert_eq!(left(&[Vec3::ONE, Vec3::ONE, Vec3::X]), [0, 1, 2]);
    }
}
