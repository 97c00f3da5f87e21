//! Clouds before all of them are there: some of the points, with what is missing estimated from these alone.
//!
//! A window shows them while a large file is read and while its normals and radii are estimated.

use crate::assemble;
use crate::cloud::source::Source;
use crate::memory::OutOfMemory;
use crate::options::{PreviewSink, ReadOptions};
use crate::table::{Field, Table};
use std::time::{Duration, Instant};
use surfelshop_geometry::Progress;
use surfelshop_geometry::hashing::scattered;

/// Points of the first preview. What they lack is estimated in about a second of two cores, most of which is for the sides
/// that can be seen.
pub const PREVIEW_POINTS: usize = 100_000;

/// The most points of a later one: more take longer to put in order and to draw than they stay in sight.
const MOST: usize = 2_000_000;

/// A preview of so many times fewer points than the next is worthwhile: less, and the next is there soon enough.
const WORTHWHILE: usize = 3;

/// The second preview of points that are all read has one of so many: it delays the whole by as large a share.
const SECOND: usize = 16;

/// The most points while a file is read: estimates for these end in about two seconds, and nothing ends them sooner.
const MOST_WHILE_READING: usize = 500_000;

/// While a file is read, later previews have as many points as the first one for each so many of its waits that have
/// passed: estimating them takes up to a quarter of that time.
const PASSED: u32 = 4;

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

    /// How many points a preview of what was read so far may have.
    pub(crate) fn n_points(&self) -> usize {
        let passed = self.started.elapsed().as_secs_f64() / (PASSED * FIRST).as_secs_f64();
        ((PREVIEW_POINTS as f64 * passed) as usize).clamp(PREVIEW_POINTS, MOST_WHILE_READING)
    }

    /// Shows a table of few points. Where these make no cloud, nothing is shown: the whole file will say why.
    pub(crate) fn show(&self, table: Table, source: Source, progress: Progress<'_>) {
        let options = ReadOptions {
            n_neighbours: self.n_neighbours,
            radius: self.radius,
            progress,
            ..ReadOptions::default()
        };
        if let Ok(loaded) = assemble::cloud(table, source, &options) {
            (self.sink)(loaded);
        }
    }

    /// Shows some points of a table that is complete, and then more of them, where estimates for all take a while.
    /// `progress` stays where it is and may ask to stop.
    pub(crate) fn show_some(&self, table: &Table, source: &Source, options: &ReadOptions<'_>) {
        let takes_a_while = table.faces.is_empty()
            && assemble::share_of_reading(table.names(), false, options) < 0.5;
        if !takes_a_while {
            return;
        }
        for most in sizes(table.n_rows) {
            // Without the memory for a few of them there is no preview; the whole will say so.
            if let Ok(some) = sampled(table, most) {
                self.show(some, source.clone(), options.progress);
            }
        }
    }
}

/// How many points the previews of so many have that are all read.
fn sizes(n_points: usize) -> impl Iterator<Item = usize> {
    let second = (n_points / SECOND).min(MOST);
    let first = (n_points >= WORTHWHILE * PREVIEW_POINTS).then_some(PREVIEW_POINTS);
    let second = (second >= WORTHWHILE * PREVIEW_POINTS).then_some(second);
    first.into_iter().chain(second)
}

/// One of every so many of `rows` rows: so many that of `n` in all there are at most `most`. Which one is drawn
/// by lot, the same each time: files repeat their parts in turn, as a scanner's rings, and every so many-th row would see
/// one of them alone.
pub(crate) fn rows(n: usize, rows: usize, most: usize) -> Vec<u32> {
    let every = n.div_ceil(most).max(1);
    let drawn = |first: usize| first + (scattered(first as u64) % every as u64) as usize;
    let all = (0..rows).step_by(every).map(drawn).filter(|row| *row < rows);
    all.map(|row| row as u32).collect()
}

fn sampled(table: &Table, most: usize) -> Result<Table, OutOfMemory> {
    let rows = rows(table.n_rows, table.n_rows, most);
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
        let drawn = rows(n, n, PREVIEW_POINTS);
        assert!(drawn.len() <= PREVIEW_POINTS && drawn.is_sorted());
        for parts in [2, 3, 48] {
            let mut counts = vec![0; parts];
            drawn.iter().for_each(|row| counts[*row as usize % parts] += 1);
            let even = PREVIEW_POINTS / parts;
            assert!(counts.iter().all(|count| 10 * count > 9 * even), "{parts}: {counts:?}");
        }
        // What is there while a file is read is the beginning of it.
        let first = rows(n, n / 2, PREVIEW_POINTS);
        assert_eq!(first, drawn[..first.len()]);
        assert_eq!(rows(100, 7, PREVIEW_POINTS), [0, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn the_whole_is_delayed_by_little() {
        let sizes = |n: usize| sizes(n).collect::<Vec<_>>();
        assert!(sizes(200_000).is_empty());
        assert_eq!(sizes(4_000_000), [PREVIEW_POINTS]);
        assert_eq!(sizes(24_000_000), [PREVIEW_POINTS, 1_500_000]);
        assert_eq!(sizes(1 << 30), [PREVIEW_POINTS, MOST]);
    }
}
