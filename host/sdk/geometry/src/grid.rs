//! Points sorted into cubes, for what lies within a distance.

use crate::bounds::Bounds;
use crate::progress::{Cancelled, Progress, flat_map, part, sort};
use glam::DVec3;
use std::ops::Range;

/// The cube that a point lies in, in the order x, y, z; cubes beyond 2^32 of them count as the last.
pub(crate) type Cube = [u32; 3];

/// Points in the order of their cubes.
pub(crate) struct Grid {
    min: DVec3,
    edge: f64,
    /// Cube and index of each point, sorted.
    sorted: Vec<(Cube, u32)>,
    /// Points in this order, so that neighbours lie side by side in memory.
    points: Vec<DVec3>,
}

impl Grid {
    /// Sorts points that are finite into cubes of this edge, which is above 0. Others are left out.
    pub(crate) fn build(
        points: &[DVec3],
        edge: f64,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let bounds = Bounds::of(points.iter().copied());
        let min = bounds.map_or(DVec3::ZERO, |bounds| bounds.min);
        let keys = flat_map(points.len(), &part(progress, 0.0..0.2), |index| {
            let index = u32::try_from(index).ok().filter(|_| points[index].is_finite());
            index.map(|index| (cube(points[index as usize], min, edge), index)).into_iter()
        })?;
        let mut sorted = Vec::with_capacity(keys.len());
        for mut piece in sort(keys, &part(progress, 0.2..1.0))? {
            sorted.append(&mut piece);
        }
        let points = sorted.iter().map(|&(_, index)| points[index as usize]).collect();
        Ok(Self { min, edge, sorted, points })
    }

    /// The runs of indices, in ascending order, of points that share a cube.
    pub(crate) fn cubes(&self) -> impl Iterator<Item = &[(Cube, u32)]> {
        self.sorted.chunk_by(|a, b| a.0 == b.0)
    }

    /// Calls `take` with the index and the squared distance of each point that is at most `distance`
    /// away, which is at most the edge; always in the same order.
    pub(crate) fn near(&self, point: DVec3, distance: f64, mut take: impl FnMut(u32, f64)) {
        let limit = distance * distance;
        self.around(self.cube_of(point), |index, other| {
            let squared = other.distance_squared(point);
            if squared <= limit {
                take(index, squared);
            }
        });
    }

    /// The cube of a point.
    pub(crate) fn cube_of(&self, point: DVec3) -> Cube {
        cube(point, self.min, self.edge)
    }

    /// Calls `take` with the index and the place of each point in a cube and in those that touch it: all that are
    /// at most an edge away from any point of the cube; always in the same order.
    pub(crate) fn around(&self, [x, y, z]: Cube, mut take: impl FnMut(u32, DVec3)) {
        let around = |place: u32| place.saturating_sub(1)..=place.saturating_add(1);
        for x in around(x) {
            for y in around(y) {
                for place in self.row(x, y, z) {
                    take(self.sorted[place].1, self.points[place]);
                }
            }
        }
    }

    /// The places of the points in three cubes side by side along z.
    fn row(&self, x: u32, y: u32, z: u32) -> Range<usize> {
        let start = self.sorted.partition_point(|(cube, _)| *cube < [x, y, z.saturating_sub(1)]);
        let last = [x, y, z.saturating_add(1)];
        let run = self.sorted[start..].iter().take_while(|(cube, _)| *cube <= last);
        start..start + run.count()
    }
}

/// The cube of a point. Casts saturate, so that points beyond the last cube lie in it.
fn cube(point: DVec3, min: DVec3, edge: f64) -> Cube {
    ((point - min) / edge).to_array().map(|place| place as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::Random;

    #[test]
    fn what_is_near_is_what_a_full_search_finds() {
        let mut random = Random::new(3);
        let mut points: Vec<DVec3> = (0..500).map(|_| random.in_ball() * 3.0).collect();
        points.extend([DVec3::NAN, points[3], DVec3::splat(1e12)]);
        for distance in [0.01, 0.3, 10.0] {
            let grid = Grid::build(&points, distance, &silent).unwrap();
            for point in points.iter().filter(|point| point.is_finite()) {
                let mut found = Vec::new();
                grid.near(*point, distance, |index, _| found.push(index));
                found.sort_unstable();
                let is_near = |other: &DVec3| other.distance(*point) <= distance;
                let expected: Vec<u32> =
                    (0..points.len() as u32).filter(|&i| is_near(&points[i as usize])).collect();
                assert_eq!(found, expected);
            }
        }
    }
}
