//! Effective areas: what each surfel stands for, without overlap.

use crate::bounds::Bounds;
use crate::cell::{self, BACK_SIDE, Near};
use crate::octree::{Node, Octree};
use crate::progress::{Cancelled, Progress, flat_map, map, part, report};
use glam::{DVec3, Vec3};

/// Neighbours that bound a point's cell. Of a random sampling one cell in a thousand has a corner
/// that a farther point would cut off, by a few percent of its area.
const CELL_NEIGHBOURS: usize = 14;

/// Nearest points that a cell is compared with: the first ring of a square grid.
const COMPARED: usize = 8;

/// A cell larger than this many times the median of those around spans empty space: three times as
/// wide, as for radii.
const OUTLIER: f64 = 9.0;

const NOBODY: u32 = u32::MAX;

/// Most points of a leaf: they look for their neighbours together, so fewer look in vain more often
/// and more have more to look through.
const LEAF: usize = 24;

/// Estimates the area of surface that each position stands for, squared scene units.
///
/// A disc that overlaps its neighbours counts their surface twice; sums over surfels, as for light
/// transfer, need weights that add up to the area of the surface. That of a point is the area of
/// its Voronoi cell in the tangent plane, among the points nearest to it, laid out at their distances
/// in space. At a border the cell reaches half a step beyond the last points.
/// A stray point gets no more than nine times the median of its nearest. Points on the back of a thin sheet, told by their normals, do not count.
///
/// `normals` are unit vectors, one per position; where they are missing +z is taken. Coincident
/// positions of one side share their cell evenly. Positions that are not finite, and the only distinct
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
    let bounds = Bounds::of_positions(positions);
    let bounds = bounds.unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
    // A power of two, so that scaling rounds nothing and equal distances stay equal.
    let extent = bounds.extent();
    let scale = if extent > 0.0 { 2f64.powi(extent.log2().ceil() as i32) } else { 1.0 };
    let boxed = map(positions.len(), &part(progress, 0.0..0.02), |i| {
        (positions[i].as_dvec3() / scale).as_vec3()
    })?;
    let tree = Octree::build(&boxed, LEAF, &part(progress, 0.02..0.1))?;
    let search = Search { positions: &boxed, normals, tree: &tree };
    let leaves = leaves(&tree);
    let found = flat_map(leaves.len(), &part(progress, 0.1..0.9), |i| {
        search.areas(leaves[i].0, leaves[i].1).into_iter()
    })?;
    let mut own = vec![0.0; positions.len()];
    for found in &found {
        own[found.index as usize] = found.area;
    }
    let limited = map(found.len(), &part(progress, 0.9..0.98), |i| found[i].limited(&own))?;
    let mut areas = vec![0.0; positions.len()];
    for (found, area) in found.iter().zip(limited) {
        // Areas of clouds beyond 1e19 units overflow; the largest number keeps sums infinite
        // rather than undefined.
        let share = area * scale * scale / f64::from(found.copies);
        areas[found.index as usize] = share.min(f64::from(f32::MAX)) as f32;
    }
    report(progress, 1.0)?;
    Ok(areas)
}

/// The cell of one point.
#[derive(Clone, Copy)]
struct PointCell {
    index: u32,
    /// The area of the cell at the point's place, squared units of the box.
    area: f64,
    /// Points at this place that face this way.
    copies: u32,
    /// The nearest points at other places.
    nearest: [u32; COMPARED],
}

impl PointCell {
    /// The area, but for cells that span empty space rather than surface: no more than a multiple of
    /// the median around.
    fn limited(&self, areas: &[f64]) -> f64 {
        let near = self.nearest.iter().filter(|&&other| other != NOBODY);
        let mut around: Vec<f64> = near.map(|&other| areas[other as usize]).collect();
        if around.is_empty() {
            return self.area;
        }
        around.sort_unstable_by(f64::total_cmp);
        self.area.min(OUTLIER * around[around.len() / 2])
    }
}

/// The leaves, and how far their points will have to look for neighbours, about.
fn leaves(tree: &Octree) -> Vec<(&Node, f32)> {
    let size = |node: &Node| node.min.distance(node.max);
    let mut around = vec![0.0; tree.nodes().len()];
    let mut leaves = Vec::new();
    for (node, around_it) in tree.nodes().iter().zip(0..) {
        let children = node.children.start as usize..node.children.end as usize;
        around[children].fill(size(node));
        if node.children.is_empty() {
            let around: f32 = around[around_it];
            leaves.push((node, (0.5 * size(node)).max(0.2 * around)));
        }
    }
    leaves
}

/// What the points of a leaf find their neighbours in.
struct Search<'a> {
    /// Scaled to a box of about unit size.
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    tree: &'a Octree,
}

/// The points that the points of a leaf choose their neighbours from.
#[derive(Default)]
struct Candidates {
    indices: Vec<u32>,
    /// Their coordinates, apart, so that several distances are computed at a time.
    coordinates: [Vec<f32>; 3],
    /// Squares of their distances from the last point that asked.
    squared: Vec<f32>,
    /// All that is this close to the leaf's box is among them.
    reach: f32,
    /// Square of the distance within which the next point will find enough, probably.
    usual: f32,
    /// The nearest of the last point that asked: squared distances and indices.
    near: Vec<(f32, u32)>,
}

impl Search<'_> {
    /// The areas of a leaf's points by index, squared units of the box.
    fn areas(&self, leaf: &Node, reach: f32) -> Vec<PointCell> {
        let own = &self.tree.order()[leaf.surfels.start as usize..leaf.surfels.end as usize];
        let mut candidates = Candidates { reach, usual: f32::INFINITY, ..Candidates::default() };
        self.collect(leaf, &mut candidates);
        if leaf.min == leaf.max {
            // They coincide and share the cell of their side, be they two or a million.
            let first = self.normal(own[0]);
            let (front, back): (Vec<u32>, Vec<u32>) =
                own.iter().partition(|&&index| self.normal(index).dot(first) >= BACK_SIDE);
            let sides = [front, back].into_iter().filter(|side| !side.is_empty());
            return sides.flat_map(|side| self.shared(&side, leaf, &mut candidates)).collect();
        }
        let at = |index: u32| self.positions[index as usize];
        let is_copy = |of: u32, other: u32| {
            at(other) == at(of) && self.normal(other).dot(self.normal(of)) >= BACK_SIDE
        };
        own.iter()
            .map(|&index| {
                let mut found = self.cell(index, leaf, &mut candidates);
                found.copies = own.iter().filter(|&&other| is_copy(index, other)).count() as u32;
                found
            })
            .collect()
    }

    /// The cells of points that share one.
    fn shared(&self, side: &[u32], leaf: &Node, candidates: &mut Candidates) -> Vec<PointCell> {
        let cell = self.cell(side[0], leaf, candidates);
        let (area, nearest, copies) = (cell.area, cell.nearest, side.len() as u32);
        side.iter().map(|&index| PointCell { index, area, copies, nearest }).collect()
    }

    /// The cell at the place of a point, which has it to itself.
    fn cell(&self, index: u32, leaf: &Node, candidates: &mut Candidates) -> PointCell {
        let near = self.nearest(index, leaf, candidates);
        let mut found = PointCell { index, area: 0.0, copies: 1, nearest: [NOBODY; COMPARED] };
        if near.is_empty() {
            return found;
        }
        for (slot, &(_, other)) in found.nearest.iter_mut().zip(near) {
            *slot = other;
        }
        let at = |index: u32| self.positions[index as usize];
        let near = near.iter().map(|&(_, other)| {
            let offset = at(other) - at(index);
            Near { offset, distance: offset.length(), normal: self.normal(other) }
        });
        found.area = cell::closed(self.normal(index), near).area();
        found
    }

    fn normal(&self, index: u32) -> Vec3 {
        self.normals.get(index as usize).copied().unwrap_or(Vec3::Z)
    }

    /// Squared distances and indices of the nearest points at other places, nearest first.
    fn nearest<'b>(
        &self,
        index: u32,
        leaf: &Node,
        candidates: &'b mut Candidates,
    ) -> &'b [(f32, u32)] {
        let at = |index: u32| self.positions[index as usize];
        let here = at(index);
        let facing = self.normal(index);
        loop {
            let all = candidates.reach * candidates.reach;
            let Candidates { indices, coordinates: [x, y, z], squared, near, usual, .. } =
                &mut *candidates;
            // Neighbours of neighbours are about as far away; where they are not, all are looked at.
            let within = usual.min(all);
            *usual = f32::INFINITY;
            squared.clear();
            squared.extend(x.iter().zip(&*y).zip(&*z).map(|((x, y), z)| {
                let (x, y, z) = (x - here.x, y - here.y, z - here.z);
                x * x + y * y + z * z
            }));
            near.clear();
            for (&squared, &other) in squared.iter().zip(&*indices) {
                // The back of a thin sheet would take the places of neighbours.
                if squared <= within
                    && at(other) != here
                    && self.normal(other).dot(facing) >= BACK_SIDE
                {
                    near.push((squared, other));
                }
            }
            let order = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            // Only the nearest need sorting; copies among them may hide others, so a few more.
            if near.len() > 2 * CELL_NEIGHBOURS {
                near.select_nth_unstable_by(2 * CELL_NEIGHBOURS, order);
                near.truncate(2 * CELL_NEIGHBOURS);
            }
            near.sort_unstable_by(order);
            near.dedup_by(|a, b| a.0 == b.0 && at(a.1) == at(b.1));
            near.truncate(CELL_NEIGHBOURS);
            if near.len() == CELL_NEIGHBOURS {
                candidates.usual = 1.3 * near[CELL_NEIGHBOURS - 1].0;
                return &candidates.near;
            }
            if within < all {
                continue;
            }
            // The box has about unit size; twice of that reaches everything.
            if candidates.reach > 2.0 {
                return &candidates.near;
            }
            candidates.reach = (1.6 * candidates.reach).max(1e-6);
            self.collect(leaf, candidates);
        }
    }

    /// Finds all points within reach; of those that coincide, one for each side.
    fn collect(&self, leaf: &Node, candidates: &mut Candidates) {
        let Candidates { indices, coordinates, reach, .. } = candidates;
        indices.clear();
        coordinates.iter_mut().for_each(Vec::clear);
        let (mut last, mut side) = (Vec3::NAN, Vec3::ZERO);
        self.tree.leaves_near((leaf.min, leaf.max), *reach, |node| {
            for place in node.surfels.start as usize..node.surfels.end as usize {
                let index = self.tree.order()[place];
                // Copies follow each other, since their keys are equal.
                let (position, normal) = (self.positions[index as usize], self.normal(index));
                if position != last || normal.dot(side) < BACK_SIDE {
                    (last, side) = (position, normal);
                    indices.push(index);
                    for (list, value) in coordinates.iter_mut().zip(position.to_array()) {
                        list.push(value);
                    }
                }
            }
        });
    }
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
    const SPHERE: f64 = 0.005;

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
