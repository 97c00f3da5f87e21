//! Points far apart from the rest: they say nothing of it, but would make its box so large that all others lie in one
//! place of it.

use crate::Bounds;
use crate::bounds::are_few;
use glam::Vec3;

/// Removes the indices of strays. Of rooms and bodies that were tried some turn when a box is 1000 times as large as they
/// are.
pub(super) fn leave_out(positions: &[Vec3], indices: &mut Vec<u32>) {
    let at = |index: u32| positions[index as usize].as_dvec3();
    let Some(near) = Bounds::surroundings(indices.len(), |i| at(indices[i])) else { return };
    let is_far = |index: &u32| !near.holds(at(*index));
    let bits = |index: u32| (positions[index as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let far: Vec<[u32; 3]> = indices.iter().copied().filter(is_far).map(bits).collect();
    if !far.is_empty() && are_few(far, indices.len()) {
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
