//! Compressed points to columns: chunks in parallel, or one point after the other.

use super::chunks::{Chunk, Chunks};
use super::decoder::{Decoder, Stream, layers};
use super::{Compression, Order};
use crate::layout::{self, Layout};
use crate::points::{Part, Points};
use laz::DecompressionSelection as Selection;
use std::io::Read;
use std::ops::Range;
use surfelshop_api::Result;
use surfelshop_api::columns::COLOR;
use surfelshop_api::format::{
    BATCH, CLASSIFICATION, FileSource, GPS_TIME, INTENSITY, POINT_SOURCE, SCAN_ANGLE,
};

/// Records that are decoded before they become columns: they stay in the inner caches.
const PIECE: u64 = 512;
/// Points of a chunk that is handed over while it is decoded, so that its columns need not fit into memory.
const LARGE: u64 = if cfg!(test) { 1 << 16 } else { 1 << 21 };

/// Reads the points of a file.
///
/// # Errors
/// Where the system or the host refuses, or the user asked to stop.
pub(crate) fn read(
    file: &FileSource,
    compression: &Compression,
    chunks: &Chunks,
    points: &mut Points<'_, '_>,
) -> Result<()> {
    match chunks {
        Chunks::Known { chunks, .. } => known(file, compression, chunks, points),
        Chunks::Stream { at, .. } => stream(file, compression, *at, points),
    }
}

/// Chunks that are decoded each by itself.
fn known(
    file: &FileSource,
    compression: &Compression,
    chunks: &[Chunk],
    points: &mut Points<'_, '_>,
) -> Result<()> {
    let selection = selection(points.layout);
    let mut parts = parts(chunks).into_iter().peekable();
    while let Some(part) = parts.next() {
        if chunks[part.start].points > LARGE {
            large(file, compression, &chunks[part.start], selection, points)?;
            continue;
        }
        let mut together = vec![part];
        while let Some(next) = parts.next_if(|next| chunks[next.start].points <= LARGE) {
            together.push(next);
        }
        let size = |part: &Range<usize>| chunks[part.clone()].iter().map(|one| one.points).sum();
        let sizes: Vec<u64> = together.iter().map(size).collect();
        points.decode_all(&sizes, |i, part| {
            let chunks = &chunks[together[i].clone()];
            load(file, chunks, part)?;
            let bytes = std::mem::take(&mut part.bytes);
            let mut rest = bytes.as_slice();
            for chunk in chunks {
                let (bytes, behind) = rest.split_at(usize::try_from(chunk.len)?);
                rest = behind;
                chunk_points(compression, bytes, chunk.points, selection, part, &mut |_part| {
                    Ok(())
                })?;
            }
            part.bytes = bytes;
            Ok(())
        })?;
    }
    Ok(())
}

/// A chunk of so many points that they are handed over while it is decoded.
fn large(
    file: &FileSource,
    compression: &Compression,
    chunk: &Chunk,
    selection: Selection,
    points: &mut Points<'_, '_>,
) -> Result<()> {
    let mut part = points.part();
    load(file, std::slice::from_ref(chunk), &mut part)?;
    let bytes = std::mem::take(&mut part.bytes);
    let mut full = |part: &mut Part<'_>| points.hand_over_batch(part);
    chunk_points(compression, &bytes, chunk.points, selection, &mut part, &mut full)?;
    points.hand_over(&mut part)
}

/// Reads the bytes of chunks that follow one another.
fn load(file: &FileSource, chunks: &[Chunk], part: &mut Part<'_>) -> Result<()> {
    let at = chunks.first().map_or(0, |chunk| chunk.at);
    let len = chunks.iter().map(|chunk| chunk.len).sum::<u64>();
    Part::reach(&mut part.bytes, usize::try_from(len)?)?;
    file.read_exact_at(at, &mut part.bytes)
}

/// Chunks that are decoded together: those of few points, up to a batch.
fn parts(chunks: &[Chunk]) -> Vec<Range<usize>> {
    let mut parts: Vec<Range<usize>> = Vec::new();
    let mut points = 0;
    for (i, chunk) in chunks.iter().enumerate() {
        match parts.last_mut() {
            Some(last) if points + chunk.points <= BATCH as u64 => {
                last.end = i + 1;
                points += chunk.points;
            }
            _ => {
                parts.push(i..i + 1);
                points = chunk.points;
            }
        }
    }
    parts
}

/// Decodes a chunk; calls `full` whenever there is a batch. What is damaged is left out.
fn chunk_points(
    compression: &Compression,
    bytes: &[u8],
    n_points: u64,
    selection: Selection,
    part: &mut Part<'_>,
    full: &mut dyn FnMut(&mut Part<'_>) -> Result<()>,
) -> Result<()> {
    let mut n_points = n_points;
    if compression.order == Order::Layers {
        // Layers that are empty never end: the chunk's own number of points is the last word.
        match layers(compression, bytes) {
            Ok((n, _)) => n_points = n_points.min(n),
            Err(error) => {
                part.fault.get_or_insert(error.message().to_owned());
                return Ok(());
            }
        }
    }
    let mut decoder = Decoder::of_chunk(compression, bytes, Some(selection))?;
    decode(&mut decoder, n_points, compression.record_len, part, full).map(drop)
}

/// Decodes points as far as it goes; says whether that is to the end.
fn decode<R: Read>(
    decoder: &mut Decoder<'_, R>,
    n_points: u64,
    record_len: usize,
    part: &mut Part<'_>,
    full: &mut dyn FnMut(&mut Part<'_>) -> Result<()>,
) -> Result<bool> {
    let mut left = n_points;
    while left > 0 {
        let n = usize::try_from(left.min(PIECE))?;
        Part::reach(&mut part.records, n * record_len)?;
        let decoded = decoder.fill(&mut part.records, record_len);
        part.columns.push(&part.records[..decoded.n_records * record_len])?;
        if let Some(fault) = decoded.fault {
            part.fault.get_or_insert(fault);
            return Ok(false);
        }
        left -= n as u64;
        if part.columns.n_rows() >= BATCH {
            full(part)?;
        }
    }
    Ok(true)
}

/// Points that are decoded one after the other, in chunks of one size or all in one.
fn stream(
    file: &FileSource,
    compression: &Compression,
    at: u64,
    points: &mut Points<'_, '_>,
) -> Result<()> {
    let mut bytes = Stream::new(file, at);
    let mut part = points.part();
    let mut left = points.expected;
    let is_run = compression.order == Order::Run;
    let per_chunk = compression.chunk_points.filter(|_| !is_run).unwrap_or(u64::MAX);
    while left > 0 {
        let mut decoder = Decoder::of_points(compression, bytes)?;
        let n = left.min(per_chunk);
        let mut full = |part: &mut Part<'_>| points.hand_over_batch(part);
        let goes_on = decode(&mut decoder, n, compression.record_len, &mut part, &mut full)?;
        left -= n;
        match decoder.into_bytes() {
            Some(rest) if goes_on => bytes = rest,
            _ => break,
        }
    }
    points.hand_over(&mut part)
}

/// The fields that the columns need, of those that can be passed over.
fn selection(layout: &Layout) -> Selection {
    let has = |name: &str| layout.columns.iter().any(|column| column.file.name == name);
    let mut bits = Selection::Z;
    for (name, bit) in [
        (CLASSIFICATION, Selection::CLASSIFICATION),
        (layout::CLASS_FLAGS, Selection::FLAGS),
        (layout::SCAN_FLAGS, Selection::FLAGS),
        (INTENSITY, Selection::INTENSITY),
        (SCAN_ANGLE, Selection::SCAN_ANGLE),
        (layout::USER_DATA, Selection::USER_DATA),
        (POINT_SOURCE, Selection::POINT_SOURCE_ID),
        (GPS_TIME, Selection::GPS_TIME),
        (COLOR, Selection::RGB),
        (layout::NIR, Selection::NIR),
    ] {
        if has(name) {
            bits |= bit;
        }
    }
    if layout.columns.iter().any(|column| column.is_extra) {
        bits |= Selection::ALL_EXTRA_BYTES;
    }
    Selection(bits)
}
