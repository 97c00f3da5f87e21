//! Where the surfels of a set end that was written without knowing how many there would be.

use crate::big_endian::{u16_at, u32_at};
use crate::gff::{Gff, kind, tags};
use surfelshop_api::Result;

/// The count of surfels that says that it was not known.
pub(crate) const UNKNOWN: u32 = u32::MAX;

/// Directories that close the lists of resolutions, sets, the root's children and the root's siblings.
const MAX_CLOSING: u32 = 4;

/// Bytes of a directory that closes a list.
const CLOSING_BYTES: u64 = 12;

/// Whether a directory that closes a list lies at a place, and where its parent's next sibling is said to be.
fn closing_at(gff: &Gff<'_>, place: u64) -> Result<Option<u32>> {
    let mut bytes = [0; 12];
    if gff.file().read_at(place, &mut bytes)? < bytes.len() {
        return Ok(None);
    }
    let is_closing = u16_at(&bytes, 0) == tags::UPLINK
        && u16_at(&bytes, 2) == kind::OFFSET
        && u32_at(&bytes, 4) == 1;
    Ok(is_closing.then(|| u32_at(&bytes, 8)))
}

/// Where the data of the last resolution of a set ends: before the directory that closes the set's resolutions, which
/// lies before the next set, or before all that close the file; or with a file that is cut short.
///
/// # Errors
/// Where the system refuses.
pub(crate) fn end_of_data(gff: &Gff<'_>, start: u64, next_set: Option<u32>) -> Result<u64> {
    if let Some(offset) = next_set {
        let closing = gff.place(offset).saturating_sub(CLOSING_BYTES);
        if closing >= start && closing_at(gff, closing)? == Some(offset) {
            return Ok(closing);
        }
    }
    let mut end = gff.file().length();
    for _closing in 0..MAX_CLOSING {
        let before = end.saturating_sub(CLOSING_BYTES);
        if before < start || closing_at(gff, before)?.is_none() {
            break;
        }
        end = before;
    }
    Ok(end.max(start))
}
