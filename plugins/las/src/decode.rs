//! Point records to columns.

use crate::layout::{ANGLE_STEP, Layout, Source};
use crate::numbers::{Number, bytes, u16_at, u32_at};
use std::ops::Range;
use surfelshop_api::columns::{Element, Values};
use surfelshop_api::format::{BATCH, CloudSink};
use surfelshop_api::{Error, Result};

/// Records that are decoded for one column after the other: they stay in the innermost cache.
const BLOCK: usize = 512;

/// Values of a column.
#[derive(Debug)]
enum Buffer {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Calls the same code on the vector of any type.
macro_rules! each {
    ($buffer:expr, $vec:ident => $body:expr) => {
        match $buffer {
            Buffer::I8($vec) => $body,
            Buffer::U8($vec) => $body,
            Buffer::I16($vec) => $body,
            Buffer::U16($vec) => $body,
            Buffer::I32($vec) => $body,
            Buffer::U32($vec) => $body,
            Buffer::F32($vec) => $body,
            Buffer::F64($vec) => $body,
        }
    };
}

impl Buffer {
    fn new(element: Element) -> Self {
        match element {
            Element::I8 => Self::I8(Vec::new()),
            Element::U8 => Self::U8(Vec::new()),
            Element::I16 => Self::I16(Vec::new()),
            Element::U16 => Self::U16(Vec::new()),
            Element::I32 => Self::I32(Vec::new()),
            Element::U32 => Self::U32(Vec::new()),
            Element::F32 => Self::F32(Vec::new()),
            Element::F64 => Self::F64(Vec::new()),
        }
    }

    /// Makes room for so many values; what is there stays.
    fn reach(&mut self, n: usize) -> Result<()> {
        each!(self, vec => if vec.len() < n {
            vec.try_reserve(n - vec.len())?;
            vec.resize(n, Default::default());
        });
        Ok(())
    }

    fn values(&self, range: Range<usize>) -> Values<'_> {
        match self {
            Self::I8(vec) => Values::I8(&vec[range]),
            Self::U8(vec) => Values::U8(&vec[range]),
            Self::I16(vec) => Values::I16(&vec[range]),
            Self::U16(vec) => Values::U16(&vec[range]),
            Self::I32(vec) => Values::I32(&vec[range]),
            Self::U32(vec) => Values::U32(&vec[range]),
            Self::F32(vec) => Values::F32(&vec[range]),
            Self::F64(vec) => Values::F64(&vec[range]),
        }
    }
}

/// Columns that are filled from records, and then handed over.
pub(crate) struct Columns<'a> {
    layout: &'a Layout,
    buffers: Vec<Buffer>,
    n_rows: usize,
}

impl<'a> Columns<'a> {
    /// Columns without points.
    pub(crate) fn new(layout: &'a Layout) -> Self {
        let buffers = layout.columns.iter().map(|column| Buffer::new(column.file.element));
        Self { layout, buffers: buffers.collect(), n_rows: 0 }
    }

    /// Number of points.
    pub(crate) fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Takes all points out; their memory stays.
    pub(crate) fn clear(&mut self) {
        self.n_rows = 0;
    }

    /// Adds points from whole records.
    ///
    /// # Errors
    /// Where there is no memory for them.
    pub(crate) fn push(&mut self, records: &[u8]) -> Result<()> {
        let len = self.layout.record_len;
        let n_rows = self.n_rows + records.len() / len;
        for (column, buffer) in self.layout.columns.iter().zip(&mut self.buffers) {
            buffer.reach(n_rows * column.file.components as usize)?;
        }
        for block in records.chunks(BLOCK * len) {
            let rows = self.n_rows..self.n_rows + block.len() / len;
            for (column, buffer) in self.layout.columns.iter().zip(&mut self.buffers) {
                let n = column.file.components as usize;
                decode(&column.source, block, len, buffer, rows.start * n..rows.end * n)?;
            }
            self.n_rows = rows.end;
        }
        Ok(())
    }

    /// Hands the points over, in batches.
    ///
    /// # Errors
    /// As [`CloudSink::batch`].
    pub(crate) fn hand_over(&self, clouds: &mut CloudSink<'_>) -> Result<()> {
        let mut values = Vec::with_capacity(self.buffers.len());
        for start in (0..self.n_rows).step_by(BATCH) {
            let end = (start + BATCH).min(self.n_rows);
            values.clear();
            for (column, buffer) in self.layout.columns.iter().zip(&self.buffers) {
                let n = column.file.components as usize;
                values.push(buffer.values(start * n..end * n));
            }
            clouds.batch(&values)?;
        }
        Ok(())
    }
}

/// Fills a range of a column from records.
fn decode(
    source: &Source,
    records: &[u8],
    len: usize,
    buffer: &mut Buffer,
    range: Range<usize>,
) -> Result<()> {
    match (source, buffer) {
        (Source::Position { scale, offset }, Buffer::F64(vec)) => {
            let (scale, offset) = (scale.to_array(), offset.to_array());
            for (point, record) in vec[range].chunks_exact_mut(3).zip(records.chunks_exact(len)) {
                let whole: [u8; 12] = bytes(record, 0);
                for (axis, value) in point.iter_mut().enumerate() {
                    *value =
                        f64::from(u32_at(&whole, 4 * axis) as i32) * scale[axis] + offset[axis];
                }
            }
        }
        (&Source::Bits { at, shift, mask }, Buffer::U8(vec)) => {
            one(&mut vec[range], records, len, |record| {
                let [byte] = bytes(record, at);
                byte >> shift & mask
            });
        }
        (&Source::Degrees { at }, Buffer::F32(vec)) => {
            one(&mut vec[range], records, len, |record| {
                f32::from(i8::from_le_bytes(bytes(record, at)))
            });
        }
        (&Source::Steps { at }, Buffer::F32(vec)) => {
            let angle = |record: &[u8]| (f64::from(u16_at(record, at) as i16) * ANGLE_STEP) as f32;
            one(&mut vec[range], records, len, angle);
        }
        (Source::Plain { number, places }, buffer) => {
            return plain(*number, places, records, len, buffer, range);
        }
        (Source::Scaled { number, components }, Buffer::F64(vec)) => {
            let points = vec[range].chunks_exact_mut(components.len());
            for (point, record) in points.zip(records.chunks_exact(len)) {
                for (value, part) in point.iter_mut().zip(components) {
                    *value = number.read(record, part.at) * part.scale + part.offset;
                }
            }
        }
        _ => return Err(mistyped()),
    }
    Ok(())
}

/// Fills a column of one component.
fn one<T>(out: &mut [T], records: &[u8], len: usize, value: impl Fn(&[u8]) -> T) {
    for (out, record) in out.iter_mut().zip(records.chunks_exact(len)) {
        *out = value(record);
    }
}

/// Fills a column with numbers as they are.
fn plain(
    number: Number,
    places: &[usize],
    records: &[u8],
    len: usize,
    buffer: &mut Buffer,
    range: Range<usize>,
) -> Result<()> {
    macro_rules! gathered {
        ($($variant:ident $type:ty),*) => {
            match (number, buffer) {
                $((Number::$variant, Buffer::$variant(vec)) => {
                    let out = &mut vec[range];
                    match *places {
                        [at] => one(out, records, len, |record| {
                            <$type>::from_le_bytes(bytes(record, at))
                        }),
                        [a, b, c] => {
                            let points = out.chunks_exact_mut(3).zip(records.chunks_exact(len));
                            for (point, record) in points {
                                point[0] = <$type>::from_le_bytes(bytes(record, a));
                                point[1] = <$type>::from_le_bytes(bytes(record, b));
                                point[2] = <$type>::from_le_bytes(bytes(record, c));
                            }
                        }
                        _ => {
                            let points = out.chunks_exact_mut(places.len());
                            for (point, record) in points.zip(records.chunks_exact(len)) {
                                for (value, &at) in point.iter_mut().zip(places) {
                                    *value = <$type>::from_le_bytes(bytes(record, at));
                                }
                            }
                        }
                    }
                })*
                _ => return Err(mistyped()),
            }
        };
    }
    gathered!(U8 u8, I8 i8, U16 u16, I16 i16, U32 u32, I32 i32, F32 f32, F64 f64);
    Ok(())
}

/// What is said where a column has another type than its source; layouts have none such.
fn mistyped() -> Error {
    Error::new("a column has another type than its field")
}
