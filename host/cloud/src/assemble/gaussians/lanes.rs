//! The values of splats out of the fields of a file: in place where a field has them as the host does, else woven.

use super::plan::Lane;
use super::{BLOCK, FileValues};
use crate::cloud::buffer::Buffer;
use crate::memory::{OutOfMemory, with_room};
use crate::table::Field;
use rayon::prelude::*;
use std::borrow::Cow;
use surfelshop_api::columns::Values;

/// Where values come from.
pub(super) enum FileColumns<'a> {
    /// Fields whose values may be taken.
    Own(&'a mut [Field]),
    /// Values that stay where they are.
    Lent(&'a [FileValues<'a>]),
}

impl FileColumns<'_> {
    /// Takes the values of a field that holds just these lanes in this order, as floats of single precision.
    fn take(&mut self, lanes: &[Lane], n: usize) -> Option<Vec<f32>> {
        let Self::Own(fields) = self else { return None };
        let field = fields.get_mut(whole_field(lanes)?)?;
        match &mut field.values {
            Buffer::F32(values)
                if field.names.len() == lanes.len() && values.len() == n * lanes.len() =>
            {
                Some(std::mem::take(values))
            }
            _ => None,
        }
    }

    fn values(&self, field: usize) -> Option<FileValues<'_>> {
        match self {
            Self::Own(fields) => {
                fields.get(field).map(|field| (field.values.as_values(), field.names.len()))
            }
            Self::Lent(given) => given.get(field).copied(),
        }
    }
}

/// The field whose first values these lanes are, in its order.
pub(super) fn whole_field(lanes: &[Lane]) -> Option<usize> {
    let field = lanes.first()?.field;
    let is_next = |(place, lane): (usize, &Lane)| lane.field == field && lane.place == place;
    lanes.iter().enumerate().all(is_next).then_some(field)
}

/// The values of splats, `N` of each together, as a function makes them of those in the file. It gets the rows of a
/// block, which are multiplied by their lanes' factors already, and the marks of splats that are damaged.
pub(super) fn values<const N: usize>(
    given: &mut FileColumns<'_>,
    lanes: &[Lane],
    marks: &mut [bool],
    make: impl Fn(&mut [[f32; N]], &mut [bool]) + Sync,
) -> Result<Vec<f32>, OutOfMemory> {
    let factors: [f32; N] = std::array::from_fn(|i| lanes.get(i).map_or(1.0, |lane| lane.factor));
    let is_signed = factors.iter().any(|factor| factor.is_sign_negative());
    if let Some(mut own) = given.take(lanes, marks.len()) {
        let rows = own.as_chunks_mut::<N>().0.par_chunks_mut(BLOCK);
        rows.zip(marks.par_chunks_mut(BLOCK)).for_each(|(rows, marks)| {
            if is_signed {
                rows.iter_mut().for_each(|row| scale(row, &factors));
            }
            make(rows, marks);
        });
        return Ok(own);
    }
    let floats_of = |lane: &Lane| given.values(lane.field).map_or((Cow::default(), 1), floats);
    let values: Vec<(Cow<'_, [f32]>, usize)> = lanes.iter().map(floats_of).collect();
    let column = |i: usize| {
        let (lane, (values, step)) = (lanes.get(i)?, values.get(i)?);
        Some((values.get(lane.place..).unwrap_or_default(), *step))
    };
    let columns: [_; N] = std::array::from_fn(|i| column(i).unwrap_or((&[], 1)));
    let mut made: Vec<f32> = with_room(marks.len() * N)?;
    made.resize(marks.len() * N, 0.0);
    let rows = made.as_chunks_mut::<N>().0.par_chunks_mut(BLOCK).enumerate();
    rows.zip(marks.par_chunks_mut(BLOCK)).for_each(|((block, rows), marks)| {
        for (i, row) in rows.iter_mut().enumerate() {
            let value = |(values, step): &(&[f32], usize)| {
                values.get((block * BLOCK + i) * step).copied().unwrap_or_default()
            };
            *row = columns.each_ref().map(value);
            scale(row, &factors);
        }
        make(rows, marks);
    });
    Ok(made)
}

/// Multiplies by factors of 1 and -1.
fn scale<const N: usize>(row: &mut [f32; N], factors: &[f32; N]) {
    row.iter_mut().zip(factors).for_each(|(value, factor)| *value *= factor);
}

/// The values of a field of floats in single precision.
fn floats<'a>((values, step): FileValues<'a>) -> (Cow<'a, [f32]>, usize) {
    let floats = match values {
        Values::F32(values) => Cow::Borrowed(values),
        other => Cow::Owned(other.iter_f64().map(|value| value as f32).collect()),
    };
    (floats, step)
}
