//! What was made of columns, found again by their generations.
//!
//! Statistics are small and are held, the last used ones. Columns are held by whoever displays them, and
//! are found here for as long.

use super::histogram::Histogram;
use super::keys::{ColorKey, HistogramKey, RowsKey, ScalarKey, SplatKey};
use super::statistics::CloudStatistics;
use crate::cloud::column::{Column, WeakColumn};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Values by key, the last put ones.
struct Memo<K, V> {
    entries: Mutex<VecDeque<(K, V)>>,
    most: usize,
}

impl<K: PartialEq, V: Clone> Memo<K, V> {
    const fn new(most: usize) -> Self {
        Self { entries: Mutex::new(VecDeque::new()), most }
    }

    fn find(&self, key: &K) -> Option<V> {
        let entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        entries.iter().rev().find(|(own, _)| own == key).map(|(_, value)| value.clone())
    }

    /// Adds a value, and forgets those that do not live any more.
    fn put(&self, key: K, value: V, lives: impl Fn(&V) -> bool) {
        let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        entries.retain(|(own, value)| *own != key && lives(value));
        entries.push_back((key, value));
        while entries.len() > self.most {
            entries.pop_front();
        }
    }
}

static STATISTICS: Memo<ScalarKey, Arc<CloudStatistics>> = Memo::new(256);
static HISTOGRAMS: Memo<HistogramKey, Arc<Histogram>> = Memo::new(64);
static COLORS: Memo<ColorKey, WeakColumn> = Memo::new(1024);
static SPLATS: Memo<SplatKey, WeakColumn> = Memo::new(1024);
static ROWS: Memo<RowsKey, (u64, Weak<[u32]>)> = Memo::new(1024);
static SELECTED: Memo<(u64, u64), WeakColumn> = Memo::new(1 << 16);

/// Statistics that are known, or made and known from then on. No lock is held while they are made: other
/// work may be done on the same thread meanwhile.
pub(super) fn statistics(
    key: ScalarKey,
    make: impl FnOnce() -> Arc<CloudStatistics>,
) -> Arc<CloudStatistics> {
    STATISTICS.find(&key).unwrap_or_else(|| {
        let made = make();
        STATISTICS.put(key, made.clone(), |_| true);
        made
    })
}

/// The same of histograms.
pub(super) fn histogram(
    key: HistogramKey,
    make: impl FnOnce() -> Arc<Histogram>,
) -> Arc<Histogram> {
    HISTOGRAMS.find(&key).unwrap_or_else(|| {
        let made = make();
        HISTOGRAMS.put(key, made.clone(), |_| true);
        made
    })
}

/// The colours of a cloud, where somebody still displays them.
pub(super) fn colors<E>(
    key: ColorKey,
    make: impl FnOnce() -> Result<Column, E>,
) -> Result<Column, E> {
    column(&COLORS, key, make)
}

/// Radii, or which surfels are round splats, where somebody still displays them.
pub(super) fn splats<E>(
    key: SplatKey,
    make: impl FnOnce() -> Result<Column, E>,
) -> Result<Column, E> {
    column(&SPLATS, key, make)
}

/// The rows of a column that filters let through, of those of this number.
pub(super) fn selected<E>(
    generation: u64,
    rows: u64,
    make: impl FnOnce() -> Result<Column, E>,
) -> Result<Column, E> {
    column(&SELECTED, (generation, rows), make)
}

fn column<K: PartialEq, E>(
    memo: &Memo<K, WeakColumn>,
    key: K,
    make: impl FnOnce() -> Result<Column, E>,
) -> Result<Column, E> {
    match memo.find(&key).and_then(|known| known.upgrade()) {
        Some(known) => Ok(known),
        None => {
            let made = make()?;
            memo.put(key, made.downgrade(), WeakColumn::lives);
            Ok(made)
        }
    }
}

/// The number of the next rows.
static NEXT_ROWS: AtomicU64 = AtomicU64::new(1);

/// The rows that filters let through, under a number of their own.
pub(super) fn rows<E>(
    key: RowsKey,
    make: impl FnOnce() -> Result<Arc<[u32]>, E>,
) -> Result<(u64, Arc<[u32]>), E> {
    let known = ROWS.find(&key).and_then(|(number, rows)| Some((number, rows.upgrade()?)));
    match known {
        Some(known) => Ok(known),
        None => {
            let made = make()?;
            let number = NEXT_ROWS.fetch_add(1, Ordering::Relaxed);
            ROWS.put(key, (number, Arc::downgrade(&made)), |(_, rows)| rows.strong_count() > 0);
            Ok((number, made))
        }
    }
}
