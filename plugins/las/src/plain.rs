//! Points that are not compressed.

use crate::header::Header;
use crate::points::{Part, Points, batches};
use surfelshop_api::format::{BATCH, FileSource};
use surfelshop_api::{Error, Result};

/// How many points a file has; adds to `warnings` where that is not what it says.
///
/// # Errors
/// Where it says that there are points and has none.
pub(crate) fn count(file: &FileSource, header: &Header, warnings: &mut Vec<String>) -> Result<u64> {
    let announced = header.n_points;
    let end = header.points_end.min(file.length());
    let bytes = end.saturating_sub(header.points_at);
    let fitting = bytes / header.record_len as u64;
    if fitting < announced {
        if fitting == 0 {
            return Err(Error::new(format!(
                "expected {announced} points of {} bytes from byte {}, found {bytes} bytes: the file is cut short",
                header.record_len, header.points_at
            )));
        }
        warnings.push(format!(
            "the header announces {announced} points, the file has {fitting}: it is cut short"
        ));
        return Ok(fitting);
    }
    let behind = bytes - announced * header.record_len as u64;
    if fitting > announced && (announced == 0 || behind.is_multiple_of(header.record_len as u64)) {
        warnings.push(format!(
            "the header announces {announced} points, the file has {fitting}; all of them are read"
        ));
        return Ok(fitting);
    }
    if fitting > announced {
        warnings.push(format!("{behind} bytes behind the {announced} points are not read"));
    }
    Ok(announced)
}

/// Reads the points of a file.
///
/// # Errors
/// Where the system or the host refuses, or the user asked to stop.
pub(crate) fn read(file: &FileSource, header: &Header, points: &mut Points<'_, '_>) -> Result<()> {
    let sizes = batches(points.expected);
    let (start, len) = (header.points_at, header.record_len);
    points.decode_all(&sizes, |i, part| {
        let rows = usize::try_from(sizes[i])?;
        Part::reach(&mut part.bytes, rows * len)?;
        file.read_exact_at(start + (i * BATCH * len) as u64, &mut part.bytes)?;
        part.columns.push(&part.bytes)
    })
}
