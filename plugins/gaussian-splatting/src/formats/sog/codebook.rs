//! Few numbers that stand for many: 256 of a codebook, and the entries of a palette.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use surfelshop_api::prelude::{Job, Result};

/// Numbers of a codebook.
pub(super) const CODES: usize = 256;

/// How often codes are moved to the middle of the numbers that they stand for.
const ROUNDS: usize = 12;

/// The codes of these finite numbers, from the least to the most: the numbers themselves where there are no more of
/// them, else such that the squares of what they are off by are small.
pub(super) fn codes_of(mut numbers: Vec<f32>) -> Vec<f32> {
    numbers.sort_unstable_by(f32::total_cmp);
    let mut codes = numbers.clone();
    codes.dedup();
    if codes.len() <= CODES {
        let last = codes.last().copied().unwrap_or(0.0);
        codes.resize(CODES, last);
        return codes;
    }
    let [least, most] = [numbers[0], numbers[numbers.len() - 1]].map(f64::from);
    // Between evenly many numbers and even steps, so that few numbers far out have codes, too.
    let share = |i: usize| (i as f64 + 0.5) / CODES as f64;
    let quantile = |i: usize| f64::from(numbers[(share(i) * numbers.len() as f64) as usize]);
    let mut middles: Vec<f64> =
        (0..CODES).map(|i| 0.5 * (quantile(i) + least + (most - least) * share(i))).collect();
    for _ in 0..ROUNDS {
        let mut first = 0;
        for i in 0..CODES {
            let end = match middles.get(i + 1) {
                Some(next) => {
                    let border = 0.5 * (middles[i] + next);
                    first + numbers[first..].partition_point(|number| f64::from(*number) < border)
                }
                None => numbers.len(),
            };
            if end > first {
                let sum: f64 = numbers[first..end].iter().copied().map(f64::from).sum();
                middles[i] = sum / (end - first) as f64;
            }
            first = end;
        }
    }
    middles.into_iter().map(|middle| middle as f32).collect()
}

/// The code that is nearest to a number.
pub(super) fn nearest(codes: &[f32], number: f32) -> u8 {
    let above = codes.partition_point(|code| *code < number).min(codes.len() - 1);
    let below = above.saturating_sub(1);
    let is_below = (number - codes[below]).abs() <= (codes[above] - number).abs();
    u8::try_from(if is_below { below } else { above }).unwrap_or(u8::MAX)
}

/// Entries of a palette, one behind the other, and which of them each row has.
#[derive(Debug, Default)]
pub(super) struct Entries {
    pub(super) values: Vec<f32>,
    pub(super) labels: Vec<u16>,
    /// Whether rows that differ share one.
    pub(super) is_shared: bool,
}

/// Rows that share an entry.
struct Group {
    /// The squares of what they are off by.
    error: f64,
    first: usize,
    n: usize,
    /// Where they differ most, and their mean there.
    widest: usize,
    mean: f64,
}

impl PartialEq for Group {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Group {}

impl PartialOrd for Group {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Group {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then_with(|| other.first.cmp(&self.first))
    }
}

impl Group {
    fn of(rows: &[u32], values: &[f32], width: usize, first: usize) -> Self {
        let n = rows.len() as f64;
        let (mut sums, mut squares) = (vec![0.0; width], vec![0.0; width]);
        let start = rows.first().map_or(0, |row| *row as usize * width);
        for row in rows {
            let own = &values[*row as usize * width..][..width];
            for (k, value) in own.iter().enumerate() {
                // From the first, so that equal rows differ by nothing.
                let apart = f64::from(*value) - f64::from(values[start + k]);
                sums[k] += apart;
                squares[k] += apart * apart;
            }
        }
        let errors =
            sums.iter().zip(&squares).map(|(sum, square)| (square - sum * sum / n).max(0.0));
        let errors: Vec<f64> = errors.collect();
        let widest = (0..width).max_by(|a, b| errors[*a].total_cmp(&errors[*b])).unwrap_or(0);
        let mean = f64::from(values[start + widest]) + sums[widest] / n;
        Self { error: errors.iter().sum(), first, n: rows.len(), widest, mean }
    }
}

/// At most so many entries for rows of so many finite values: the rows themselves where there are no more different
/// ones, else the means of groups, of which the most different one is divided next.
///
/// # Errors
/// Where there is no memory, or the user asked to stop.
pub(super) fn palette(values: &[f32], width: usize, most: usize, job: &Job<'_>) -> Result<Entries> {
    let n = values.len() / width;
    if n == 0 {
        return Ok(Entries::default());
    }
    let mut rows: Vec<u32> = Vec::new();
    rows.try_reserve_exact(n)?;
    rows.extend(0..u32::try_from(n)?);
    let mut groups = BinaryHeap::from([Group::of(&rows, values, width, 0)]);
    while groups.len() < most {
        let Some(Group { error, first, n, widest, mean }) = groups.pop() else { break };
        let own = &mut rows[first..first + n];
        let is_below = |row: &u32| f64::from(values[*row as usize * width + widest]) < mean;
        let n_below = partition(own, is_below);
        if error <= 0.0 || n_below == 0 || n_below == n {
            groups.push(Group { error: 0.0, first, n, widest, mean });
            // Then no rows of others differ either.
            if error <= 0.0 {
                break;
            }
            continue;
        }
        let (below, above) = own.split_at(n_below);
        groups.push(Group::of(below, values, width, first));
        groups.push(Group::of(above, values, width, first + n_below));
        if groups.len().is_multiple_of(1024) {
            job.check()?;
        }
    }
    let mut entries = Entries::default();
    entries.labels.try_reserve_exact(n)?;
    entries.labels.resize(n, 0);
    entries.values.try_reserve_exact(groups.len() * width)?;
    for (label, group) in groups.into_iter().enumerate() {
        entries.is_shared |= group.error > 0.0;
        let own = &rows[group.first..group.first + group.n];
        for row in own {
            entries.labels[*row as usize] = label as u16;
        }
        entries.values.extend((0..width).map(|k| mean_of(own, values, width, k)));
    }
    Ok(entries)
}

fn mean_of(rows: &[u32], values: &[f32], width: usize, k: usize) -> f32 {
    let value = |row: &u32| f64::from(values[*row as usize * width + k]);
    let first = rows.first().map_or(0.0, value);
    let apart: f64 = rows.iter().map(|row| value(row) - first).sum();
    (first + apart / rows.len().max(1) as f64) as f32
}

/// Brings what is chosen to the front; how many that are.
fn partition(rows: &mut [u32], is_chosen: impl Fn(&u32) -> bool) -> usize {
    let mut n_chosen = 0;
    for i in 0..rows.len() {
        if is_chosen(&rows[i]) {
            rows.swap(i, n_chosen);
            n_chosen += 1;
        }
    }
    n_chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::HOST;

    #[test]
    fn few_numbers_are_their_own_codes_and_many_are_near_one() {
        let few = codes_of(vec![2.0, -1.0, 2.0, 0.5]);
        assert_eq!((few.len(), &few[..3]), (CODES, &[-1.0, 0.5, 2.0][..]));
        assert_eq!(
            [-9.0, 0.5, 0.6, 9.0].map(|number| few[usize::from(nearest(&few, number))]),
            [-1.0, 0.5, 0.5, 2.0]
        );
        let many: Vec<f32> = (0..20_000).map(|i| (i as f32 * 0.37).sin().powi(3) * 4.0).collect();
        let codes = codes_of(many.clone());
        assert!(codes.is_sorted());
        let even: Vec<f32> = (0..CODES).map(|i| (i as f32 + 0.5) / 32.0 - 4.0).collect();
        let off = |codes: &[f32]| -> f32 {
            let off = many.iter().map(|one| (codes[usize::from(nearest(codes, *one))] - one).abs());
            off.sum()
        };
        // 0.82 of what even steps are off by; 0.81 were the least.
        assert!(off(&codes) < 0.85 * off(&even), "{} {}", off(&codes), off(&even));
        assert_eq!(codes_of(Vec::new()), [0.0; CODES]);
    }

    #[test]
    fn rows_share_entries_only_where_there_are_too_many() {
        let job = Job::new(&HOST);
        let values: Vec<f32> = (0..600).map(|i| (i / 2 % 50) as f32).collect();
        let all = palette(&values, 2, 1 << 16, &job).unwrap();
        assert_eq!(all.values.len(), 100);
        let row = |entries: &Entries, i: usize| {
            let label = usize::from(entries.labels[i]);
            [entries.values[2 * label], entries.values[2 * label + 1]]
        };
        assert!((0..300).all(|i| row(&all, i) == [values[2 * i], values[2 * i + 1]]));
        let few = palette(&values, 2, 10, &job).unwrap();
        assert_eq!((few.values.len(), few.is_shared, all.is_shared), (20, true, false));
        assert!((0..300).all(|i| (row(&few, i)[0] - values[2 * i]).abs() <= 7.0));
        assert_eq!(palette(&[], 3, 9, &job).unwrap().labels.len(), 0);
    }
}
