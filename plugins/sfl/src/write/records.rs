//! Records of surfels from batches of columns.

use super::fields::{Column, Field};
use super::report::Report;
use crate::big_endian::put;
use crate::surfel::layout::Layout;
use crate::surfel::normal_code::Cube;
use crate::surfel::plain::{Plain, Stored};
use surfelshop_api::columns::{CloudView, ColumnView, POSITION, Values};
use surfelshop_api::glam::DVec3;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{Error, Result};

/// How far a share may be from a step of 1/255, in steps: 32-bit floats of steps are nearer.
const SHARE_TOLERANCE: f64 = 1e-3;

/// What makes the records of a set.
#[derive(Debug)]
pub(super) struct Records {
    layout: Layout,
    columns: Vec<Column>,
    origin: DVec3,
    /// Box of the positions as they are stored.
    bounds: Option<[DVec3; 2]>,
}

/// Positions of a batch, relative to zero.
pub(super) fn positions(batch: &CloudView<'_>) -> Result<Vec<DVec3>> {
    let column = find(batch, POSITION, 3)?;
    let mut positions = Vec::new();
    positions.try_reserve_exact(batch.len)?;
    let mut values = column.values.iter_f64();
    while let (Some(x), Some(y), Some(z)) = (values.next(), values.next(), values.next()) {
        positions.push(DVec3::new(x, y, z) + batch.origin);
    }
    Ok(positions)
}

fn find<'a, 'b>(
    batch: &'a CloudView<'b>,
    name: &str,
    components: usize,
) -> Result<&'a ColumnView<'b>> {
    let column = batch
        .column(name)
        .ok_or_else(|| Error::new(format!("expected column `{name}` in a batch, found none")))?;
    let found = column.components as usize;
    if found != components || column.values.len() != components * batch.len {
        return Err(Error::new(format!(
            "column `{name}` of a batch: expected {} points of {components}, found {} values",
            batch.len,
            column.values.len()
        )));
    }
    Ok(column)
}

impl Records {
    /// Records with a layout, whose positions are relative to an origin.
    pub(super) fn new(layout: Layout, columns: Vec<Column>, origin: DVec3) -> Self {
        Self { layout, columns, origin, bounds: None }
    }

    /// Box of the finite positions as they are stored; `None` where there was none.
    pub(super) fn bounds(&self) -> Option<[DVec3; 2]> {
        self.bounds
    }

    /// The records of a batch; `bytes` is overwritten.
    ///
    /// # Errors
    /// Where the batch lacks a column, a position is beyond 32-bit floats, or there is no memory.
    pub(super) fn encode(
        &mut self,
        batch: &CloudView<'_>,
        bytes: &mut Vec<u8>,
        report: &mut Report,
    ) -> Result<()> {
        let size = self.layout.record;
        let too_many = || Error::new("a batch has more surfels than memory");
        let len = batch.len.checked_mul(size).ok_or_else(too_many)?;
        bytes.clear();
        bytes.try_reserve_exact(len)?;
        bytes.resize(len, 0);
        for column in &self.columns {
            let place = self.layout.place(column.property).unwrap_or(0);
            let records = bytes.chunks_exact_mut(size);
            match column.field {
                Field::Position => {
                    let bounds = &mut self.bounds;
                    for (record, position) in records.zip(positions(batch)?) {
                        let own = position - self.origin;
                        let stored = own.as_vec3();
                        if !stored.is_finite() && own.is_finite() {
                            return Err(Error::new(format!(
                                "expected positions within the range of 32-bit floats, found {position}"
                            )));
                        }
                        put_floats(record, place, stored.to_array());
                        let stored = stored.as_dvec3();
                        if stored.is_finite() {
                            report.position_error((stored - own).abs().max_element());
                            let [low, high] = bounds.unwrap_or([stored, stored]);
                            *bounds = Some([low.min(stored), high.max(stored)]);
                        }
                    }
                }
                Field::CodedNormal => {
                    let values = &find(batch, column.name, 3)?.values;
                    for (record, normal) in records.zip(vectors(values)) {
                        let code = Cube::Cub32.encode(normal);
                        put(record, place, &code.to_be_bytes());
                        if let Some(unit) = normal.try_normalize() {
                            let stored = Cube::Cub32.decode(code).unwrap_or_default();
                            report.normal_error((stored - unit).length());
                        }
                    }
                }
                Field::FloatNormal => floats(records, batch, (column.name, place), 3, report)?,
                Field::Floats { components, behind } => {
                    floats(records, batch, (column.name, place + behind), components, report)?;
                }
                Field::Color => colors(records, batch, (column.name, place), report)?,
                Field::Plain(plain) => numbers(records, batch, (plain, place), report)?,
            }
        }
        Ok(())
    }
}

fn put_floats(record: &mut [u8], place: usize, values: [f32; 3]) {
    put(record, place, values.map(f32::to_be_bytes).as_flattened());
}

/// The values of a column as vectors.
fn vectors<'a>(values: &'a Values<'_>) -> impl Iterator<Item = DVec3> + 'a {
    let mut values = values.iter_f64();
    std::iter::from_fn(move || Some(DVec3::new(values.next()?, values.next()?, values.next()?)))
}

/// A number as a 32-bit float, and whether that is what it was.
fn single(value: f64) -> (f32, bool) {
    let stored = value as f32;
    (stored, value.is_nan() || f64::from(stored) == value)
}

fn floats<'a>(
    records: impl Iterator<Item = &'a mut [u8]>,
    batch: &CloudView<'_>,
    (name, place): (&'static str, usize),
    components: usize,
    report: &mut Report,
) -> Result<()> {
    let mut values = find(batch, name, components)?.values.iter_f64();
    let mut all_exact = true;
    for record in records {
        for (i, value) in values.by_ref().take(components).enumerate() {
            let (stored, is_exact) = single(value);
            all_exact &= is_exact;
            put(record, place + 4 * i, &stored.to_be_bytes());
        }
    }
    if !all_exact {
        report.rounded(name, Stored::Float.rounding());
    }
    Ok(())
}

/// Stores a plain number; whether that is what it was.
fn put_number(record: &mut [u8], place: usize, stored: Stored, value: f64) -> bool {
    // Conversions of floats to whole numbers end at the ends of the type, and NaN becomes 0.
    match stored {
        Stored::Float => {
            let (single, is_exact) = single(value);
            put(record, place, &single.to_be_bytes());
            is_exact
        }
        Stored::Share => {
            let steps = value * 255.0;
            let byte = steps.round() as u8;
            put(record, place, &[byte]);
            (f64::from(byte) - steps).abs() <= SHARE_TOLERANCE
        }
        Stored::Byte => {
            let byte = value.round() as u8;
            put(record, place, &[byte]);
            f64::from(byte) == value
        }
        Stored::Short => {
            let short = value.round() as u16;
            put(record, place, &short.to_be_bytes());
            f64::from(short) == value
        }
        Stored::Word => {
            let word = value.round() as u32;
            put(record, place, &word.to_be_bytes());
            f64::from(word) == value
        }
    }
}

fn numbers<'a>(
    records: impl Iterator<Item = &'a mut [u8]>,
    batch: &CloudView<'_>,
    (plain, place): (Plain, usize),
    report: &mut Report,
) -> Result<()> {
    let mut values = find(batch, plain.column, plain.components)?.values.iter_f64();
    let mut all_exact = true;
    for record in records {
        for (i, value) in values.by_ref().take(plain.components).enumerate() {
            let place = place + i * plain.stored.size();
            all_exact &= put_number(record, place, plain.stored, value);
        }
    }
    if !all_exact {
        report.rounded(plain.column, plain.stored.rounding());
    }
    Ok(())
}

/// Stores colours: bytes as they are, 16-bit numbers by their upper half, floats as sRGB encodes them.
fn colors<'a>(
    records: impl Iterator<Item = &'a mut [u8]>,
    batch: &CloudView<'_>,
    (name, place): (&'static str, usize),
    report: &mut Report,
) -> Result<()> {
    let components = batch.column(name).map_or(3, |column| column.components as usize);
    let values = find(batch, name, components)?.values;
    let of = |i: usize| -> u8 {
        // Conversion to a byte ends at 0 and 255, and NaN becomes 0. Opacity is not encoded.
        match values {
            Values::U8(values) => values[i],
            Values::U16(values) => (f32::from(values[i]) / 257.0).round() as u8,
            Values::F32(values) if i % components == 3 => (values[i] * 255.0).round() as u8,
            Values::F32(values) => (linear_to_srgb(values[i]) * 255.0).round() as u8,
            _ => 0,
        }
    };
    for (row, record) in records.enumerate() {
        let mut rgba = [255; 4];
        for (channel, to) in rgba.iter_mut().enumerate().take(components) {
            *to = of(row * components + channel);
        }
        put(record, place, &rgba);
    }
    if !matches!(values, Values::U8(_)) {
        report.rounded(name, "8 bits of sRGB");
    }
    Ok(())
}
