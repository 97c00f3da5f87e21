//! Cubes of space, with those that hold points, and how far each is from the next of them.

use crate::hashing;
use crate::progress::{Cancelled, Progress, part, report};
use glam::{DVec3, Quat, Vec3};
use rayon::prelude::*;

/// Most cubes: what they take is bounded however large the cloud.
const MOST: f64 = 4e6;

/// Points that a cube of the surface has, on average: fewer leave holes.
const FILLED: f64 = 4.0;

/// Share of the points beyond which those at each end of an axis are strays.
const STRAY: f64 = 0.002;

/// Cubes that span the points of a cloud, in a frame whose z is up.
pub(super) struct Cells {
    /// Takes the frame to the scene.
    back: Quat,
    min: DVec3,
    /// Edge of a cube, scene units.
    pub(super) edge: f64,
    pub(super) size: [usize; 3],
    /// Whether a cube holds points; x runs fastest.
    pub(super) filled: Vec<bool>,
}

impl Cells {
    /// Sorts points into cubes, with room of `above` scene units over them. `None` where no position
    /// is finite or all are one.
    pub(super) fn of(
        positions: &[Vec3],
        up: Vec3,
        above: f64,
        progress: Progress<'_>,
    ) -> Result<Option<Self>, Cancelled> {
        report(progress, 0.0)?;
        let turn = Quat::from_rotation_arc(up, Vec3::Z);
        let points: Vec<DVec3> = positions
            .par_iter()
            .filter(|position| position.is_finite())
            .map(|&position| (turn * position).as_dvec3())
            .collect();
        let Some((min, mut max)) = span(&points) else { return Ok(None) };
        max.z += above;
        let size = max - min;
        let least = size.max_element() / 512.0;
        let volume: f64 = size.max(DVec3::splat(least)).to_array().iter().product();
        let mut edge = (volume / MOST).cbrt().max(least);
        let mut cells = Self::empty(turn.inverse(), (min, size), edge);
        for step in 0..4 {
            report(&part(progress, 0.2..1.0), f64::from(step) / 4.0)?;
            cells = Self::empty(turn.inverse(), (min, size), edge);
            let inside = cells.fill(&points);
            let filled = cells.filled.iter().filter(|filled| **filled).count();
            let each = inside as f64 / filled.max(1) as f64;
            // Cubes that span the scan tell nothing.
            let largest = size.max_element() / 16.0;
            if each >= 0.8 * FILLED || edge >= largest {
                break;
            }
            edge = (edge * (FILLED / each).sqrt()).min(largest);
        }
        report(progress, 1.0)?;
        Ok(Some(cells))
    }

    fn empty(back: Quat, (min, size): (DVec3, DVec3), edge: f64) -> Self {
        // A cube more on each side, so that every one of the surface has one beside it.
        let min = min - edge;
        let size = (size / edge).to_array().map(|length| length.ceil() as usize + 2);
        let count = size.iter().product();
        Self { back, min, edge, size, filled: vec![false; count] }
    }

    /// Marks the cubes of points; gives how many points lie within.
    fn fill(&mut self, points: &[DVec3]) -> usize {
        let mut inside = 0;
        for point in points {
            let place = (*point - self.min) / self.edge;
            if place.min_element() < 0.0 {
                continue;
            }
            let [x, y, z] = place.to_array().map(|along| along as usize);
            if x < self.size[0] && y < self.size[1] && z < self.size[2] {
                let index = self.index([x, y, z]);
                self.filled[index] = true;
                inside += 1;
            }
        }
        inside
    }

    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// The middle of a cube, in the scene.
    pub(super) fn middle(&self, place: [usize; 3]) -> Vec3 {
        let middle = DVec3::from_array(place.map(|along| along as f64 + 0.5));
        self.back * (self.min + self.edge * middle).as_vec3()
    }

    /// For each cube the distance of its middle from that of the next one that is filled, in edges.
    ///
    /// Source: Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012: exact,
    /// along one axis after the other.
    pub(super) fn clearances(&self, progress: Progress<'_>) -> Result<Vec<f32>, Cancelled> {
        let far = self.size.iter().map(|&length| length as f32).sum::<f32>().powi(2);
        let mut squared: Vec<f32> =
            self.filled.iter().map(|&filled| if filled { 0.0 } else { far }).collect();
        let [nx, ny, _] = self.size;
        report(progress, 0.1)?;
        squared.par_chunks_mut(nx).for_each(|row| along(row.len(), row, |i| i));
        report(progress, 0.4)?;
        squared.par_chunks_mut(nx * ny).for_each(|layer| {
            for x in 0..nx {
                along(ny, layer, |y| y * nx + x);
            }
        });
        report(progress, 0.7)?;
        // Columns lie across all layers: they are copied out and back.
        let nz = self.size[2];
        let columns: Vec<Vec<f32>> = (0..nx * ny)
            .into_par_iter()
            .map(|column| {
                let mut values: Vec<f32> = (0..nz).map(|z| squared[z * nx * ny + column]).collect();
                along(nz, &mut values, |z| z);
                values
            })
            .collect();
        for (column, values) in columns.iter().enumerate() {
            for (z, value) in values.iter().enumerate() {
                squared[z * nx * ny + column] = value.sqrt();
            }
        }
        report(progress, 1.0)?;
        Ok(squared)
    }
}

/// The squared distance transform of values along a line, in place.
fn along(count: usize, values: &mut [f32], at: impl Fn(usize) -> usize) {
    let line: Vec<f32> = (0..count).map(|i| values[at(i)]).collect();
    // Parabolas of the lower envelope, and from where on each is the lowest.
    let mut lowest: Vec<(usize, f32)> = Vec::with_capacity(count);
    for (i, &value) in line.iter().enumerate() {
        let height = |i: usize, value: f32| value + (i * i) as f32;
        let start = loop {
            let Some(&(j, start)) = lowest.last() else { break f32::NEG_INFINITY };
            let meets = (height(i, value) - height(j, line[j])) / (2 * (i - j)) as f32;
            if meets > start {
                break meets;
            }
            lowest.pop();
        };
        lowest.push((i, start));
    }
    let mut next = 0;
    for i in 0..count {
        while lowest.get(next + 1).is_some_and(|&(_, start)| start < i as f32) {
            next += 1;
        }
        let j = lowest[next].0;
        values[at(i)] = (i.abs_diff(j) * i.abs_diff(j)) as f32 + line[j];
    }
}

/// The box of points without strays; `None` where there are none or all are one.
fn span(points: &[DVec3]) -> Option<(DVec3, DVec3)> {
    const SAMPLES: usize = 20_000;
    let n = points.len();
    let sample = |i: usize| points[((hashing::unit(9, i as u64) * n as f64) as usize).min(n - 1)];
    let samples: Vec<DVec3> = (0..SAMPLES.min(n)).map(sample).collect();
    let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let mut along: Vec<f64> = samples.iter().map(|point| point[axis]).collect();
        along.sort_unstable_by(f64::total_cmp);
        let strays = (along.len() as f64 * STRAY) as usize;
        min[axis] = *along.get(strays)?;
        max[axis] = along[along.len() - 1 - strays];
    }
    // What the samples may have missed.
    let margin = 0.02 * (max - min).max_element();
    (margin > 0.0).then(|| (min - margin, max + margin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::random_sphere;

    #[test]
    fn clearances_are_those_of_a_full_search() {
        let positions = random_sphere(60, DVec3::ZERO, 1.0, 1);
        let cells = Cells::of(&positions, Vec3::Z, 0.5, &silent).unwrap().unwrap();
        let [nx, ny, nz] = cells.size;
        let all = |i: usize| [i % nx, i / nx % ny, i / nx / ny];
        let filled: Vec<[usize; 3]> =
            (0..nx * ny * nz).filter(|&i| cells.filled[i]).map(all).collect();
        assert!(filled.len() > 10, "{}", filled.len());
        let clearances = cells.clearances(&silent).unwrap();
        for (i, &found) in clearances.iter().enumerate() {
            let here = all(i);
            let squared = |a: &[usize; 3]| -> usize {
                a.iter().zip(here).map(|(&a, b)| a.abs_diff(b).pow(2)).sum()
            };
            let expected = filled.iter().map(squared).min().unwrap() as f32;
            assert!((found - expected.sqrt()).abs() < 1e-4, "{found} {expected}");
        }
    }
}
