//! Which surfels of a column have other values than those of the column that it was made of.
//!
//! Whoever holds what was made of the former, such as a copy on a device, changes that of these surfels alone.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Most columns whose changes are known, the last made ones.
const MOST: usize = 256;

/// Most surfels of a change, and of all that are known: 16 MiB of numbers.
const MOST_ROWS: usize = 1 << 22;

/// Most columns between two.
const MOST_STEPS: usize = 64;

struct Change {
    from: u64,
    to: u64,
    rows: Arc<[u32]>,
}

static CHANGES: Mutex<VecDeque<Change>> = Mutex::new(VecDeque::new());

/// Notes that a column was made of another one, by their generations, and differs in these surfels alone.
pub(crate) fn note(from: u64, to: u64, rows: Arc<[u32]>) {
    if rows.len() > MOST_ROWS {
        return;
    }
    let mut changes = CHANGES.lock().unwrap_or_else(PoisonError::into_inner);
    changes.push_back(Change { from, to, rows });
    let mut n_rows: usize = changes.iter().map(|change| change.rows.len()).sum();
    while changes.len() > MOST || n_rows > MOST_ROWS {
        n_rows -= changes.pop_front().map_or(0, |change| change.rows.len());
    }
}

/// The surfels in which two columns may differ, by the columns' generations, ascending; `None` where nobody knows.
/// Their other surfels are equal, and they have equally many.
#[must_use]
pub fn changed_rows(one: u64, other: u64) -> Option<Vec<u32>> {
    let changes = CHANGES.lock().unwrap_or_else(PoisonError::into_inner);
    // From each column to what it was made of, the newest first.
    let line = |generation: u64| {
        let mut line = vec![(generation, None)];
        while let (Some((last, _)), true) = (line.last(), line.len() <= MOST_STEPS) {
            let Some(change) = changes.iter().rev().find(|change| change.to == *last) else {
                break;
            };
            line.push((change.from, Some(Arc::clone(&change.rows))));
        }
        line
    };
    let (ones, others) = (line(one), line(other));
    let place = |generation: u64| others.iter().position(|(other, _)| *other == generation);
    let mut places = ones.iter().enumerate().map(|(i, (generation, _))| (i, place(*generation)));
    let (i, j) = places.find_map(|(i, j)| Some((i, j?)))?;
    let steps = ones[..=i].iter().chain(&others[..=j]).filter_map(|(_, rows)| rows.as_ref());
    let mut rows: Vec<u32> = steps.flat_map(|rows| rows.iter().copied()).collect();
    rows.sort_unstable();
    rows.dedup();
    Some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_found_along_what_columns_were_made_of() {
        // Numbers that no column of other tests has.
        let of = |n: u64| u64::MAX - n;
        note(of(0), of(1), [3, 5].into());
        note(of(1), of(2), [5, 9].into());
        note(of(0), of(3), [1].into());
        assert_eq!(changed_rows(of(0), of(2)), Some(vec![3, 5, 9]));
        assert_eq!(changed_rows(of(2), of(0)), Some(vec![3, 5, 9]));
        assert_eq!(changed_rows(of(2), of(1)), Some(vec![5, 9]));
        assert_eq!(changed_rows(of(3), of(2)), Some(vec![1, 3, 5, 9]));
        assert_eq!(changed_rows(of(2), of(2)), Some(vec![]));
        assert_eq!(changed_rows(of(2), of(4)), None);
    }
}
