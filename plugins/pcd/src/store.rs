//! Where encoded points are kept until their number is known: in the file, or field by field, compressed.

use crate::encode::{Field, widened};
use crate::fields::PackedFields;
use crate::text;
use std::io::{Read, Seek, SeekFrom};
use surfelshop_api::format::{BATCH, FileSink};
use surfelshop_api::prelude::{Job, Result};

/// Points one after the other.
pub(crate) enum Store<'a> {
    /// In the file as they lie in memory, from an offset on.
    Binary { file: &'a FileSink, start: u64, len: u64 },
    /// In the file as lines, from an offset on.
    Text { file: &'a FileSink, start: u64, len: u64 },
    /// In memory, compressed.
    Packed(PackedFields),
}

impl Store<'_> {
    /// Adds points of these fields.
    ///
    /// # Errors
    /// Where the system refuses, memory runs out, or the user asked to stop.
    pub(crate) fn append(&mut self, rows: &[u8], fields: &[Field], job: &Job<'_>) -> Result<()> {
        match self {
            Self::Binary { file, start, len } => {
                file.write_at(*start + *len, rows)?;
                *len += rows.len() as u64;
            }
            Self::Text { file, start, len } => {
                for piece in text::lines(rows, fields, job)? {
                    file.write_at(*start + *len, piece.as_bytes())?;
                    *len += piece.len() as u64;
                }
            }
            Self::Packed(packed) => packed.append(rows, fields)?,
        }
        Ok(())
    }

    /// Gives points of `step` bytes wide positions.
    ///
    /// # Errors
    /// As [`append`](Self::append).
    pub(crate) fn widen(&mut self, step: usize, job: &Job<'_>) -> Result<()> {
        match self {
            Self::Packed(packed) => packed.widen(job),
            Self::Text { file, start, len } => {
                *len = widen_text(file, *start, *len, job)?;
                Ok(())
            }
            Self::Binary { file, start, len } => {
                *len = widen_binary(file, *start, *len, step, job)?;
                Ok(())
            }
        }
    }
}

/// Widens points in a file; their length then.
fn widen_binary(file: &FileSink, start: u64, len: u64, step: usize, job: &Job<'_>) -> Result<u64> {
    let (mut narrow, mut wide) = (Vec::new(), Vec::new());
    let mut stream = file.stream();
    let (n, mut end) = (len / step as u64, 0);
    // From the end on, since points become longer than those that lie before them.
    for chunk in (0..n.div_ceil(BATCH as u64)).rev() {
        job.check()?;
        let first = chunk * BATCH as u64;
        // At most a batch.
        let count = (n - first).min(BATCH as u64) as usize;
        narrow.resize(count * step, 0);
        stream.seek(SeekFrom::Start(start + first * step as u64))?;
        stream.read_exact(&mut narrow)?;
        wide.clear();
        widened(&narrow, step, &mut wide);
        let wide_step = (wide.len() / count) as u64;
        file.write_at(start + first * wide_step, &wide)?;
        end = end.max(first * wide_step + wide.len() as u64);
    }
    Ok(end)
}

/// Writes the positions of lines in a file with as many digits as double precision takes; their length then.
///
/// Lines grow by different lengths, so that those written so far are taken into memory: clouds of which single
/// precision holds the first points, and not later ones, are rare.
fn widen_text(file: &FileSink, start: u64, len: u64, job: &Job<'_>) -> Result<u64> {
    let mut lines = Vec::new();
    let n = usize::try_from(len)?;
    lines.try_reserve_exact(n)?;
    lines.resize(n, 0);
    let mut stream = file.stream();
    stream.seek(SeekFrom::Start(start))?;
    stream.read_exact(&mut lines)?;
    let mut end = 0;
    for block in lines.chunks(text::BLOCK).scan(Vec::new(), |carried: &mut Vec<u8>, block| {
        carried.extend_from_slice(block);
        let whole = carried.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        Some(carried.drain(..whole).collect::<Vec<u8>>())
    }) {
        job.check()?;
        let wide = text::widened(&block);
        file.write_at(start + end, wide.as_bytes())?;
        end += wide.len() as u64;
    }
    Ok(end)
}
