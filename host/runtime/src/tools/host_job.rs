//! What the host does for a running tool.

use super::ToolOptions;
use super::device::ToolDevice;
use super::progress::Shared;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::{OnceCell, RefCell};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::job::{CANCELLED, JobHost, RANGE};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{Error, Result};
use surfelshop_cloud::{Cloud, StagedEdits};

/// As much as the tool's own thread has; plugins may count on it.
const STACK_BYTES: usize = 8 << 20;

/// The host's side of a run, on the tool's thread.
pub(super) struct HostJob {
    shared: Arc<Shared>,
    staged: RefCell<StagedEdits>,
    options: ToolOptions,
    /// Whether the tool is a sandboxed plugin's.
    is_sandboxed: bool,
    /// Threads of this run alone, so that a loop that never ends takes none of the program's.
    pool: OnceCell<Option<ThreadPool>>,
    /// Opened when the tool asks, and closed with the run.
    device: RefCell<Option<Box<dyn ToolDevice>>>,
}

impl HostJob {
    /// The desk of an instance that is made and about to run.
    pub(super) fn new(
        shared: Arc<Shared>,
        cloud: Cloud,
        (options, is_sandboxed): (ToolOptions, bool),
    ) -> Self {
        shared.begin();
        Self {
            shared,
            staged: RefCell::new(StagedEdits::new(cloud)),
            options,
            is_sandboxed,
            pool: OnceCell::new(),
            device: RefCell::new(None),
        }
    }

    /// Notes that the tool has returned.
    pub(super) fn end(&self) {
        self.shared.end();
    }

    /// What the tool staged.
    pub(super) fn into_staged(self) -> StagedEdits {
        self.staged.into_inner()
    }

    /// The threads of loops; `None` where the system gives none.
    fn pool(&self) -> Option<&ThreadPool> {
        let made = self.pool.get_or_init(|| {
            let builder = ThreadPoolBuilder::new()
                .num_threads(self.options.threads)
                .stack_size(STACK_BYTES)
                .thread_name(|i| format!("plugin loop {i}"));
            match builder.build() {
                Ok(pool) => Some(pool),
                Err(error) => {
                    tracing::warn!(%error, "a tool's loops run on its own thread");
                    None
                }
            }
        });
        made.as_ref()
    }

    fn open(&self) -> Result<Box<dyn ToolDevice>> {
        let device = self.options.device.open()?;
        self.shared.set_device(device.describe());
        Ok(device)
    }
}

impl JobHost for HostJob {
    fn progress(&self, fraction: f64, message: &str) {
        self.shared.set(fraction);
        self.shared.say(fraction, message);
    }

    fn cancelled(&self) -> bool {
        self.shared.is_cancelled()
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let staged = self.staged.borrow_mut().stage(header, values);
        staged.map_err(|error| Error::new(error.to_string()))
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        let (shared, n_done) = (&*self.shared, AtomicUsize::new(0));
        let all = AtomicBool::new(true);
        let one = |i: usize| {
            if shared.is_cancelled() {
                all.store(false, Ordering::Relaxed);
                return;
            }
            let start = i * RANGE;
            let range = start..(start + RANGE).min(count);
            let len = range.len();
            work(range);
            let n_done = n_done.fetch_add(len, Ordering::Relaxed) + len;
            shared.raise(share.start + (share.end - share.start) * n_done as f64 / count as f64);
        };
        shared.set(share.start);
        let n_ranges = count.div_ceil(RANGE);
        match self.pool() {
            Some(pool) => pool.install(|| (0..n_ranges).into_par_iter().for_each(one)),
            None => (0..n_ranges).for_each(one),
        }
        all.into_inner()
    }

    fn compute(&self, graph: &EncodedGraph, buffers: &[u32]) -> Result<Vec<Vec<u8>>> {
        if self.cancelled() {
            return Err(Error::new(CANCELLED));
        }
        let mut device = self.device.borrow_mut();
        let device = match &mut *device {
            Some(device) => device,
            None => device.insert(self.open()?),
        };
        device.compute(graph, buffers, self.is_sandboxed)
    }
}
