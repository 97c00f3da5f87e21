//! Points that do not belong: how far each is from its neighbours, and how far is too far.

use crate::neighbours::{Neighbours, Scratch};
use crate::progress::{Cancelled, Progress, map_with};

/// Mean distance of each position to its `k` nearest others, scene units; infinite for positions
/// that are not finite, 0 where there is no other point.
///
/// Positions that coincide count once, so that copies do not make a stray point look at home.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn mean_distances(
    neighbours: &Neighbours,
    k: usize,
    progress: Progress<'_>,
) -> Result<Vec<f64>, Cancelled> {
    let means = map_with(neighbours.n_distinct(), progress, Scratch::default, |room, place| {
        let near = neighbours.around_in_order(place, k, room);
        let sum: f64 = near.iter().map(|found| found.distance).sum();
        sum / near.len().max(1) as f64 * neighbours.scale()
    })?;
    let mean = |index| neighbours.place_of(index).map_or(f64::INFINITY, |place| means[place]);
    Ok((0..neighbours.len()).map(mean).collect())
}

/// Whether each position has at least `count` others within `radius`, scene units; coincident ones
/// count once, and positions that are not finite have none.
///
/// # Errors
/// Where `progress` asks to stop.
pub fn accompanied(
    neighbours: &Neighbours,
    count: usize,
    radius: f64,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    let found = map_with(neighbours.n_distinct(), progress, Scratch::default, |room, place| {
        let near = neighbours.around_in_order(place, count, room);
        let is_near = |distance: f64| distance * neighbours.scale() <= radius;
        near.len() >= count && near.last().is_none_or(|found| is_near(found.distance))
    })?;
    let of = |index| neighbours.place_of(index).is_some_and(|place| found[place]);
    Ok((0..neighbours.len()).map(of).collect())
}

/// Location and spread of distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceStatistics {
    /// The middle.
    pub middle: f64,
    /// What a standard deviation is, or stands in for it.
    pub deviation: f64,
}

/// Mean and standard deviation of the values that are finite; zeros where there are none.
#[must_use]
pub fn mean_and_deviation(values: &[f64]) -> DistanceStatistics {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let count = finite().count().max(1) as f64;
    let middle = finite().map(|value| value / count).sum::<f64>();
    // Divided by the largest first: distances of 1e200 have squares, too.
    let most = finite().map(|value| (value - middle).abs()).fold(0.0, f64::max);
    if most == 0.0 {
        return DistanceStatistics { middle, deviation: 0.0 };
    }
    let squares = finite().map(|value| ((value - middle) / most).powi(2) / count).sum::<f64>();
    DistanceStatistics { middle, deviation: most * squares.sqrt() }
}

/// Median absolute deviations per standard deviation of a normal distribution.
const DEVIATIONS: f64 = 1.4826;

/// Median, and 1.4826 times the median distance from it, of the values that are finite: what a few
/// values say, however large, does not change either.
///
/// Where more than half of the values are the same that distance is 0; then the mean distance from
/// the median, times 1.2533, stands in.
///
/// Source: Rousseeuw & Croux, "Alternatives to the Median Absolute Deviation", 1993.
#[must_use]
pub fn median_and_deviation(values: &[f64]) -> DistanceStatistics {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let Some(middle) = median(&mut finite) else {
        return DistanceStatistics { middle: 0.0, deviation: 0.0 };
    };
    finite.iter_mut().for_each(|value| *value = (*value - middle).abs());
    let half = median(&mut finite).unwrap_or(0.0);
    let count = finite.len() as f64;
    let mean = finite.iter().map(|value| value / count).sum::<f64>();
    let deviation = if half > 0.0 { DEVIATIONS * half } else { 1.2533 * mean };
    DistanceStatistics { middle, deviation }
}

/// The median, the upper one of two; `None` of nothing.
fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Share of the middle below which a difference is rounding of positions rather than a deviation:
/// a regular sampling varies by less, at a thousand points along an edge in single precision.
const ROUNDING: f64 = 1e-3;

/// The least deviation that counts, as a share of the middle: nearly all points of a regular
/// sampling have the same distances, and those at its borders and poles, which are up to 1.4 times
/// as far from their nearest, would be many deviations off.
const EVEN: f64 = 0.1;

impl DistanceStatistics {
    /// The largest value that still is usual: `factor` deviations, of at least a tenth of the middle,
    /// above it, and at least a thousandth of it.
    #[must_use]
    pub fn limit(&self, factor: f64) -> f64 {
        let deviation = self.deviation.max(EVEN * self.middle);
        self.middle + (factor * deviation).max(ROUNDING * self.middle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::{Random, grid, random_sphere};
    use glam::{DVec3, Vec3};

    #[test]
    fn distances_and_company_are_those_of_a_full_search() {
        let mut positions = random_sphere(300, DVec3::new(2.0, 0.0, -1.0), 3.0, 4);
        positions.extend([positions[7], Vec3::NAN, Vec3::splat(40.0)]);
        let neighbours = Neighbours::build(&positions, &silent).unwrap();
        let means = mean_distances(&neighbours, 5, &silent).unwrap();
        let company = accompanied(&neighbours, 5, 0.7, &silent).unwrap();
        for (index, position) in positions.iter().enumerate() {
            if !position.is_finite() {
                assert_eq!((means[index], company[index]), (f64::INFINITY, false));
                continue;
            }
            let mut distances: Vec<f64> = positions[..300]
                .iter()
                .chain(&positions[302..])
                .map(|other| other.as_dvec3().distance(position.as_dvec3()))
                .filter(|&distance| distance > 0.0)
                .collect();
            distances.sort_by(f64::total_cmp);
            let mean = distances[..5].iter().sum::<f64>() / 5.0;
            assert!((means[index] - mean).abs() < 1e-12 * mean);
            assert_eq!(company[index], distances[4] <= 0.7, "{index}");
        }
        assert_eq!(means[300], means[7]);
    }

    #[test]
    fn fewer_points_than_asked_for_are_no_harm() {
        for positions in [vec![], vec![Vec3::X], vec![Vec3::X; 9], vec![Vec3::X, Vec3::Y]] {
            let neighbours = Neighbours::build(&positions, &silent).unwrap();
            let means = mean_distances(&neighbours, 50, &silent).unwrap();
            assert!(means.iter().all(|mean| mean.is_finite()));
            let limit = median_and_deviation(&means).limit(2.0);
            assert!(means.iter().all(|&mean| mean <= limit));
            let alone = accompanied(&neighbours, 0, 0.0, &silent).unwrap();
            assert!(alone.iter().all(|&kept| kept));
        }
    }

    #[test]
    fn statistics_are_those_of_known_distributions() {
        let mut random = Random::new(8);
        let mut values: Vec<f64> =
            (0..20_001).map(|_| (0..12).map(|_| random.unit()).sum::<f64>() - 6.0 + 10.0).collect();
        for usual in [mean_and_deviation(&values), median_and_deviation(&values)] {
            assert!((usual.middle - 10.0).abs() < 0.03 && (usual.deviation - 1.0).abs() < 0.03);
        }
        // A tenth of the values far away moves the mean, but not the median.
        values[..2000].fill(1e6);
        values[2000] = f64::INFINITY;
        assert!(mean_and_deviation(&values).deviation > 1e5);
        let usual = median_and_deviation(&values);
        assert!((usual.middle - 10.0).abs() < 0.2 && (usual.deviation - 1.0).abs() < 0.2);
        let wide = mean_and_deviation(&[1e200, 3e200]);
        assert!((wide.deviation / 1e200 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn rounding_of_a_regular_sampling_is_no_deviation() {
        // Positions on a closed ring have the same distances but for rounding.
        let ring: Vec<Vec3> = (0..1000)
            .map(|i| {
                let angle = std::f64::consts::TAU * f64::from(i) / 1000.0;
                DVec3::new(angle.cos(), angle.sin(), 0.0).as_vec3() * 1e3
            })
            .collect();
        let neighbours = Neighbours::build(&ring, &silent).unwrap();
        let means = mean_distances(&neighbours, 4, &silent).unwrap();
        for usual in [mean_and_deviation(&means), median_and_deviation(&means)] {
            assert!(means.iter().all(|&mean| mean <= usual.limit(0.0)));
        }
        let flat = grid(30, Vec3::X, Vec3::Y);
        let neighbours = Neighbours::build(&flat, &silent).unwrap();
        let means = mean_distances(&neighbours, 4, &silent).unwrap();
        assert_eq!(median_and_deviation(&means).middle, 1.0);
        assert!(median_and_deviation(&means).deviation > 0.0, "more than half are the same");
    }
}
