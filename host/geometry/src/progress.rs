use rayon::prelude::*;
use std::fmt;
use std::ops::{ControlFlow, Range};

/// Takes how far the work is, in [0, 1], and may ask it to stop; called on the caller's thread.
pub type Progress<'a> = &'a dyn Fn(f64) -> ControlFlow<()>;

/// The caller asked the work to stop; nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cancelled;

impl fmt::Display for Cancelled {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("cancelled")
    }
}

impl std::error::Error for Cancelled {}

/// A [`Progress`] that tells nobody and never stops.
pub fn silent(_: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// A [`Progress`] for a step of a longer job: its [0, 1] is the `range` of the whole.
pub fn part(progress: Progress<'_>, range: Range<f64>) -> impl Fn(f64) -> ControlFlow<()> {
    move |fraction| progress(range.start + fraction * (range.end - range.start))
}

/// Points computed between two questions whether to stop: about 10 ms of work on one core.
const BLOCK: usize = 4096;

/// Computes `compute(0..count)` in parallel, asking `progress` between blocks.
pub(crate) fn map<T: Send>(
    count: usize,
    progress: Progress<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut results = Vec::with_capacity(count);
    let block = BLOCK * rayon::current_num_threads();
    for start in (0..count).step_by(block) {
        tell(progress, start as f64 / count as f64)?;
        let end = (start + block).min(count);
        results.par_extend((start..end).into_par_iter().map(&compute));
    }
    tell(progress, 1.0)?;
    Ok(results)
}

/// Reports `fraction` and turns a wish to stop into an error.
pub(crate) fn tell(progress: Progress<'_>, fraction: f64) -> Result<(), Cancelled> {
    match progress(fraction) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Cancelled),
    }
}
