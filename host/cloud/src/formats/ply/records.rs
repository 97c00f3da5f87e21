//! Which values of binary records make which fields.

use super::element::fields_of;
use super::header::ElementDef;
use crate::assemble::woven_splats;
use crate::cloud::buffer::Buffer;
use crate::error::ReadFault;
use crate::table::Field;
use std::ops::Range;
use surfelshop_api::columns::Element;

/// A field, and where its values lie in a record.
pub(super) struct RecordField {
    pub(super) field: Field,
    bytes: Bytes,
}

/// Bytes of a record.
#[derive(Clone)]
enum Bytes {
    Together(Range<usize>),
    /// The first byte of each value, which are floats of single precision.
    Apart(Vec<usize>),
}

impl RecordField {
    /// Appends the values of records of so many bytes.
    pub(super) fn append(&mut self, records: &[u8], stride: usize, big: bool) {
        match (&self.bytes, &mut self.field.values) {
            (Bytes::Together(range), values) => {
                values.extend_records(records, stride, range.clone(), big);
            }
            (Bytes::Apart(starts), Buffer::F32(values)) => {
                extend_apart(values, records, stride, starts, big);
            }
            // Those apart are floats.
            (Bytes::Apart(_), _) => {}
        }
    }
}

/// Appends floats that lie apart in each record, in the order of their places.
fn extend_apart(values: &mut Vec<f32>, records: &[u8], stride: usize, starts: &[usize], big: bool) {
    let decode = if big { f32::from_be_bytes } else { f32::from_le_bytes };
    let float = |record: &[u8], start: usize| {
        let bytes = record.get(start..).and_then(<[u8]>::first_chunk);
        bytes.map_or(0.0, |bytes| decode(*bytes))
    };
    for record in records.chunks_exact(stride) {
        values.extend(starts.iter().map(|&start| float(record, start)));
    }
}

/// Empty fields for the properties of an element without lists. Neighbours that belong together share one, and so do
/// the components of each column of Gaussian splats.
pub(super) fn record_fields(element: &ElementDef) -> Vec<RecordField> {
    let fields = fields_of(element, true);
    let mut end = 0;
    let mut ranges = Vec::with_capacity(fields.len());
    for field in &fields {
        let start = end;
        end += field.names.len() * field.values.element().size();
        ranges.push(start..end);
    }
    let is_single = |&(field, _): &(usize, usize)| {
        let field = &fields[field];
        field.names.len() == 1 && field.values.element() == Element::F32
    };
    let groups = woven_splats(&fields).into_iter();
    let groups: Vec<Vec<(usize, usize)>> =
        groups.filter(|group| group.len() > 1 && group.iter().all(is_single)).collect();
    let mut in_group = vec![false; fields.len()];
    groups.iter().flatten().for_each(|&(field, _)| in_group[field] = true);
    let woven = groups.iter().map(|group| {
        let names = group.iter().map(|&(field, place)| fields[field].names[place].clone());
        let field = Field { names: names.collect(), values: Buffer::F32(Vec::new()) };
        let starts = group.iter().map(|&(field, _)| ranges[field].start).collect();
        RecordField { field, bytes: Bytes::Apart(starts) }
    });
    let mut made: Vec<RecordField> = woven.collect();
    let others = fields.into_iter().zip(ranges).zip(&in_group).filter(|(_, in_group)| !**in_group);
    made.extend(
        others.map(|((field, range), _)| RecordField { field, bytes: Bytes::Together(range) }),
    );
    made
}

/// The same with room for the element's rows.
///
/// # Errors
/// Where there is no memory.
pub(super) fn record_fields_with_room(element: &ElementDef) -> Result<Vec<RecordField>, ReadFault> {
    let n_rows = usize::try_from(element.count).unwrap_or(usize::MAX);
    let mut made = record_fields(element);
    for RecordField { field, .. } in &mut made {
        let length = n_rows.saturating_mul(field.names.len());
        field.values =
            Buffer::with_room(field.values.element(), length).map_err(ReadFault::memory(n_rows))?;
    }
    Ok(made)
}
