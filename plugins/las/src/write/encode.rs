//! Columns to point records.

use super::plan::{Field, Plan, Put};
use super::scale::Steps;
use super::values::{Value, each_type};
use crate::numbers::{bytes, u32_at};
use std::ops::Range;
use surfelshop_api::columns::Values;
use surfelshop_api::glam::DVec3;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{CloudView, Error, Result};

/// Records that are filled from one column after the other: they stay in the innermost cache.
const BLOCK: usize = 512;

/// What was written so far, and what did not fit.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    /// Points.
    pub(super) n_points: u64,
    /// Points of each return, from the first.
    pub(super) n_returns: [u64; 15],
    /// Smallest and largest coordinates, in steps.
    pub(super) bounds: Option<[[i32; 3]; 2]>,
    /// Points without a place.
    pub(super) n_placeless: u64,
    /// The largest distance between a coordinate and the one in the file.
    pub(super) rounding: DVec3,
    /// Of each field, values that were changed.
    pub(super) misfits: Vec<u64>,
    /// Of each field, values that are no number, which are among these.
    pub(super) n_nan: Vec<u64>,
}

/// Fills records.
pub(super) struct Encoder<'a> {
    plan: &'a Plan,
    steps: Steps,
    pub(super) counts: Counts,
}

impl<'a> Encoder<'a> {
    pub(super) fn new(plan: &'a Plan, steps: Steps) -> Self {
        let zeros = || vec![0; plan.fields.len()];
        let counts = Counts { misfits: zeros(), n_nan: zeros(), ..Counts::default() };
        Self { plan, steps, counts }
    }

    /// Adds the records of a batch to `records`.
    ///
    /// # Errors
    /// Where the batch does not have the columns of its header, or coordinates lie too far apart.
    pub(super) fn add(&mut self, batch: &CloudView<'_>, records: &mut Vec<u8>) -> Result<()> {
        let (len, start) = (self.plan.record_len, records.len());
        check(batch, &self.plan.fields)?;
        records.try_reserve(batch.len * len)?;
        for first in (0..batch.len).step_by(BLOCK) {
            let rows = first..(first + BLOCK).min(batch.len);
            let from = records.len();
            for _ in rows.clone() {
                records.extend_from_slice(&self.plan.empty);
            }
            for (i, field) in self.plan.fields.iter().enumerate() {
                let values = &batch.columns[field.column].values;
                let values_of = rows.start * field.components..rows.end * field.components;
                let records = &mut records[from..];
                if field.put == Put::Position {
                    self.positions(values, values_of, batch.origin, records)?;
                } else {
                    let n_misfits = fill(field, values, values_of.clone(), records, len);
                    if n_misfits > 0 {
                        self.counts.misfits[i] += n_misfits;
                        if field.components == 1 {
                            self.counts.n_nan[i] += count_nan(values, values_of);
                        }
                    }
                }
            }
        }
        if self.counts.n_placeless > 0 {
            drop_placeless(batch, &self.plan.fields, records, start, len);
        }
        self.count(&records[start..]);
        Ok(())
    }

    /// Fills in coordinates.
    fn positions(
        &mut self,
        values: &Values<'_>,
        range: Range<usize>,
        origin: DVec3,
        records: &mut [u8],
    ) -> Result<()> {
        let len = self.plan.record_len;
        each_type!(values, slice => {
            let points = slice[range].chunks_exact(3);
            for (point, record) in points.zip(records.chunks_exact_mut(len)) {
                let place = DVec3::new(point[0].number(), point[1].number(), point[2].number()) + origin;
                if !place.is_finite() {
                    self.counts.n_placeless += 1;
                    continue;
                }
                let whole = ((place - self.steps.offset) / self.steps.scale).round();
                let (least, most) = (f64::from(i32::MIN), f64::from(i32::MAX));
                if whole.min_element() < least || whole.max_element() > most {
                    return Err(too_far(place, self.steps));
                }
                for (axis, value) in whole.to_array().into_iter().enumerate() {
                    (value as i32).put(&mut record[4 * axis..]);
                }
                let off = (whole * self.steps.scale + self.steps.offset - place).abs();
                self.counts.rounding = self.counts.rounding.max(off);
            }
        });
        Ok(())
    }

    /// Counts records.
    fn count(&mut self, records: &[u8]) {
        let mask = if self.plan.format.is_extended() { 15 } else { 7 };
        for record in records.chunks_exact(self.plan.record_len) {
            let place = [0, 4, 8].map(|at| u32_at(record, at) as i32);
            let [low, high] = self.counts.bounds.get_or_insert([place; 2]);
            for axis in 0..3 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
            let [returns] = bytes(record, 14);
            if let Some(i) = usize::from(returns & mask).checked_sub(1) {
                self.counts.n_returns[i] += 1;
            }
        }
        self.counts.n_points += (records.len() / self.plan.record_len) as u64;
    }
}

fn too_far(place: DVec3, steps: Steps) -> Error {
    Error::new(format!(
        "a point at {place} is too far from the others for 32 bits in steps of {}; set a larger `scale`",
        steps.scale
    ))
}

/// Whether a batch has the columns that the fields are filled from.
fn check(batch: &CloudView<'_>, fields: &[Field]) -> Result<()> {
    for field in fields {
        let column = batch.columns.get(field.column);
        let found = column.filter(|column| column.name == field.name);
        let found = found.map(|column| column.values.len());
        if found != Some(batch.len * field.components) {
            return Err(Error::new(format!(
                "column `{}` of a batch: expected {} values, found {}",
                field.name,
                batch.len * field.components,
                found.unwrap_or(0)
            )));
        }
    }
    Ok(())
}

/// Takes out the records of points without a place.
fn drop_placeless(
    batch: &CloudView<'_>,
    fields: &[Field],
    records: &mut Vec<u8>,
    start: usize,
    len: usize,
) {
    let Some(field) = fields.iter().find(|field| field.put == Put::Position) else { return };
    let mut end = start;
    each_type!(&batch.columns[field.column].values, slice => {
        for (i, point) in slice.chunks_exact(3).enumerate() {
            if point.iter().all(|value| value.number().is_finite()) {
                let from = start + i * len;
                records.copy_within(from..from + len, end);
                end += len;
            }
        }
    });
    records.truncate(end);
}

/// Fills in one field; returns how many values had to be changed.
fn fill(
    field: &Field,
    values: &Values<'_>,
    range: Range<usize>,
    records: &mut [u8],
    len: usize,
) -> u64 {
    let n = field.components;
    each_type!(values, slice => match field.put {
        Put::Position => 0,
        Put::Whole { at, shift, most } => whole(&slice[range], records, len, at, shift, most),
        Put::Angle { at, step, most } => angles(&slice[range], records, len, at, step, most),
        Put::Time { at } => {
            for (value, record) in slice[range].iter().zip(records.chunks_exact_mut(len)) {
                value.number().put(&mut record[at..]);
            }
            0
        }
        Put::Raw { at, component } => {
            let values = slice[range].iter().skip(component).step_by(n);
            for (value, record) in values.zip(records.chunks_exact_mut(len)) {
                value.put(&mut record[at..]);
            }
            0
        }
        Put::Color { at } => colors(values, range, n, records, len, at),
    })
}

/// Values that are no number.
fn count_nan(values: &Values<'_>, range: Range<usize>) -> u64 {
    each_type!(values, slice => {
        slice[range].iter().filter(|value| value.number().is_nan()).count() as u64
    })
}

fn whole<T: Value>(
    values: &[T],
    records: &mut [u8],
    len: usize,
    at: usize,
    shift: u32,
    most: u16,
) -> u64 {
    let mut n_misfits = 0;
    for (value, record) in values.iter().zip(records.chunks_exact_mut(len)) {
        let number = value.number();
        // A number that is none becomes 0.
        let fitting = number.round().max(0.0).min(f64::from(most));
        n_misfits += u64::from(fitting.to_bits() != (number + 0.0).to_bits());
        let bits = (fitting as u16) << shift;
        if most > 255 {
            bits.put(&mut record[at..]);
        } else {
            let mask = (most as u8) << shift;
            record[at] = record[at] & !mask | bits as u8;
        }
    }
    n_misfits
}

fn angles<T: Value>(
    values: &[T],
    records: &mut [u8],
    len: usize,
    at: usize,
    step: f64,
    most: f64,
) -> u64 {
    let mut n_misfits = 0;
    for (value, record) in values.iter().zip(records.chunks_exact_mut(len)) {
        let angle = value.number();
        let steps = (angle / step).round().clamp(-most, most);
        // The tenth of a step is more than single precision takes away.
        let is_near = (steps * step - angle).abs() <= step / 10.0;
        n_misfits += u64::from(!is_near);
        match most > 127.0 {
            true => (steps as i16).put(&mut record[at..]),
            false => (steps as i8).put(&mut record[at..]),
        }
    }
    n_misfits
}

/// Fills in colours as 16-bit numbers: those of 8 bits are spread, and linear ones are encoded.
fn colors(
    values: &Values<'_>,
    range: Range<usize>,
    n: usize,
    records: &mut [u8],
    len: usize,
    at: usize,
) -> u64 {
    let mut n_misfits = 0;
    let mut encode = |linear: f64| {
        n_misfits += u64::from(!(0.0..=1.0).contains(&linear));
        let fitting = linear.clamp(0.0, 1.0);
        (f64::from(linear_to_srgb(fitting as f32)) * f64::from(u16::MAX)).round() as u16
    };
    each_type!(values, slice => {
        for (point, record) in slice[range].chunks_exact(n).zip(records.chunks_exact_mut(len)) {
            for channel in 0..3 {
                let number = point[channel].number();
                let wide = match values {
                    Values::U8(_) => number as u16 * 257,
                    Values::U16(_) => number as u16,
                    _ => encode(number),
                };
                wide.put(&mut record[at + 2 * channel..]);
            }
        }
    });
    n_misfits
}
