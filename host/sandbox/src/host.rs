//! What a module may ask of the host while a call lasts.

use crate::stop::Stop;
use surfelshop_api::CloudView;

/// Takes the points that [`Host::next_batch`] hands over.
pub type BatchTaker<'a> = dyn FnMut(&CloudView<'_>) -> Result<(), Stop> + 'a;

fn not_lent<T>() -> Result<T, String> {
    Err("this call lends no such thing".to_owned())
}

/// What a call lends to a module. Bytes are the module's and may be any; lines of errors go back to it.
pub trait Host {
    /// Takes what the module writes to a channel of the call's sink.
    fn write(&mut self, channel: u32, bytes: &[u8]);

    /// Whether somebody asked to stop.
    fn cancelled(&mut self) -> bool {
        false
    }

    /// Takes the progress of a job, in [0, 1] or any other number, and a message.
    fn progress(&mut self, fraction: f64, message: &[u8]) {
        let _nobody_listens = (fraction, message);
    }

    /// Takes an edit.
    ///
    /// # Errors
    /// Where the call lends no job, or the edit is refused.
    fn stage(&mut self, header: &[u8], values: &[&[u8]]) -> Result<(), String> {
        let _nobody_takes = (header, values);
        not_lent()
    }

    /// Runs a graph on the device, and returns the bytes of these of its buffers.
    ///
    /// # Errors
    /// Where the call lends no job, or the graph is refused.
    fn compute(
        &mut self,
        structure: &[u8],
        data: &[u8],
        buffers: &[u32],
    ) -> Result<Vec<Vec<u8>>, String> {
        let _nobody_runs = (structure, data, buffers);
        not_lent()
    }

    /// The length of the file in bytes.
    fn length(&mut self) -> u64 {
        0
    }

    /// Reads bytes of the file; returns how many.
    ///
    /// # Errors
    /// Where the call lends no file, or it cannot be read.
    fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        let _nothing_read = (offset, buffer);
        not_lent()
    }

    /// Writes bytes of the file.
    ///
    /// # Errors
    /// Where the call lends no file, or it cannot be written.
    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), String> {
        let _nothing_written = (offset, bytes);
        not_lent()
    }

    /// Takes the header of a cloud; returns whether its points are wanted.
    ///
    /// # Errors
    /// Where the call takes no clouds, or the header is refused.
    fn begin(&mut self, header: &[u8]) -> Result<bool, String> {
        let _nobody_takes = header;
        not_lent()
    }

    /// Takes points, a column after another.
    ///
    /// # Errors
    /// As [`begin`](Self::begin).
    fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        let _nobody_takes = columns;
        not_lent()
    }

    /// Takes triangles, three indices each.
    ///
    /// # Errors
    /// As [`begin`](Self::begin).
    fn faces(&mut self, triangles: &[[u32; 3]]) -> Result<(), String> {
        let _nobody_takes = triangles;
        not_lent()
    }

    /// Takes a line for people.
    fn warn(&mut self, line: &[u8]) {
        let _nobody_listens = line;
    }

    /// The header of the next cloud that is to be written; none after the last.
    ///
    /// # Errors
    /// Where the call lends no clouds.
    fn next_cloud(&mut self) -> Result<Option<Vec<u8>>, String> {
        not_lent()
    }

    /// Hands over the next points of that cloud; false after the last.
    ///
    /// # Errors
    /// Where the call lends no clouds, or they cannot be read; within it, where the module cannot take them.
    fn next_batch(&mut self, take: &mut BatchTaker<'_>) -> Result<Result<bool, Stop>, String> {
        let _nothing_taken = take;
        not_lent()
    }
}
