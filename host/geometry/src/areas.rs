//! The area that each surfel stands for, without overlap.

use crate::cell;
use crate::neighbours::{Neighbours, SEARCH_SHARE};
use crate::progress::{Cancelled, Progress, map, part};
use glam::Vec3;

/// Neighbours that bound a point's cell. Of a random sampling one cell in a thousand has a corner
/// that a farther point would cut off, by a few percent of its area.
const CELL_NEIGHBOURS: usize = 14;

/// Estimates the area of surface that each position stands for, squared scene units.
///
/// A disc that overlaps its neighbours counts their surface twice; sums over surfels, as for light
/// transfer, need weights that add up to the area of the surface. That of a point is the area of
/// its Voronoi cell in the tangent plane, among the points nearest to it, laid out at their distances
/// in space. At a border the cell reaches half a step beyond the last points. Points on the back of a thin sheet, told by their normals, do not count.
///
/// `normals` are unit vectors, one per position; where they are missing +z is taken. Coincident
/// positions share their cell evenly. Positions that are not finite, and the only distinct
/// position of a cloud, get 0: one point spans no surface. Points on a line get about twice the square
/// of their spacing.
///
/// Source: erratum T21 to Liu 2006, section 4.1: an emitter of area A in eq. 9 to 11 is the
/// *effective* area.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn effective(
    positions: &[Vec3],
    normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let neighbours = Neighbours::build(positions, &part(progress, 0.0..SEARCH_SHARE))?;
    effective_with(&neighbours, normals, &part(progress, SEARCH_SHARE..1.0))
}

/// [`effective`] for a search structure that exists already.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn effective_with(
    neighbours: &Neighbours,
    normals: &[Vec3],
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let n = neighbours.n_distinct();
    let cells = map(n, &part(progress, 0.0..0.98), |place| area(neighbours, normals, place))?;
    let mut copies = vec![0u32; n];
    for place in (0..neighbours.len()).filter_map(|index| neighbours.place_of(index)) {
        copies[place] += 1;
    }
    let unit = neighbours.scale() * neighbours.scale();
    map(neighbours.len(), &part(progress, 0.98..1.0), |index| {
        neighbours.place_of(index).map_or(0.0, |place| {
            let area = cells[place] * unit / f64::from(copies[place]);
            // Areas of clouds beyond 1e19 units overflow; the largest number keeps sums infinite
            // rather than undefined.
            area.min(f64::from(f32::MAX)) as f32
        })
    })
}

/// The area of a point's cell, square units of the box; 0 where there is no other point.
fn area(neighbours: &Neighbours, normals: &[Vec3], place: usize) -> f64 {
    let near = neighbours.around(place, CELL_NEIGHBOURS);
    cell::closed(neighbours, normals, place, &near).area()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::{grid, random_sphere, spiral_sphere};
    use glam::DVec3;

    fn areas(positions: &[Vec3], normals: &[Vec3]) -> Vec<f32> {
        effective(positions, normals, &silent).unwrap()
    }

    fn sum(areas: &[f32]) -> f64 {
        areas.iter().map(|&area| f64::from(area)).sum()
    }

    /// Share of a sphere's area by which the cells may miss it: the chord between neighbours 2 a apart
    /// is shorter than the arc by a^2 / 6, which a thousand points keep below 0.1 %, and so are the
    /// sides of the cells; the rest is corners that a farther point cuts off.
    const SPHERE: f64 = 0.01;

    #[test]
    fn areas_add_up_to_that_of_a_sphere() {
        let even = spiral_sphere(2000, 0.0, 1);
        let uneven = random_sphere(2000, DVec3::ZERO, 1.0, 5);
        for positions in [even, uneven] {
            let areas = areas(&positions, &positions);
            let error = sum(&areas) / (4.0 * std::f64::consts::PI) - 1.0;
            assert!(error.abs() < SPHERE, "{error}");
        }
    }

    #[test]
    fn a_grid_has_equal_areas_up_to_its_border() {
        let positions = grid(12, Vec3::X, Vec3::Y);
        let areas = areas(&positions, &[Vec3::Z; 144]);
        assert!(areas.iter().all(|area| (area - 1.0).abs() < 1e-5), "{areas:?}");
    }

    #[test]
    fn both_sides_of_a_thin_shell_keep_their_areas() {
        let front = grid(12, Vec3::X, Vec3::Y);
        let back = front.iter().map(|&p| p - 0.01 * Vec3::Z);
        let positions: Vec<Vec3> = front.iter().copied().chain(back).collect();
        let normals: Vec<Vec3> =
            (0..288).map(|i| if i < 144 { Vec3::Z } else { -Vec3::Z }).collect();
        let areas = areas(&positions, &normals);
        assert!((sum(&areas) / 288.0 - 1.0).abs() < 1e-3, "{}", sum(&areas));
    }

    #[test]
    fn copies_share_their_cell() {
        let mut positions = grid(9, Vec3::X, Vec3::Y);
        positions.extend([positions[40]; 3]);
        let areas = areas(&positions, &[]);
        for i in [40, 81, 82, 83] {
            assert!((areas[i] - 0.25).abs() < 1e-5, "{}", areas[i]);
        }
    }

    #[test]
    fn areas_hold_at_every_scale() {
        for scale in [1e-15f32, 1.0, 1e15] {
            let positions = grid(5, Vec3::X * scale, Vec3::Y * scale);
            let areas = areas(&positions, &[]);
            assert!(areas.iter().all(|area| (area / (scale * scale) - 1.0).abs() < 1e-4));
        }
    }

    #[test]
    fn what_spans_no_surface_has_no_area_and_what_is_thin_a_finite_one() {
        assert!(areas(&[], &[]).is_empty());
        assert_eq!(areas(&[Vec3::ONE; 3], &[]), [0.0; 3]);
        let odd = [Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::splat(f32::INFINITY)];
        assert_eq!(areas(&odd, &[])[1], 0.0);
        assert_eq!(areas(&odd, &[])[3], 0.0);
        let line: Vec<Vec3> = (0..20).map(|i| Vec3::X * i as f32).collect();
        for area in areas(&line, &[]) {
            assert!((0.5..2.5).contains(&area), "{area}");
        }
        let above: Vec<Vec3> = (0..20).map(|i| Vec3::Z * i as f32).collect();
        assert!(areas(&above, &[]).iter().all(|area| area.is_finite()));
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let positions = random_sphere(3000, DVec3::ZERO, 1.0, 9);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| areas(&positions, &positions))
        };
        assert_eq!(with(1), with(2));
    }
}
