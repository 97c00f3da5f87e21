//! What the host does for a format at work.

use super::watch::{Watch, cancelled};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use surfelshop_api::job::{JobHost, RANGE};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Error, Result};

/// As much as the format's own thread has; plugins may count on it.
const STACK_BYTES: usize = 8 << 20;

/// The host's side of a call on a format.
pub(super) struct FormatJob {
    watch: Arc<Watch>,
    /// Threads of this call alone, so that a loop that never ends takes none of the program's.
    pool: std::sync::OnceLock<Option<rayon::ThreadPool>>,
}

impl FormatJob {
    pub(super) fn new(watch: Arc<Watch>) -> Self {
        Self { watch, pool: std::sync::OnceLock::new() }
    }

    /// The threads of loops; `None` where the system gives none.
    fn pool(&self) -> Option<&rayon::ThreadPool> {
        let made = self.pool.get_or_init(|| {
            let builder = rayon::ThreadPoolBuilder::new()
                .stack_size(STACK_BYTES)
                .thread_name(|i| format!("format loop {i}"));
            match builder.build() {
                Ok(pool) => Some(pool),
                Err(error) => {
                    tracing::warn!(%error, "a format's loops run on its own thread");
                    None
                }
            }
        });
        made.as_ref()
    }
}

impl JobHost for FormatJob {
    fn progress(&self, fraction: f64, _message: &str) {
        self.watch.set(fraction);
        self.watch.sign();
    }

    fn cancelled(&self) -> bool {
        self.watch.check().is_err()
    }

    fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
        Err(Error::new("a format stages no edits"))
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        // Formats divide files into few large parts: each is a range of its own.
        let size = if count < RANGE * RANGE { 1 } else { RANGE };
        let (watch, n_done, all) = (&*self.watch, AtomicUsize::new(0), AtomicBool::new(true));
        let one = |i: usize| {
            if watch.check().is_err() {
                all.store(false, Ordering::Relaxed);
                return;
            }
            let range = i * size..((i + 1) * size).min(count);
            let len = range.len();
            work(range);
            let n_done = n_done.fetch_add(len, Ordering::Relaxed) + len;
            // A share that does not move tells nothing of how far the work is.
            if share.end > share.start {
                watch.set(share.start + (share.end - share.start) * n_done as f64 / count as f64);
            }
            watch.sign();
        };
        let n_ranges = count.div_ceil(size);
        match self.pool() {
            Some(pool) => pool.install(|| (0..n_ranges).into_par_iter().for_each(one)),
            None => (0..n_ranges).for_each(one),
        }
        all.into_inner()
    }

    fn compute(
        &self,
        _graph: &surfelshop_api::abi::EncodedGraph,
        _buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>> {
        Err(if self.watch.is_cancelled() {
            cancelled()
        } else {
            Error::new("a format has no device")
        })
    }
}
