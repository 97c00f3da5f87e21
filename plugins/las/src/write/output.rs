//! Where records go: into a file as they are, or compressed in chunks.

use super::plan::Plan;
use laz::laszip::{ChunkTable, ChunkTableEntry};
use laz::record::{
    LayeredPointRecordCompressor, RecordCompressor as _, SequentialPointRecordCompressor,
};
use laz::{LazVlr, LazVlrBuilder};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use surfelshop_api::format::FileSink;
use surfelshop_api::{Job, Result};

/// Points of a chunk, as most writers have it.
const CHUNK: usize = 50_000;
/// Most bytes of records that wait for their turn.
const WAITING: usize = 1 << 27;

/// Records on their way into a file.
pub(super) struct Output<'a> {
    file: &'a FileSink,
    job: &'a Job<'a>,
    /// Where the next bytes go.
    at: u64,
    /// Records that were not written yet.
    pub(super) records: Vec<u8>,
    record_len: usize,
    compression: Option<Compression>,
}

/// Points that are compressed.
struct Compression {
    vlr: LazVlr,
    table: ChunkTable,
    /// Where the place of the table goes.
    start: u64,
    is_layered: bool,
    /// Chunks that are compressed at once.
    n_parts: usize,
}

/// How the records of a plan are compressed.
///
/// # Errors
/// Where there is no way to.
pub(super) fn laszip(plan: &Plan) -> Result<LazVlr> {
    let extra = u16::try_from(plan.record_len - plan.format.len)?;
    let builder = LazVlrBuilder::default().with_point_format(plan.format.id, extra)?;
    Ok(builder.with_fixed_chunk_size(CHUNK as u32).build())
}

impl<'a> Output<'a> {
    /// Records that go to `at` of a file; compressed, where it is said how.
    pub(super) fn new(
        file: &'a FileSink,
        job: &'a Job<'a>,
        at: u64,
        plan: &Plan,
        vlr: Option<LazVlr>,
    ) -> Self {
        let n_threads = std::thread::available_parallelism().map_or(2, usize::from);
        let most = (WAITING / (CHUNK * plan.record_len)).max(1);
        let is_layered = plan.format.is_extended();
        let compression = vlr.map(|vlr| Compression {
            vlr,
            table: ChunkTable::default(),
            start: at,
            is_layered,
            n_parts: (2 * n_threads).min(most),
        });
        let at = if compression.is_some() { at + ChunkTable::OFFSET_SIZE as u64 } else { at };
        Self { file, job, at, records: Vec::new(), record_len: plan.record_len, compression }
    }

    /// Writes records that wait, where there are enough of them. Progress goes over `share`.
    ///
    /// # Errors
    /// Where the system refuses, or the user asked to stop.
    pub(super) fn flush(&mut self, share: Range<f64>) -> Result<()> {
        self.job.check()?;
        match &self.compression {
            None => self.write_records(),
            Some(compression) => {
                let round = compression.n_parts * CHUNK * self.record_len;
                while self.records.len() >= round {
                    self.compress(round, share.clone())?;
                }
                Ok(())
            }
        }
    }

    /// Writes what is left, and what follows the points; returns where the file ends.
    ///
    /// # Errors
    /// As [`flush`](Self::flush).
    pub(super) fn finish(mut self) -> Result<()> {
        self.flush(0.99..0.99)?;
        let left = self.records.len();
        if left > 0 {
            self.compress(left, 0.99..1.0)?;
        }
        if let Some(compression) = &self.compression {
            let mut table = Vec::new();
            compression.table.write_to(&mut table, &compression.vlr)?;
            self.file.write_at(self.at, &table)?;
            self.file.write_at(compression.start, &self.at.to_le_bytes())?;
        }
        Ok(())
    }

    fn write_records(&mut self) -> Result<()> {
        self.file.write_at(self.at, &self.records)?;
        self.at += self.records.len() as u64;
        self.records.clear();
        Ok(())
    }

    /// Compresses and writes the first bytes that wait, in chunks.
    fn compress(&mut self, len: usize, share: Range<f64>) -> Result<()> {
        let Some(compression) = &mut self.compression else { return Ok(()) };
        let chunks: Vec<&[u8]> = self.records[..len].chunks(CHUNK * self.record_len).collect();
        let results: Vec<Mutex<Result<Vec<u8>>>> =
            chunks.iter().map(|_| Mutex::new(Ok(Vec::new()))).collect();
        let (vlr, is_layered) = (&compression.vlr, compression.is_layered);
        self.job.each_piece(chunks.len(), share, |i| {
            let result = chunk(vlr, is_layered, chunks[i]);
            *results[i].lock().unwrap_or_else(PoisonError::into_inner) = result;
        })?;
        for result in results {
            let bytes = result.into_inner().unwrap_or_else(PoisonError::into_inner)?;
            self.file.write_at(self.at, &bytes)?;
            let byte_count = bytes.len() as u64;
            compression.table.push(ChunkTableEntry { point_count: CHUNK as u64, byte_count });
            self.at += byte_count;
        }
        self.records.drain(..len);
        Ok(())
    }
}

/// Compresses a chunk.
fn chunk(vlr: &LazVlr, is_layered: bool, records: &[u8]) -> Result<Vec<u8>> {
    if is_layered {
        let mut compressor = LayeredPointRecordCompressor::new(Vec::new());
        compressor.set_fields_from(vlr.items())?;
        compressor.compress_many(records)?;
        compressor.done()?;
        return Ok(compressor.into_inner());
    }
    let mut compressor = SequentialPointRecordCompressor::new(Vec::new());
    compressor.set_fields_from(vlr.items())?;
    compressor.compress_many(records)?;
    compressor.done()?;
    Ok(compressor.into_inner())
}
