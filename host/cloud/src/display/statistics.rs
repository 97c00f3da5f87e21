//! What is known of an attribute as a whole: its ends, percentiles, histogram and categories.
//!
//! Numbers of a column are looked through once for each of its generations.

use super::cache;
use super::error::DisplayError;
use super::scalar::Scalar;
use super::settings::{Attribute, whole};
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Most different whole numbers that count as categories.
pub const MOST_CATEGORIES: usize = 1024;

/// Most numbers that percentiles are taken of, so that they are exact up to a million.
const SAMPLE: usize = 1 << 20;

/// Steps between the lowest and the highest number for which percentiles are kept.
const STEPS: usize = 10_000;

/// What is known of the numbers of one cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CloudStatistics {
    n_finite: u64,
    n_nan: u64,
    /// Least and largest finite number.
    ends: Option<[f64; 2]>,
    least_positive: Option<f64>,
    /// Finite numbers at each ten-thousandth of all, lowest first; empty where there are none.
    quantiles: Vec<f64>,
    /// How often each whole number occurs; `None` where there are others, or too many.
    categories: Option<BTreeMap<i64, u64>>,
    is_integer: bool,
}

/// What is known of an attribute of several clouds together.
#[derive(Clone, Debug)]
pub struct Statistics {
    attribute: Attribute,
    parts: Vec<Arc<CloudStatistics>>,
}

impl Statistics {
    /// Looks through an attribute of all these clouds; those that lack it do not count.
    ///
    /// # Errors
    /// Where a column has fewer components. An attribute that no cloud has gives statistics of nothing.
    pub fn of(clouds: &[&Cloud], attribute: &Attribute, up: Axis) -> Result<Self, DisplayError> {
        let mut parts = Vec::with_capacity(clouds.len());
        for cloud in clouds {
            if let Some(scalar) = Scalar::of(cloud, attribute, up)? {
                parts.push(of_cloud(&scalar));
            }
        }
        Ok(Self { attribute: attribute.clone(), parts })
    }

    /// The attribute.
    #[must_use]
    pub fn attribute(&self) -> &Attribute {
        &self.attribute
    }

    /// Clouds that have it.
    #[must_use]
    pub fn n_clouds(&self) -> usize {
        self.parts.len()
    }

    /// Finite numbers.
    #[must_use]
    pub fn n_finite(&self) -> u64 {
        self.parts.iter().map(|part| part.n_finite).sum()
    }

    /// Numbers that are NaN.
    #[must_use]
    pub fn n_nan(&self) -> u64 {
        self.parts.iter().map(|part| part.n_nan).sum()
    }

    /// The least and the largest finite number; `None` without any.
    #[must_use]
    pub fn ends(&self) -> Option<[f64; 2]> {
        let ends = self.parts.iter().filter_map(|part| part.ends);
        ends.reduce(|[low, high], [least, most]| [low.min(least), high.max(most)])
    }

    /// The least number above 0; `None` without any.
    #[must_use]
    pub fn least_positive(&self) -> Option<f64> {
        self.parts.iter().filter_map(|part| part.least_positive).reduce(f64::min)
    }

    /// Whether all clouds store whole numbers.
    #[must_use]
    pub fn is_integer(&self) -> bool {
        self.parts.iter().all(|part| part.is_integer)
    }

    /// The number below which so many percent of the finite ones lie, on a line between the two nearest
    /// ranks; `None` without any. Of more than a million numbers of a cloud it is that of a fixed sample,
    /// and of several clouds it is a hundredth of a percent off at most.
    #[must_use]
    pub fn percentile(&self, percent: f64) -> Option<f64> {
        let share = (percent / 100.0).clamp(0.0, 1.0);
        let mut parts = self.parts.iter().filter(|part| !part.quantiles.is_empty());
        let first = parts.next()?;
        let rest: Vec<_> = parts.collect();
        if rest.is_empty() {
            return Some(between(&first.quantiles, share));
        }
        let mut weighted = Vec::with_capacity((rest.len() + 1) * (STEPS + 1));
        for part in std::iter::once(first).chain(rest) {
            let weight = part.n_finite as f64 / part.quantiles.len() as f64;
            weighted.extend(part.quantiles.iter().map(|&value| (value, weight)));
        }
        weighted.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let below = share * self.n_finite() as f64;
        let mut sum = 0.0;
        let found = weighted.iter().find(|(_, weight)| {
            sum += weight;
            sum >= below
        });
        found.or(weighted.last()).map(|(value, _)| *value)
    }

    /// How often each whole number occurs; `None` where there are others, or more than [`MOST_CATEGORIES`]
    /// different ones, or none at all.
    #[must_use]
    pub fn categories(&self) -> Option<BTreeMap<i64, u64>> {
        let mut all = BTreeMap::new();
        for part in &self.parts {
            for (value, n) in part.categories.as_ref()? {
                *all.entry(*value).or_default() += n;
            }
        }
        (!all.is_empty() && all.len() <= MOST_CATEGORIES).then_some(all)
    }
}

/// The number at a share of a sorted list, on a line between the two nearest.
fn between(sorted: &[f64], share: f64) -> f64 {
    let at = share * (sorted.len() - 1) as f64;
    let (below, part) = (at.floor() as usize, at.fract());
    let low = sorted[below.min(sorted.len() - 1)];
    let high = sorted[(below + 1).min(sorted.len() - 1)];
    // Equal to both where they are equal, whatever the share.
    if part > 0.0 && low < high { low * (1.0 - part) + high * part } else { low }
}

fn of_cloud(scalar: &Scalar<'_>) -> Arc<CloudStatistics> {
    cache::statistics(scalar.key(), || Arc::new(look_through(scalar)))
}

fn look_through(scalar: &Scalar<'_>) -> CloudStatistics {
    let Pass { n_finite, n_nan, ends, least_positive, categories } =
        scalar.fold(Pass::default, Pass::add, Pass::merge);
    CloudStatistics {
        n_finite,
        n_nan,
        ends: (ends[0] <= ends[1]).then_some(ends),
        least_positive: Some(least_positive).filter(|least| least.is_finite()),
        quantiles: quantiles(scalar),
        categories: categories.and_then(Counts::all),
        is_integer: scalar.is_integer(),
    }
}

/// Finite numbers at each step of all.
fn quantiles(scalar: &Scalar<'_>) -> Vec<f64> {
    let (n, n_taken) = (scalar.len(), scalar.len().min(SAMPLE));
    let first_of = |run: usize| (run as u128 * n as u128 / n_taken.max(1) as u128) as usize;
    let taken = (0..n_taken).into_par_iter().map(|run| {
        let (first, next) = (first_of(run), first_of(run + 1));
        // One of each run, not always at the same place: scans have rows. Of runs of one it is that one.
        let hash = (run as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 32;
        scalar.value(first + hash as usize % (next - first).max(1))
    });
    let mut sorted: Vec<f64> = taken.filter(|value| value.is_finite()).collect();
    if sorted.is_empty() {
        return sorted;
    }
    sorted.par_sort_unstable_by(f64::total_cmp);
    (0..=STEPS).map(|step| between(&sorted, step as f64 / STEPS as f64)).collect()
}

/// What one look at each number tells.
struct Pass {
    n_finite: u64,
    n_nan: u64,
    ends: [f64; 2],
    least_positive: f64,
    categories: Option<Counts>,
}

impl Default for Pass {
    fn default() -> Self {
        let ends = [f64::INFINITY, f64::NEG_INFINITY];
        let categories = Some(Counts::default());
        Self { n_finite: 0, n_nan: 0, ends, least_positive: f64::INFINITY, categories }
    }
}

impl Pass {
    fn add(&mut self, numbers: &[f64]) {
        for &number in numbers {
            if !number.is_finite() {
                self.n_nan += u64::from(number.is_nan());
                continue;
            }
            self.n_finite += 1;
            self.ends = [self.ends[0].min(number), self.ends[1].max(number)];
            if number > 0.0 {
                self.least_positive = self.least_positive.min(number);
            }
            if self.categories.as_mut().is_some_and(|counts| !counts.add(number)) {
                self.categories = None;
            }
        }
    }

    fn merge(self, other: Self) -> Self {
        let [low, high] = self.ends;
        Self {
            n_finite: self.n_finite + other.n_finite,
            n_nan: self.n_nan + other.n_nan,
            ends: [low.min(other.ends[0]), high.max(other.ends[1])],
            least_positive: self.least_positive.min(other.least_positive),
            categories: self.categories.zip(other.categories).and_then(|(a, b)| a.merge(b)),
        }
    }
}

/// Whole numbers that are counted in a list and not in a map: those of nearly all categories.
const LISTED: std::ops::Range<i64> = -64..1024;

/// How often whole numbers occur.
#[derive(Default)]
struct Counts {
    /// Of [`LISTED`]; empty before the first.
    listed: Vec<u64>,
    others: HashMap<i64, u64>,
}

impl Counts {
    /// Counts a number; whether it is a whole one, and there are few enough.
    fn add(&mut self, number: f64) -> bool {
        whole(number).is_some_and(|whole| self.count(whole, 1))
    }

    /// Counts a number; whether there are few enough.
    fn count(&mut self, whole: i64, n: u64) -> bool {
        if LISTED.contains(&whole) {
            if self.listed.is_empty() {
                self.listed = vec![0; (LISTED.end - LISTED.start) as usize];
            }
            self.listed[(whole - LISTED.start) as usize] += n;
            return true;
        }
        *self.others.entry(whole).or_default() += n;
        self.others.len() <= MOST_CATEGORIES
    }

    fn merge(mut self, other: Self) -> Option<Self> {
        other.all()?.into_iter().all(|(value, n)| self.count(value, n)).then_some(self)
    }

    /// All that occur; `None` where they are too many.
    fn all(self) -> Option<BTreeMap<i64, u64>> {
        let listed = LISTED.zip(self.listed).filter(|(_, n)| *n > 0);
        let all: BTreeMap<i64, u64> = listed.chain(self.others).collect();
        (all.len() <= MOST_CATEGORIES).then_some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{column_of, floats};
    use super::*;
    use crate::cloud::buffer::Buffer;

    fn statistics(clouds: &[&Cloud]) -> Statistics {
        Statistics::of(clouds, &Attribute::column("a"), Axis::PlusY).unwrap()
    }

    /// Numbers in no order, each once.
    fn shuffled(n: usize) -> Vec<f64> {
        (0..n).map(|i| (i * 7919 % n) as f64).collect()
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_numbers() {
        let numbers = shuffled(10_007);
        let cloud = floats(&numbers);
        let found = statistics(&[&cloud]);
        for percent in [0.0, 0.01, 2.0, 12.34, 50.0, 97.5, 100.0] {
            let expected = percent / 100.0 * 10_006.0;
            let percentile = found.percentile(percent).unwrap();
            assert!((percentile - expected).abs() < 1e-8, "{percent}: {percentile} {expected}");
        }
        assert_eq!(found.ends(), Some([0.0, 10_006.0]));
        assert_eq!(found.least_positive(), Some(1.0));
    }

    #[test]
    fn percentiles_of_many_numbers_and_of_several_clouds_are_near() {
        let n = SAMPLE + 12_345;
        let cloud = floats(&shuffled(n));
        let found = statistics(&[&cloud]).percentile(30.0).unwrap();
        // Ranks of a sample of one in each run: far less than a run of ten thousand.
        assert!((found / n as f64 - 0.3).abs() < 2e-3, "{found}");
        // Two thirds of the numbers are in one, a third in the other.
        let (low, high) = (floats(&shuffled(2000)), floats(&[5000.0; 1000]));
        let together = statistics(&[&low, &high]);
        let third = together.percentile(100.0 / 3.0).unwrap();
        assert!((third - 1000.0).abs() < 2.0, "{third}");
        assert_eq!((together.percentile(80.0), together.n_finite()), (Some(5000.0), 3000));
        assert_eq!(together.percentile(0.0), Some(0.0));
    }

    #[test]
    fn what_is_not_finite_does_not_count() {
        let cloud = floats(&[f64::NAN, 3.0, f64::INFINITY, 1.0, f64::NEG_INFINITY, 2.0]);
        let found = statistics(&[&cloud]);
        assert_eq!((found.n_finite(), found.n_nan(), found.ends()), (3, 1, Some([1.0, 3.0])));
        assert_eq!(found.percentile(50.0), Some(2.0));
        let none = statistics(&[&floats(&[f64::NAN])]);
        assert_eq!((none.ends(), none.percentile(50.0), none.categories()), (None, None, None));
        assert_eq!(statistics(&[]).n_clouds(), 0);
    }

    #[test]
    fn categories_are_counted_where_there_are_few_whole_numbers() {
        let labels = column_of(Buffer::I16(vec![2, -1, 2, 2000, 6, 2]));
        let found = statistics(&[&labels, &floats(&[6.0, 6.0])]);
        let expected = BTreeMap::from([(-1, 1), (2, 3), (6, 3), (2000, 1)]);
        assert_eq!(found.categories(), Some(expected));
        assert!(!found.is_integer() && statistics(&[&labels]).is_integer());
        assert_eq!(statistics(&[&floats(&[1.0, 1.5])]).categories(), None);
        let many = |n: usize| column_of(Buffer::U32((0..n as u32).map(|i| i * 5000).collect()));
        assert!(statistics(&[&many(MOST_CATEGORIES)]).categories().is_some());
        assert_eq!(statistics(&[&many(MOST_CATEGORIES + 1)]).categories(), None);
    }

    #[test]
    fn one_column_is_looked_through_once() {
        let cloud = floats(&[1.0, 2.0]);
        let [a, b] = [statistics(&[&cloud]), statistics(&[&cloud.clone()])];
        assert!(Arc::ptr_eq(&a.parts[0], &b.parts[0]));
    }
}
