//! Reading what a file holds, with its progress.

use crate::error::ReadFault;
use std::io::Read;
use surfelshop_geometry::Progress;

/// What is left of a file after its header, if it has one; knows how much that is.
pub(crate) struct Body<R> {
    pub(crate) reader: R,
    /// Bytes left, as the file's length says.
    pub(crate) remaining: u64,
    total: u64,
}

impl<R: Read> Read for Body<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n_read = self.reader.read(buffer)?;
        self.remaining = self.remaining.saturating_sub(n_read as u64);
        Ok(n_read)
    }
}

impl<R> Body<R> {
    /// What is left of a file where that is `length` bytes.
    pub(crate) fn new(reader: R, length: u64) -> Self {
        Self { reader, remaining: length, total: length }
    }

    /// Reports how much of the body is read, and asks whether to go on.
    pub(crate) fn report(&self, progress: Progress<'_>) -> Result<(), ReadFault> {
        let done = 1.0 - self.remaining as f64 / self.total.max(1) as f64;
        if progress(done.clamp(0.0, 1.0)).is_break() {
            return Err(ReadFault::Cancelled);
        }
        Ok(())
    }
}
