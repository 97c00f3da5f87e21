//! Coordinates that have few values: depths of a device that measures them in steps, wider ones far away.
//!
//! Points of one step lie in a plane as exactly as can be, and that plane says nothing of the surface.

use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, map, part, sort};
use glam::DVec3;

/// Points for each value of a coordinate from which on it counts as measured in steps.
const CROWD: usize = 64;

/// Fewest points of which that is asked.
const FEWEST: usize = 4096;

/// The values of the coordinates that are measured in steps, in ascending order, units of the search.
pub(super) struct Steps {
    axes: [Vec<f32>; 3],
}

impl Steps {
    pub(super) fn of(neighbours: &Neighbours, progress: Progress<'_>) -> Result<Self, Cancelled> {
        let mut axes = [const { Vec::new() }; 3];
        if neighbours.n_distinct() >= FEWEST {
            for (axis, values) in axes.iter_mut().enumerate() {
                let share = |axis: usize| axis as f64 / 3.0;
                *values =
                    values_of(neighbours, axis, &part(progress, share(axis)..share(axis + 1)))?;
            }
        }
        Ok(Self { axes })
    }

    /// The widest step at a point, units of the search; 0 where there is none.
    pub(super) fn at(&self, point: DVec3) -> f64 {
        let step = |(values, coordinate): (&Vec<f32>, f64)| {
            let place = values.partition_point(|value| f64::from(*value) < coordinate);
            // Before the first there is none: a range that wraps round is empty.
            let gap = |low: usize| match values.get(low..low.wrapping_add(2)) {
                Some([low, high]) => f64::from(high - low),
                _ => f64::INFINITY,
            };
            // The narrower one: beyond the other another surface may begin.
            let narrower = gap(place.wrapping_sub(1)).min(gap(place));
            if narrower.is_finite() { narrower } else { 0.0 }
        };
        self.axes.iter().zip(point.to_array()).map(step).fold(0.0, f64::max)
    }
}

/// The values that a coordinate has, where these are few; no more than a sample is sorted where they are not.
fn values_of(
    neighbours: &Neighbours,
    axis: usize,
    progress: Progress<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let n = neighbours.n_distinct();
    let bits = |place: usize| ordered(neighbours.point(place)[axis] as f32);
    let mut sample: Vec<u32> = (0..n).step_by((n / FEWEST).max(1)).map(bits).collect();
    sample.sort_unstable();
    sample.dedup();
    // What has few values has them in a sample, too.
    if sample.len() > FEWEST / 4 {
        return Ok(Vec::new());
    }
    let all = map(n, &part(progress, 0.0..0.3), bits)?;
    let mut values: Vec<u32> = Vec::new();
    for piece in sort(all, &part(progress, 0.3..1.0))? {
        values.extend(piece.chunk_by(|a, b| a == b).filter_map(|run| run.first()));
    }
    values.dedup();
    let are_few = values.len() <= n / CROWD;
    Ok(if are_few { values.into_iter().map(number).collect() } else { Vec::new() })
}

/// Bits that are in the order of the numbers.
fn ordered(number: f32) -> u32 {
    let bits = number.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// The number of such bits.
fn number(ordered: u32) -> f32 {
    f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::silent;
    use glam::Vec3;

    #[test]
    fn steps_are_found_where_coordinates_have_few_values() {
        let point = |i: usize, step: f32| {
            let (x, y) = ((i % 100) as f32 + 0.001 * i as f32, (i / 100) as f32 * 1.01);
            let z = 0.3 * x;
            Vec3::new(
                x,
                y + 1e-3 * (i as f32).sin(),
                if step > 0.0 { (z / step).floor() * step } else { z },
            )
        };
        for step in [0.0, 5.0] {
            let positions: Vec<Vec3> = (0..10_000).map(|i| point(i, step)).collect();
            let neighbours = Neighbours::build(&positions, &silent).unwrap();
            let steps = Steps::of(&neighbours, &silent).unwrap();
            let found = steps.at(neighbours.point(5000)) * neighbours.scale();
            assert!((found - f64::from(step)).abs() < 1e-3, "{step} {found}");
        }
    }

    #[test]
    fn bits_are_in_the_order_of_numbers() {
        let numbers = [-f32::MAX, -1.0, -1e-30, 0.0, 1e-30, 2.0, f32::MAX];
        assert!(numbers.windows(2).all(|pair| ordered(pair[0]) < ordered(pair[1])));
        assert!(numbers.iter().all(|&value| number(ordered(value)) == value));
    }
}
