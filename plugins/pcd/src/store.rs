//! Where encoded points are kept until their number is known: in the file, or in memory.

use crate::encode::widened;
use std::io::{Read, Seek, SeekFrom};
use surfelshop_api::format::{BATCH, FileSink};
use surfelshop_api::prelude::{Job, Result};

/// Points one after the other.
pub(crate) enum Store<'a> {
    /// In the file, from an offset on.
    File { file: &'a FileSink, start: u64, len: u64 },
    /// In memory.
    Memory(Vec<u8>),
}

impl Store<'_> {
    /// Adds points.
    ///
    /// # Errors
    /// Where the system refuses, or memory runs out.
    pub(crate) fn append(&mut self, rows: &[u8]) -> Result<()> {
        match self {
            Self::File { file, start, len } => {
                file.write_at(*start + *len, rows)?;
                *len += rows.len() as u64;
            }
            Self::Memory(bytes) => {
                bytes.try_reserve(rows.len())?;
                bytes.extend_from_slice(rows);
            }
        }
        Ok(())
    }

    /// Gives points of `step` bytes wide positions.
    ///
    /// # Errors
    /// As [`append`](Self::append), and where the user asked to stop.
    pub(crate) fn widen(&mut self, step: usize, job: &Job<'_>) -> Result<()> {
        let mut wide = Vec::new();
        match self {
            Self::Memory(bytes) => {
                wide.try_reserve(bytes.len().saturating_mul(2))?;
                widened(bytes, step, &mut wide);
                *bytes = wide;
            }
            Self::File { file, start, len } => {
                let mut stream = file.stream();
                let (n, mut narrow, mut end) = (*len / step as u64, Vec::new(), 0);
                // From the end on, since points become longer than those that lie before them.
                for chunk in (0..n.div_ceil(BATCH as u64)).rev() {
                    job.check()?;
                    let first = chunk * BATCH as u64;
                    // At most a batch.
                    let count = (n - first).min(BATCH as u64) as usize;
                    narrow.resize(count * step, 0);
                    stream.seek(SeekFrom::Start(*start + first * step as u64))?;
                    stream.read_exact(&mut narrow)?;
                    wide.clear();
                    widened(&narrow, step, &mut wide);
                    let wide_step = (wide.len() / count) as u64;
                    file.write_at(*start + first * wide_step, &wide)?;
                    end = end.max(first * wide_step + wide.len() as u64);
                }
                *len = end;
            }
        }
        Ok(())
    }
}
