//! Binary records: elements of scalars are decoded in bulk, elements with lists one by one.

use super::element::{at_end, empty_fields, fields_of, has_lists, least_size, shrunk};
use super::faces::{self, Corners};
use super::header::ElementDef;
use super::lists;
use super::records::record_fields_with_room;
use crate::error::ReadFault;
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::table::Field;
use std::io::Read;
use surfelshop_geometry::Progress;

/// Records decoded together; a block of 4096 usual records stays in the second-level cache.
const BLOCK: usize = 4096;

/// Bytes of such a block of large records.
const BLOCK_BYTES: usize = 1 << 17;

/// Bytes a block may have, however long a hostile header makes its records; also bytes passed over
/// between two questions whether to stop.
const MAX_BLOCK: usize = 1 << 20;

/// Checks that the announced records can be in the file, before anything is allocated for them.
fn check_count<R>(body: &Body<R>, element: &ElementDef) -> Result<u64, ReadFault> {
    let size = least_size(element);
    match element.count.checked_mul(size) {
        Some(bytes) if bytes <= body.remaining => Ok(bytes),
        _ => {
            let at_least = if has_lists(element) { "at least " } else { "" };
            Err(ReadFault::Truncated {
                element: element.name.clone(),
                expected: format!("{} records of {at_least}{size} bytes", element.count),
                found: format!(
                    "{} bytes, which hold {}",
                    body.remaining,
                    body.remaining / size.max(1)
                ),
            })
        }
    }
}

/// Passes over an element, taking the faces along that it has.
pub(super) fn pass<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    faces: &mut Faces,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    if let Some(corners) = Corners::of(element) {
        return faces::read(body, element, corners, big, faces, progress);
    }
    let mut left = check_count(body, element)?;
    if has_lists(element) {
        return lists::skip(body, element, big, progress);
    }
    while left > 0 {
        body.report(progress)?;
        let some = left.min(MAX_BLOCK as u64);
        let skipped = std::io::copy(&mut body.by_ref().take(some), &mut std::io::sink())?;
        if skipped < some {
            return Err(shrunk(element));
        }
        left -= some;
    }
    Ok(())
}

/// Reads the scalar properties of an element without lists, and hands each block of records over: so many
/// of them.
pub(super) fn blocks<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    progress: Progress<'_>,
    mut take: impl FnMut(&[Field], usize) -> Result<(), ReadFault>,
) -> Result<(), ReadFault> {
    check_count(body, element)?;
    let mut fields = fields_of(element, true);
    let stride = usize::try_from(least_size(element)).ok().ok_or_else(|| shrunk(element))?;
    let block = (MAX_BLOCK / stride.max(1)).max(1);
    let mut bytes = vec![0; block * stride];
    let mut left = usize::try_from(element.count).ok().ok_or_else(|| shrunk(element))?;
    while left > 0 {
        body.report(progress)?;
        let records = left.min(block);
        let bytes = &mut bytes[..records * stride];
        body.read_exact(bytes).map_err(|error| at_end(error, element))?;
        let mut offset = 0;
        for field in &mut fields {
            let end = offset + field.names.len() * field.values.element().size();
            field.values.clear();
            field.values.extend_records(bytes, stride, offset..end, big);
            offset = end;
        }
        take(&fields, records)?;
        left -= records;
    }
    Ok(())
}

/// Reads the scalar properties of an element.
pub(super) fn read<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    progress: Progress<'_>,
) -> Result<Vec<Field>, ReadFault> {
    check_count(body, element)?;
    if has_lists(element) {
        let mut fields = empty_fields(element, false)?;
        lists::read(body, element, big, &mut fields, progress)?;
        return Ok(fields);
    }
    let mut fields = record_fields_with_room(element)?;
    let stride = usize::try_from(least_size(element)).ok().ok_or_else(|| shrunk(element))?;
    let block = (BLOCK_BYTES / stride.max(1)).clamp(1, BLOCK);
    let mut bytes = vec![0; block * stride];
    let mut left = usize::try_from(element.count).ok().ok_or_else(|| shrunk(element))?;
    while left > 0 {
        body.report(progress)?;
        let records = left.min(block);
        let bytes = &mut bytes[..records * stride];
        body.read_exact(bytes).map_err(|error| at_end(error, element))?;
        fields.iter_mut().for_each(|field| field.append(bytes, stride, big));
        left -= records;
    }
    Ok(fields.into_iter().map(|made| made.field).collect())
}
