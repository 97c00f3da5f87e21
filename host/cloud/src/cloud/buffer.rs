//! Owned values of a column, of any element type.

use crate::memory::{OutOfMemory, ask, grow, with_room};
use rayon::prelude::*;
use std::ops::Range;
use surfelshop_api::columns::{Element, Values};

/// Owned values of one element type.
#[derive(Clone, Debug, PartialEq)]
pub enum Buffer {
    /// Signed 8-bit integers.
    I8(Vec<i8>),
    /// Unsigned 8-bit integers.
    U8(Vec<u8>),
    /// Signed 16-bit integers.
    I16(Vec<i16>),
    /// Unsigned 16-bit integers.
    U16(Vec<u16>),
    /// Signed 32-bit integers.
    I32(Vec<i32>),
    /// Unsigned 32-bit integers.
    U32(Vec<u32>),
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
}

/// Evaluates an expression for the vector of whatever type a buffer holds.
macro_rules! with_vec {
    ($buffer:expr, $vec:ident => $body:expr) => {
        match $buffer {
            $crate::cloud::buffer::Buffer::I8($vec) => $body,
            $crate::cloud::buffer::Buffer::U8($vec) => $body,
            $crate::cloud::buffer::Buffer::I16($vec) => $body,
            $crate::cloud::buffer::Buffer::U16($vec) => $body,
            $crate::cloud::buffer::Buffer::I32($vec) => $body,
            $crate::cloud::buffer::Buffer::U32($vec) => $body,
            $crate::cloud::buffer::Buffer::F32($vec) => $body,
            $crate::cloud::buffer::Buffer::F64($vec) => $body,
        }
    };
}
pub(crate) use with_vec;

/// Evaluates to a buffer of the same type, made from its vector.
macro_rules! map_vec {
    ($buffer:expr, $vec:ident => $body:expr) => {
        match $buffer {
            Buffer::I8($vec) => Buffer::I8($body),
            Buffer::U8($vec) => Buffer::U8($body),
            Buffer::I16($vec) => Buffer::I16($body),
            Buffer::U16($vec) => Buffer::U16($body),
            Buffer::I32($vec) => Buffer::I32($body),
            Buffer::U32($vec) => Buffer::U32($body),
            Buffer::F32($vec) => Buffer::F32($body),
            Buffer::F64($vec) => Buffer::F64($body),
        }
    };
}

impl Buffer {
    /// An empty buffer of this type with room for `capacity` elements.
    #[must_use]
    pub fn with_capacity(element: Element, capacity: usize) -> Self {
        match element {
            Element::I8 => Self::I8(Vec::with_capacity(capacity)),
            Element::U8 => Self::U8(Vec::with_capacity(capacity)),
            Element::I16 => Self::I16(Vec::with_capacity(capacity)),
            Element::U16 => Self::U16(Vec::with_capacity(capacity)),
            Element::I32 => Self::I32(Vec::with_capacity(capacity)),
            Element::U32 => Self::U32(Vec::with_capacity(capacity)),
            Element::F32 => Self::F32(Vec::with_capacity(capacity)),
            Element::F64 => Self::F64(Vec::with_capacity(capacity)),
        }
    }

    /// The same, where there is memory for it.
    pub(crate) fn with_room(element: Element, capacity: usize) -> Result<Self, OutOfMemory> {
        Ok(match element {
            Element::I8 => Self::I8(with_room(capacity)?),
            Element::U8 => Self::U8(with_room(capacity)?),
            Element::I16 => Self::I16(with_room(capacity)?),
            Element::U16 => Self::U16(with_room(capacity)?),
            Element::I32 => Self::I32(with_room(capacity)?),
            Element::U32 => Self::U32(with_room(capacity)?),
            Element::F32 => Self::F32(with_room(capacity)?),
            Element::F64 => Self::F64(with_room(capacity)?),
        })
    }

    /// Values from bytes, least significant first; an incomplete last value is left out.
    #[must_use]
    pub fn from_little_endian(element: Element, bytes: &[u8]) -> Self {
        let mut buffer = Self::with_capacity(element, bytes.len() / element.size());
        buffer.extend_records(bytes, element.size(), 0..element.size(), false);
        buffer
    }

    /// Appends the values in the bytes `within` each record of `stride` bytes; an incomplete last
    /// record is left out.
    pub(crate) fn extend_records(
        &mut self,
        records: &[u8],
        stride: usize,
        within: Range<usize>,
        big: bool,
    ) {
        // Two calls, since a choice of the function at run time would keep it out of the loop.
        macro_rules! extend {
            ($vec:ident, $type:ty) => {
                if big {
                    extend_fields($vec, records, stride, within, <$type>::from_be_bytes)
                } else {
                    extend_fields($vec, records, stride, within, <$type>::from_le_bytes)
                }
            };
        }
        match self {
            Self::I8(vec) => extend!(vec, i8),
            Self::U8(vec) => extend!(vec, u8),
            Self::I16(vec) => extend!(vec, i16),
            Self::U16(vec) => extend!(vec, u16),
            Self::I32(vec) => extend!(vec, i32),
            Self::U32(vec) => extend!(vec, u32),
            Self::F32(vec) => extend!(vec, f32),
            Self::F64(vec) => extend!(vec, f64),
        }
    }

    /// Removes all elements; the memory stays.
    pub(crate) fn clear(&mut self) {
        with_vec!(self, vec => vec.clear());
    }

    /// Appends values of the same type; of another, none.
    ///
    /// # Errors
    /// Where there is no memory for them.
    pub fn append(&mut self, values: &Values<'_>) -> Result<(), OutOfMemory> {
        macro_rules! append {
            ($($variant:ident),*) => {
                match (self, values) {
                    $((Self::$variant(vec), Values::$variant(more)) => {
                        grow(vec, more.len())?;
                        vec.extend_from_slice(more);
                    })*
                    _ => {}
                }
            };
        }
        append!(I8, U8, I16, U16, I32, U32, F32, F64);
        Ok(())
    }

    /// The values, borrowed.
    #[must_use]
    pub fn as_values(&self) -> Values<'_> {
        match self {
            Self::I8(vec) => Values::I8(vec),
            Self::U8(vec) => Values::U8(vec),
            Self::I16(vec) => Values::I16(vec),
            Self::U16(vec) => Values::U16(vec),
            Self::I32(vec) => Values::I32(vec),
            Self::U32(vec) => Values::U32(vec),
            Self::F32(vec) => Values::F32(vec),
            Self::F64(vec) => Values::F64(vec),
        }
    }

    /// The element type.
    #[must_use]
    pub fn element(&self) -> Element {
        self.as_values().element()
    }

    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        with_vec!(self, vec => vec.len())
    }

    /// Whether there are no elements.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The elements as f64, which holds all of them exactly.
    pub(crate) fn iter_f64(&self) -> Box<dyn Iterator<Item = f64> + '_> {
        macro_rules! widen {
            ($vec:ident) => {
                Box::new($vec.iter().map(|&value| f64::from(value)))
            };
        }
        with_vec!(self, vec => widen!(vec))
    }

    /// One element as f64; `None` where there is no such.
    #[must_use]
    pub fn get_f64(&self, index: usize) -> Option<f64> {
        macro_rules! widen {
            ($vec:ident) => {
                $vec.get(index).map(|&value| f64::from(value))
            };
        }
        with_vec!(self, vec => widen!(vec))
    }

    /// The elements as f32, rounded to the nearest; beyond its range they become infinite.
    pub(crate) fn to_f32(&self) -> Vec<f32> {
        match self {
            Self::F32(vec) => vec.clone(),
            other => other.iter_f64().map(|value| value as f32).collect(),
        }
    }

    /// [`Buffer::to_f32`], without a copy where the elements are f32.
    pub(crate) fn into_f32(self) -> Vec<f32> {
        match self {
            Self::F32(vec) => vec,
            other => other.to_f32(),
        }
    }

    /// The surfels whose entry in `mask` is true; each has `components` elements.
    #[must_use]
    pub(crate) fn select(&self, components: usize, mask: &[bool]) -> Self {
        let n = mask.iter().filter(|keep| **keep).count();
        map_vec!(self, vec => {
            let mut selected = Vec::with_capacity(n * components);
            for (surfel, keep) in vec.chunks_exact(components).zip(mask) {
                if *keep {
                    selected.extend_from_slice(surfel);
                }
            }
            selected
        })
    }

    /// The surfels of these indices, each of which must be there, where there is memory for them.
    ///
    /// # Errors
    /// Where there is no memory.
    ///
    /// # Panics
    /// Where an index is that of no surfel.
    pub fn gather(&self, components: usize, rows: &[u32]) -> Result<Self, OutOfMemory> {
        let bytes = self.element().size().saturating_mul(components) as u64;
        ask(bytes.saturating_mul(rows.len() as u64))?;
        Ok(map_vec!(self, vec => gathered(vec, components, rows)))
    }

    /// Appends a number read as text or as f64; whether it fits the type.
    pub fn push(&mut self, value: f64) -> bool {
        macro_rules! push_int {
            ($vec:ident, $type:ty) => {{
                let fits = value.fract() == 0.0
                    && value >= f64::from(<$type>::MIN)
                    && value <= f64::from(<$type>::MAX);
                $vec.push(value as $type);
                fits
            }};
        }
        match self {
            Self::I8(vec) => push_int!(vec, i8),
            Self::U8(vec) => push_int!(vec, u8),
            Self::I16(vec) => push_int!(vec, i16),
            Self::U16(vec) => push_int!(vec, u16),
            Self::I32(vec) => push_int!(vec, i32),
            Self::U32(vec) => push_int!(vec, u32),
            Self::F32(vec) => {
                vec.push(value as f32);
                true
            }
            Self::F64(vec) => {
                vec.push(value);
                true
            }
        }
    }
}

/// Appends the values in the bytes `within` each record. A number of values that the compiler
/// knows makes straight moves of each record.
fn extend_fields<T: Copy + Default, const SIZE: usize>(
    values: &mut Vec<T>,
    records: &[u8],
    stride: usize,
    within: Range<usize>,
    decode: impl Fn([u8; SIZE]) -> T,
) {
    match within.len() / SIZE {
        1 => extend_rows::<T, SIZE, 1>(values, records, stride, within.start, decode),
        3 => extend_rows::<T, SIZE, 3>(values, records, stride, within.start, decode),
        4 => extend_rows::<T, SIZE, 4>(values, records, stride, within.start, decode),
        _ => {
            for record in records.chunks_exact(stride) {
                let (found, _) = record[within.clone()].as_chunks();
                values.extend(found.iter().map(|bytes| decode(*bytes)));
            }
        }
    }
}

/// Appends `N` values from `offset` in each record.
fn extend_rows<T: Copy + Default, const SIZE: usize, const N: usize>(
    values: &mut Vec<T>,
    records: &[u8],
    stride: usize,
    offset: usize,
    decode: impl Fn([u8; SIZE]) -> T,
) {
    let records = records.chunks_exact(stride);
    let start = values.len();
    values.resize(start + records.len() * N, T::default());
    let (rows, _) = values[start..].as_chunks_mut::<N>();
    for (row, record) in rows.iter_mut().zip(records) {
        let (found, _) = record[offset..offset + N * SIZE].as_chunks::<SIZE>();
        *row = std::array::from_fn(|i| decode(found[i]));
    }
}

/// The elements of some surfels.
fn gathered<T: Copy + Default + Send + Sync>(
    values: &[T],
    components: usize,
    rows: &[u32],
) -> Vec<T> {
    /// Surfels that are worth a thread.
    const LEAST: usize = 1 << 14;
    let mut gathered = vec![T::default(); rows.len() * components];
    let places = gathered.par_chunks_exact_mut(components).zip(rows).with_min_len(LEAST);
    places.for_each(|(place, &row)| {
        let first = row as usize * components;
        place.copy_from_slice(&values[first..first + components]);
    });
    gathered
}

/// The columns that a buffer of `components` values per row consists of.
pub(crate) fn unweave(woven: &Buffer, components: usize) -> Vec<Buffer> {
    (0..components)
        .map(|i| map_vec!(woven, vec => vec.iter().skip(i).step_by(components).copied().collect()))
        .collect()
}

/// Weaves buffers of one type into one whose surfels have all their elements together; `None` where
/// types or lengths differ or there are none.
pub(crate) fn interleave(parts: &[Buffer]) -> Option<Buffer> {
    let first = parts.first()?;
    if parts.iter().any(|p| p.element() != first.element() || p.len() != first.len()) {
        return None;
    }
    macro_rules! weave {
        ($variant:ident) => {{
            let mut slices = Vec::with_capacity(parts.len());
            for part in parts {
                if let Buffer::$variant(vec) = part {
                    slices.push(vec.as_slice());
                }
            }
            let mut woven = Vec::with_capacity(first.len() * parts.len());
            for i in 0..first.len() {
                woven.extend(slices.iter().map(|slice| slice[i]));
            }
            Buffer::$variant(woven)
        }};
    }
    Some(match first {
        Buffer::I8(_) => weave!(I8),
        Buffer::U8(_) => weave!(U8),
        Buffer::I16(_) => weave!(I16),
        Buffer::U16(_) => weave!(U16),
        Buffer::I32(_) => weave!(I32),
        Buffer::U32(_) => weave!(U32),
        Buffer::F32(_) => weave!(F32),
        Buffer::F64(_) => weave!(F64),
    })
}
