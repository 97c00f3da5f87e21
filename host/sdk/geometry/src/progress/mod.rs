//! Progress of work on several threads, and stopping it.

use rayon::prelude::*;
use std::fmt;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

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

/// Reports `fraction` and turns a wish to stop into an error.
pub(crate) fn report(progress: Progress<'_>, fraction: f64) -> Result<(), Cancelled> {
    match progress(fraction) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(Cancelled),
    }
}

/// Points that each thread computes between two questions whether to stop: a few ms of work. With
/// fewer, waiting for the slowest thread would cost time.
const BLOCK: usize = 1024;

/// Rounds of a serial loop between two questions whether to stop: a few ms where each round waits
/// for memory a few times.
const ROUNDS: usize = 1 << 14;

/// Does `work` on one block of `0..count` after the other, asking `progress` before each and at
/// the end.
fn in_blocks(
    count: usize,
    block: usize,
    progress: Progress<'_>,
    mut work: impl FnMut(Range<usize>),
) -> Result<(), Cancelled> {
    for start in (0..count).step_by(block) {
        report(progress, start as f64 / count as f64)?;
        work(start..(start + block).min(count));
    }
    report(progress, 1.0)
}

/// Does `work(0)` to `work(count - 1)` in this order, asking `progress` in between.
pub(crate) fn each(
    count: usize,
    progress: Progress<'_>,
    mut work: impl FnMut(usize),
) -> Result<(), Cancelled> {
    in_blocks(count, ROUNDS, progress, |block| block.for_each(&mut work))
}

/// Computes `compute(0..count)` in parallel, asking `progress` in between.
pub(crate) fn map<T: Send>(
    count: usize,
    progress: Progress<'_>,
    compute: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    map_with(count, progress, || (), |(), index| compute(index))
}

/// [`map`] with something that each thread makes for itself and uses again, such as room.
pub(crate) fn map_with<R, T: Send>(
    count: usize,
    progress: Progress<'_>,
    make: impl Fn() -> R + Sync,
    compute: impl Fn(&mut R, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    map_blocks(count, BLOCK, progress, make, compute)
}

/// [`map_with`] for runs of work that each take about as long as a block of points. The results are taken in the order
/// of the runs as they come, so that no more than a few of them are in memory.
pub(crate) fn take_runs<R, T: Send>(
    count: usize,
    progress: Progress<'_>,
    make: impl Fn() -> R + Sync,
    compute: impl Fn(&mut R, usize) -> T + Sync,
    mut take: impl FnMut(T),
) -> Result<(), Cancelled> {
    in_blocks(count, rayon::current_num_threads(), progress, |range| {
        let computed: Vec<T> = range.into_par_iter().map_init(&make, &compute).collect();
        computed.into_iter().for_each(&mut take);
    })
}

/// [`map_with`], where each thread does so many between two questions whether to stop.
fn map_blocks<R, T: Send>(
    count: usize,
    block: usize,
    progress: Progress<'_>,
    make: impl Fn() -> R + Sync,
    compute: impl Fn(&mut R, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let mut results = Vec::with_capacity(count);
    in_blocks(count, block * rayon::current_num_threads(), progress, |range| {
        let computed = range.into_par_iter().with_min_len((block / 8).max(1));
        results.par_extend(computed.map_init(&make, &compute));
    })?;
    Ok(results)
}

/// [`map`] for any number of results each, all in one row.
pub(crate) fn flat_map<I: Iterator<Item: Send>>(
    count: usize,
    progress: Progress<'_>,
    compute: impl Fn(usize) -> I + Sync,
) -> Result<Vec<I::Item>, Cancelled> {
    let mut results = Vec::new();
    in_blocks(count, BLOCK * rayon::current_num_threads(), progress, |block| {
        results.par_extend(block.into_par_iter().flat_map_iter(&compute));
    })?;
    Ok(results)
}

/// Values sorted between two questions whether to stop, about.
const SORTED: usize = 1 << 18;

/// Sorts in parallel, asking `progress` in between; values that are equal are the same. The result
/// comes in pieces, which spares memory for a second copy of all.
///
/// Values drawn from the whole row bound the pieces, so that they have about the same size.
pub(crate) fn sort<T: Ord + Copy + Send + Sync>(
    mut values: Vec<T>,
    progress: Progress<'_>,
) -> Result<Vec<Vec<T>>, Cancelled> {
    const DRAWN: usize = 32;
    let count = values.len();
    let n_pieces = count.div_ceil(SORTED);
    // Multiples of the golden ratio fall evenly, and not into step with rows of a grid.
    let draw = |i: usize| {
        let share = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        values[((u128::from(share) * count as u128) >> 64) as usize]
    };
    let mut drawn: Vec<T> = (0..n_pieces * DRAWN).map(draw).collect();
    drawn.sort_unstable();
    let bounds: Vec<T> = drawn.into_iter().step_by(DRAWN).skip(1).collect();
    let spread = |values: &[T]| -> Vec<Vec<T>> {
        let room = 2 * values.len() / n_pieces;
        let mut pieces: Vec<_> = (0..n_pieces).map(|_| Vec::with_capacity(room)).collect();
        for &value in values {
            pieces[bounds.partition_point(|&bound| bound <= value)].push(value);
        }
        pieces
    };
    let mut pieces = vec![Vec::new(); n_pieces];
    while !values.is_empty() {
        report(progress, 0.4 * (1.0 - values.len() as f64 / count as f64))?;
        let rest = values.len().saturating_sub(4 * SORTED);
        let found: Vec<_> = values[rest..].par_chunks(SORTED / 8).map(spread).collect();
        for found in found {
            for (piece, mut found) in pieces.iter_mut().zip(found) {
                piece.append(&mut found);
            }
        }
        values.truncate(rest);
        values.shrink_to_fit();
    }
    for (i, piece) in pieces.iter_mut().enumerate() {
        report(progress, 0.4 + 0.6 * i as f64 / n_pieces as f64)?;
        piece.par_sort_unstable();
    }
    report(progress, 1.0)?;
    Ok(pieces)
}

/// Time between two questions whether to stop while work is done aside.
const PULSE: Duration = Duration::from_millis(50);

/// Scratch for calls within calls, of which only what is used becomes memory: hierarchies that others
/// build may be as deep as there are points, where many of them all but coincide.
const STACK: usize = 512 << 20;

/// Does work that tells nothing of itself on a thread of its own, asking `progress` meanwhile. The
/// fractions reported follow the time it `usually` takes.
///
/// Where `progress` asks to stop, the work is left behind: it ends by itself and its result is
/// dropped. It must not need this thread, as work for rayon does where this is the pool's only one.
/// Without a thread it is done here, as it is in a WebAssembly module, which has neither threads nor a clock.
pub(crate) fn aside<T: Send + 'static>(
    progress: Progress<'_>,
    usually: Duration,
    work: impl Fn() -> T + Send + Sync + 'static,
) -> Result<T, Cancelled> {
    report(progress, 0.0)?;
    if cfg!(target_family = "wasm") {
        let result = work();
        report(progress, 1.0)?;
        return Ok(result);
    }
    let started = Instant::now();
    let work = Arc::new(work);
    let (sender, receiver) = sync_channel(1);
    let theirs = Arc::clone(&work);
    // Nobody listens any more where the work was left behind. Should the thread not start, the
    // sender is gone at once.
    let thread = thread::Builder::new().stack_size(STACK);
    drop(thread.spawn(move || drop(sender.send(theirs()))));
    loop {
        match receiver.recv_timeout(PULSE) {
            Ok(result) => {
                report(progress, 1.0)?;
                return Ok(result);
            }
            Err(RecvTimeoutError::Timeout) => {
                // Always rises, however long it takes.
                let late = started.elapsed().as_secs_f64() / usually.as_secs_f64().max(1e-3);
                report(progress, 1.0 - (-late).exp())?;
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(work()),
        }
    }
}

#[cfg(test)]
mod tests;
