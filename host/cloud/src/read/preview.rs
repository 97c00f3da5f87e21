//! Clouds before all of them are there: some of the points, with what is missing estimated from these alone.
//!
//! A window shows them while a large file is read and while its normals and radii are estimated.

use crate::assemble;
use crate::cloud::source::Source;
use crate::memory::OutOfMemory;
use crate::options::{PreviewSink, ReadOptions};
use crate::table::{Field, Table};
use std::time::{Duration, Instant};
use surfelshop_geometry::hashing::scattered;

/// The most points of a preview. What they lack is estimated in about half a second of two cores.
pub const PREVIEW_POINTS: usize = 100_000;

/// Clouds of fewer times as many points are there soon enough without a preview.
const WORTHWHILE: usize = 3;

/// Time after which the points that were read so far are shown, and then again after some times as long.
const FIRST: Duration = Duration::from_millis(600);
const AGAIN: u32 = 3;

/// Where previews go, and how what is missing is estimated.
#[derive(Clone)]
pub(crate) struct Previews {
    sink: PreviewSink,
    n_neighbours: usize,
    radius: Option<f32>,
    started: Instant,
    due: Duration,
}

impl Previews {
    /// Previews of a file that is read from now on, where somebody wants them.
    pub(crate) fn of(options: &ReadOptions<'_>) -> Option<Self> {
        let sink = options.preview?.clone();
        let ReadOptions { n_neighbours, radius, .. } = *options;
        Some(Self { sink, n_neighbours, radius, started: Instant::now(), due: FIRST })
    }

    /// Whether what was read so far is to be shown, and no sooner again than some times as long from now.
    pub(crate) fn is_due(&mut self) -> bool {
        let elapsed = self.started.elapsed();
        let is_due = elapsed >= self.due;
        if is_due {
            self.due = elapsed.saturating_mul(AGAIN);
        }
        is_due
    }

    /// Shows a table of few points. Where these make no cloud, nothing is shown: the whole file will say why.
    pub(crate) fn show(&self, table: Table, source: Source) {
        let options = ReadOptions {
            n_neighbours: self.n_neighbours,
            radius: self.radius,
            ..ReadOptions::default()
        };
        if let Ok(loaded) = assemble::cloud(table, source, &options) {
            (self.sink)(loaded);
        }
    }

    /// Shows some points of a table that is complete, where estimates for all of them take a while.
    pub(crate) fn show_some(&self, table: &Table, source: &Source, options: &ReadOptions<'_>) {
        let takes_a_while = table.faces.is_empty()
            && assemble::share_of_reading(table.names(), false, options) < 0.5;
        if table.n_rows < WORTHWHILE * PREVIEW_POINTS || !takes_a_while {
            return;
        }
        // Without the memory for a few of them there is no preview; the whole will say so.
        if let Ok(some) = sampled(table) {
            self.show(some, source.clone());
        }
    }
}

/// One of every so many of `rows` rows: so many that of `n` in all there are at most [`PREVIEW_POINTS`]. Which one is drawn
/// by lot, the same each time: files repeat their parts in turn, as a scanner's rings, and every so many-th row would see
/// one of them alone.
pub(crate) fn rows(n: usize, rows: usize) -> Vec<u32> {
    let every = n.div_ceil(PREVIEW_POINTS).max(1);
    let drawn = |first: usize| first + (scattered(first as u64) % every as u64) as usize;
    let all = (0..rows).step_by(every).map(drawn).filter(|row| *row < rows);
    all.map(|row| row as u32).collect()
}

fn sampled(table: &Table) -> Result<Table, OutOfMemory> {
    let rows = rows(table.n_rows, table.n_rows);
    let field = |field: &Field| {
        let values = field.values.gather(field.names.len(), &rows)?;
        Ok(Field { names: field.names.clone(), values })
    };
    Ok(Table {
        format: table.format.clone(),
        element: table.element.clone(),
        n_rows: rows.len(),
        fields: table.fields.iter().map(field).collect::<Result<_, _>>()?,
        ..Table::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_files_have_in_turn_are_all_seen() {
        let n = 48 * PREVIEW_POINTS;
        let drawn = rows(n, n);
        assert!(drawn.len() <= PREVIEW_POINTS && drawn.is_sorted());
        for parts in [2, 3, 48] {
            let mut counts = vec![0; parts];
            drawn.iter().for_each(|row| counts[*row as usize % parts] += 1);
            let even = PREVIEW_POINTS / parts;
            assert!(counts.iter().all(|count| 10 * count > 9 * even), "{parts}: {counts:?}");
        }
        // What is there while a file is read is the beginning of it.
        let first = rows(n, n / 2);
        assert_eq!(first, drawn[..first.len()]);
        assert_eq!(rows(100, 7), [0, 1, 2, 3, 4, 5, 6]);
    }
}
