//! Clouds before all of them are there: some of the points, with what is missing estimated from these alone.
//!
//! A window shows them while a large file is read and while its normals and radii are estimated.

use crate::assemble;
use crate::cloud::source::Source;
use crate::memory::OutOfMemory;
use crate::options::{PreviewSink, ReadOptions};
use crate::table::{Field, Table};
use std::time::{Duration, Instant};

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

/// Every so many-th of `rows` rows: so many that of `n` in all there are at most [`PREVIEW_POINTS`].
pub(crate) fn rows(n: usize, rows: usize) -> Vec<u32> {
    (0..rows as u32).step_by(n.div_ceil(PREVIEW_POINTS).max(1)).collect()
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
