//! The table of the chunks of a LAZ file.

use super::{Compression, Order};
use crate::numbers::{u32_at, u64_at};
use laz::laszip::ChunkTable;
use std::io::Cursor;
use std::panic::catch_unwind;
use surfelshop_api::Result;
use surfelshop_api::format::FileSource;

/// Bytes that an entry of the table has at most, compressed.
const ENTRY: u64 = 16;

/// An entry of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    /// Points, where chunks have different numbers of them.
    pub(super) points: Option<u64>,
    pub(super) len: u64,
}

/// Where the table of a file whose points begin at `start` is; `None` where the file does not say, or says what
/// cannot be.
fn place(file: &FileSource, start: u64) -> Result<Option<u64>> {
    let length = file.length();
    let (first, last) = (start, length.saturating_sub(8));
    for at in [first, last] {
        if at.checked_add(8).is_none_or(|end| end > length) {
            return Ok(None);
        }
        let place = u64_at(&file.bytes_at(at, 8)?, 0);
        // Writers that cannot go back to the first bytes leave -1 or their own place there, and put the
        // place of the table at the end.
        let is_open = place == u64::MAX || place <= start;
        if !is_open {
            return Ok((place >= start + 8 && place <= length - 8).then_some(place));
        }
    }
    Ok(None)
}

/// The entries of the table, and where it is: `None` where there is none, or it is damaged.
///
/// # Errors
/// Where the system refuses.
pub(super) fn read(
    file: &FileSource,
    start: u64,
    compression: &Compression,
) -> Result<Option<(Vec<Entry>, u64)>> {
    let Some(at) = place(file, start)? else { return Ok(None) };
    let n = u64::from(u32_at(&file.bytes_at(at, 8)?, 4));
    // A chunk has at least its first point as it is; in layers, the number of its points, too.
    let least = compression.record_len as u64;
    if n > (at - start) / least {
        return Ok(None);
    }
    let len = (file.length() - at).min(64 + ENTRY * n);
    let bytes = file.bytes_at(at, len)?;
    let has_points = compression.chunk_points.is_none();
    // The decoder takes memory for all entries at once, and ends the program where there is none.
    Vec::<[u64; 2]>::new().try_reserve_exact(usize::try_from(n)?)?;
    // Damaged bytes make the decoder read outside its tables, which panics.
    let table = catch_unwind(|| ChunkTable::read(&mut Cursor::new(&bytes), has_points));
    let Ok(Ok(table)) = table else { return Ok(None) };
    let (mut entries, mut left) = (Vec::new(), at - start - 8);
    entries.try_reserve_exact(table.len())?;
    for entry in &table {
        // Numbers of a damaged table are negative, or lead beyond it.
        if entry.byte_count > left || entry.point_count > u64::from(u32::MAX) {
            return Ok(None);
        }
        left -= entry.byte_count;
        if entry.byte_count > 0 {
            entries.push(Entry {
                points: has_points.then_some(entry.point_count),
                len: entry.byte_count,
            });
        }
    }
    Ok(Some((entries, at)))
}

/// Whether chunks can be found without a table.
pub(super) fn is_dispensable(compression: &Compression) -> bool {
    compression.order == Order::Layers || compression.chunk_points.is_some()
}
