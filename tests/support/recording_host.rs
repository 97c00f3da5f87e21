//! A host of jobs that takes down what tools do.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use surfelshop_api::Result;
use surfelshop_api::job::{JobHost, RANGE};
use surfelshop_api::tool::EditHeader;

/// A host of jobs whose loops run on rayon's threads, the caller's pool where there is one.
#[derive(Default)]
pub struct RecordingHost {
    /// The edits that were staged, with the bytes of their columns.
    pub staged: Mutex<Vec<(EditHeader, Vec<Vec<u8>>)>>,
    /// Every message with the fraction it came with.
    pub messages: Mutex<Vec<(f64, String)>>,
    /// Ranges of loops that were handed out; the job is cancelled once there are `cancel_after`.
    pub ranges: AtomicUsize,
    /// See `ranges`; never where 0.
    pub cancel_after: usize,
    /// Set once the job was told that it is cancelled.
    pub cancelled: AtomicBool,
}

impl JobHost for RecordingHost {
    fn progress(&self, fraction: f64, message: &str) {
        if !message.is_empty() {
            self.messages.lock().expect("no thread panics").push((fraction, message.to_owned()));
        }
    }

    fn cancelled(&self) -> bool {
        let cancelled =
            self.cancel_after > 0 && self.ranges.load(Ordering::Relaxed) >= self.cancel_after;
        self.cancelled.fetch_or(cancelled, Ordering::Relaxed);
        cancelled
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let values = values.iter().map(|bytes| bytes.to_vec()).collect();
        self.staged.lock().expect("no thread panics").push((header.clone(), values));
        Ok(())
    }

    fn parallel(
        &self,
        count: usize,
        _share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        // From the last on, since a tool must not count on an order.
        (0..count.div_ceil(RANGE)).into_par_iter().rev().all(|range| {
            self.ranges.fetch_add(1, Ordering::Relaxed);
            let start = range * RANGE;
            let goes_on = !self.cancelled();
            if goes_on {
                work(start..(start + RANGE).min(count));
            }
            goes_on
        })
    }
}
