//! Where the chunks of a LAZ file lie, and how many points they have.

use super::decoder::layers_len;
use super::{Compression, Order, table};
use crate::header::Header;
use crate::numbers::u32_at;
use surfelshop_api::format::FileSource;
use surfelshop_api::{Error, Job, Result};

/// Points that a compressed byte can hold at most: of 50,000 points that are all alike a byte holds 150, and of more
/// up to 600.
pub(crate) const PLAUSIBLE: u64 = 1 << 10;

/// A chunk of compressed points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Chunk {
    pub(crate) at: u64,
    pub(crate) len: u64,
    /// Points to decode; of the last chunk of a file that does not say how many points it has, the most that it can
    /// have.
    pub(crate) points: u64,
}

/// The compressed points of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Chunks {
    /// Chunks that can be decoded each by itself, and how many points they have together, if that is known.
    Known { chunks: Vec<Chunk>, points: Option<u64> },
    /// Points that must be decoded one after the other: from where, how many, if that is known, and how many at most.
    Stream { at: u64, points: Option<u64>, most: u64 },
}

impl Chunks {
    /// Finds the chunks of a file; adds to `warnings` what is doubtful.
    ///
    /// # Errors
    /// Where they cannot be found, the system refuses, or the user asked to stop.
    pub(crate) fn find(
        file: &FileSource,
        header: &Header,
        compression: &Compression,
        warnings: &mut Vec<String>,
        job: &Job<'_>,
    ) -> Result<Self> {
        let (start, length) = (header.points_at, file.length());
        let announced = header.n_points;
        if start > length || (start == length && announced > 0) {
            return Err(Error::new(format!(
                "expected {announced} points from byte {start}, found a file of {length} bytes: it is cut short"
            )));
        }
        let bytes = length - start;
        let most = bytes.saturating_mul(PLAUSIBLE);
        if compression.order == Order::Run {
            return Ok(streamed(start, announced, bounded(announced, most, warnings)));
        }
        if let Some((entries, _)) = table::read(file, start, compression)? {
            let points = bounded(announced, most, warnings);
            return Ok(of_table(&entries, start + 8, compression, points, announced, warnings));
        }
        if announced == 0 && bytes < 16 {
            return Ok(Self::Known { chunks: Vec::new(), points: Some(0) });
        }
        if !table::is_dispensable(compression) {
            return Err(Error::new(
                "expected a table of chunks, found none or a damaged one; without it chunks of different \
                 numbers of points cannot be found",
            ));
        }
        warnings.push(
            "the table of chunks is missing or damaged; points are read one chunk after the other"
                .to_owned(),
        );
        if compression.order == Order::Layers {
            let found = walked(file, start + 8, compression, announced, job)?;
            if let Self::Known { points: Some(points), .. } = &found
                && *points < announced
            {
                warnings.push(format!(
                    "{points} of {announced} points are in chunks that are whole: the file is cut short or damaged"
                ));
            }
            return Ok(found);
        }
        Ok(streamed(start + 8, announced, bounded(announced, most, warnings)))
    }
}

fn streamed(at: u64, announced: u64, most: u64) -> Chunks {
    Chunks::Stream { at, points: (announced > 0).then_some(most), most }
}

/// A number of points that is announced, or the most that there can be.
fn bounded(announced: u64, most: u64, warnings: &mut Vec<String>) -> u64 {
    if announced > most {
        warnings.push(format!(
            "the header announces {announced} points, which the file is too short for"
        ));
    }
    if announced == 0 { most } else { announced.min(most) }
}

/// The chunks of a table.
fn of_table(
    entries: &[table::Entry],
    start: u64,
    compression: &Compression,
    bound: u64,
    announced: u64,
    warnings: &mut Vec<String>,
) -> Chunks {
    let mut chunks = Vec::with_capacity(entries.len());
    let (mut at, mut total) = (start, 0u64);
    for entry in entries {
        let points = entry.points.or(compression.chunk_points).unwrap_or(0);
        let points = points.min(entry.len.saturating_mul(PLAUSIBLE));
        chunks.push(Chunk { at, len: entry.len, points });
        at += entry.len;
        total = total.saturating_add(points);
    }
    let is_fixed = compression.chunk_points.is_some();
    // Where all chunks have one size, only the header says how many points the last one has.
    let last = if is_fixed { chunks.last().map_or(0, |last| last.points) } else { 0 };
    if announced > 0 && bound > total {
        warnings.push(format!("the header announces {announced} points, the chunks have {total}"));
        return Chunks::Known { chunks, points: Some(total) };
    }
    if bound > total - last && announced > 0 {
        if let (true, Some(end)) = (is_fixed, chunks.last_mut()) {
            end.points = bound - (total - last);
        }
        return Chunks::Known { chunks, points: Some(bound) };
    }
    if total > announced {
        let about = if is_fixed { "up to " } else { "" };
        warnings.push(format!(
            "the header announces {announced} points, the chunks have {about}{total}; all of them are read"
        ));
    }
    let is_known = !is_fixed || chunks.is_empty();
    Chunks::Known { chunks, points: is_known.then_some(total) }
}

/// Chunks of layers, found one after the other: each says how long it is and how many points it has.
fn walked(
    file: &FileSource,
    start: u64,
    compression: &Compression,
    announced: u64,
    job: &Job<'_>,
) -> Result<Chunks> {
    let (mut chunks, mut at, mut total) = (Vec::new(), start, 0u64);
    let head = compression.record_len as u64;
    let body = head + 4 + 4 * compression.n_layers() as u64;
    let length = file.length();
    while at.checked_add(body).is_some_and(|end| end <= length) {
        if announced > 0 && total >= announced {
            break;
        }
        if chunks.len() % 4096 == 0 {
            job.check()?;
        }
        let sizes = file.bytes_at(at + head, body - head)?;
        let points = u64::from(u32_at(&sizes, 0));
        let len = body.saturating_add(layers_len(&sizes[4..]));
        let ends_inside = len <= length - at;
        let is_one = points > 0 && points <= len.saturating_mul(PLAUSIBLE);
        if !ends_inside || !is_one || compression.chunk_points.is_some_and(|most| points > most) {
            break;
        }
        chunks.try_reserve(1)?;
        chunks.push(Chunk { at, len, points });
        at += len;
        total += points;
    }
    if chunks.is_empty() {
        return Err(Error::new(format!(
            "expected {announced} compressed points, found no chunk of them that is whole"
        )));
    }
    Ok(Chunks::Known { chunks, points: Some(total) })
}
