//! Handing points over: parts of a file are decoded in parallel, and go to the host in order.

use crate::decode::Columns;
use crate::layout::Layout;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::format::{BATCH, CloudSink};
use surfelshop_api::{Error, Job, Result};

/// Bytes that decoded columns take at once.
const MEMORY: u64 = 1 << 28;
/// Most parts that are decoded at once.
const MOST_PARTS: usize = 32;

/// Where points go, and how many went.
pub(crate) struct Points<'a, 's> {
    pub(crate) layout: &'a Layout,
    pub(crate) clouds: &'a mut CloudSink<'s>,
    pub(crate) job: &'a Job<'a>,
    /// Points that there are to read; the most there can be where that is not known.
    pub(crate) expected: u64,
    /// Points that were handed over.
    pub(crate) n_read: u64,
    /// What was wrong first.
    pub(crate) fault: Option<String>,
}

/// A part of a file while it is decoded.
pub(crate) struct Part<'a> {
    /// Bytes of the file.
    pub(crate) bytes: Vec<u8>,
    /// Records of it.
    pub(crate) records: Vec<u8>,
    pub(crate) columns: Columns<'a>,
    /// What was wrong first.
    pub(crate) fault: Option<String>,
    result: Result<()>,
}

impl Part<'_> {
    /// Makes the bytes so many, whatever they are.
    ///
    /// # Errors
    /// Where there is no memory for them.
    pub(crate) fn reach(bytes: &mut Vec<u8>, len: usize) -> Result<()> {
        bytes.try_reserve(len.saturating_sub(bytes.len()))?;
        bytes.resize(len, 0);
        Ok(())
    }
}

impl<'a> Points<'a, '_> {
    /// An empty part.
    pub(crate) fn part(&self) -> Part<'a> {
        let (bytes, records, fault) = Default::default();
        Part { bytes, records, columns: Columns::new(self.layout), fault, result: Ok(()) }
    }

    /// Decodes parts of a file of so many points each with `decode`, in parallel, and hands them over in order.
    ///
    /// # Errors
    /// Where `decode` or the host says so, or the user asked to stop.
    pub(crate) fn decode_all(
        &mut self,
        sizes: &[u64],
        decode: impl Fn(usize, &mut Part<'a>) -> Result<()> + Sync,
    ) -> Result<()> {
        let largest = sizes.iter().copied().max().unwrap_or(0).max(1);
        let bytes = largest.saturating_mul(self.layout.point_bytes().max(1) as u64);
        let n_threads = std::thread::available_parallelism().map_or(2, usize::from);
        let most = usize::try_from(MEMORY / bytes.max(1)).unwrap_or(MOST_PARTS);
        let n_parts = (2 * n_threads).min(MOST_PARTS).min(most).clamp(1, sizes.len().max(1));
        let parts: Vec<_> = (0..n_parts).map(|_| Mutex::new(self.part())).collect();
        for (round, sizes) in sizes.chunks(n_parts).enumerate() {
            let share = self.share(sizes.iter().sum());
            self.job.each_piece(sizes.len(), share, |i| {
                let mut part = parts[i].lock().unwrap_or_else(PoisonError::into_inner);
                part.columns.clear();
                part.result = decode(round * n_parts + i, &mut part);
            })?;
            for part in &parts[..sizes.len()] {
                let mut part = part.lock().unwrap_or_else(PoisonError::into_inner);
                std::mem::replace(&mut part.result, Ok(()))?;
                self.hand_over(&mut part)?;
            }
        }
        Ok(())
    }

    /// Hands over the points of a part and takes them out of it.
    ///
    /// # Errors
    /// As [`CloudSink::batch`], or where the user asked to stop.
    pub(crate) fn hand_over(&mut self, part: &mut Part<'_>) -> Result<()> {
        self.job.check()?;
        self.fault = self.fault.take().or_else(|| part.fault.take());
        part.columns.hand_over(self.clouds)?;
        self.n_read += part.columns.n_rows() as u64;
        part.columns.clear();
        Ok(())
    }

    /// Hands over a batch of a part that is decoded by itself, and says how far the reading is.
    ///
    /// # Errors
    /// As [`hand_over`](Self::hand_over).
    pub(crate) fn hand_over_batch(&mut self, part: &mut Part<'_>) -> Result<()> {
        self.hand_over(part)?;
        self.job.progress(self.share(0).start, "");
        Ok(())
    }

    /// The progress that so many more points make.
    fn share(&self, n: u64) -> Range<f64> {
        let all = self.expected.max(1) as f64;
        let part = |n: u64| (n as f64 / all).min(1.0);
        part(self.n_read)..part(self.n_read.saturating_add(n))
    }

    /// Ends the reading: says how many points are missing of so many that there should be.
    ///
    /// # Errors
    /// Where there is not a single one.
    pub(crate) fn finish(self, expected: Option<u64>) -> Result<()> {
        let expected = expected.unwrap_or(self.n_read);
        let missing = expected.saturating_sub(self.n_read);
        let why = self.fault.map(|fault| format!(": {fault}")).unwrap_or_default();
        if expected > 0 && self.n_read == 0 {
            return Err(Error::new(format!("none of {expected} points can be read{why}")));
        }
        if missing > 0 {
            let n_read = self.n_read;
            self.clouds.warn(&format!("{n_read} of {expected} points were read{why}"));
        }
        Ok(())
    }
}

/// Divides so many points into parts of a batch each; the last may have fewer.
pub(crate) fn batches(n: u64) -> Vec<u64> {
    let batch = BATCH as u64;
    (0..n.div_ceil(batch)).map(|i| batch.min(n - i * batch)).collect()
}
