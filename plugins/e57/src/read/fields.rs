//! Fields of a scan's points, as its prototype declares them, and their values.

use crate::read::bits::unpack;
use e57::{Record, RecordDataType, RecordName};

/// How values of a field are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// 32-bit floats.
    F32,
    /// 64-bit floats.
    F64,
    /// Whole numbers, stored as their distance from `min`.
    Whole { min: i64, max: i64 },
    /// Whole numbers of steps from `offset`, stored as [`Whole`](Self::Whole).
    Steps { min: i64, max: i64, step: f64, offset: f64 },
}

/// A field.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) name: RecordName,
    pub(crate) kind: Kind,
    /// Bits of a value; none where all are the same.
    pub(crate) bits: u32,
    /// Smallest and largest value, where the file says so.
    limits: Option<[f64; 2]>,
}

impl Field {
    pub(crate) fn new(record: &Record) -> Self {
        let kind = match record.data_type {
            RecordDataType::Single { .. } => Kind::F32,
            RecordDataType::Double { .. } => Kind::F64,
            RecordDataType::Integer { min, max } => Kind::Whole { min, max },
            RecordDataType::ScaledInteger { min, max, scale, offset } => {
                Kind::Steps { min, max, step: scale, offset }
            }
        };
        let bits = match kind {
            Kind::F32 => 32,
            Kind::F64 => 64,
            Kind::Whole { min, max } | Kind::Steps { min, max, .. } => {
                u64::BITS - range(min, max).leading_zeros()
            }
        };
        let mut field = Self { name: record.name.clone(), kind, bits, limits: None };
        field.limits = match record.data_type {
            RecordDataType::Single { min, max } => {
                min.zip(max).map(|(min, max)| [f64::from(min), f64::from(max)])
            }
            RecordDataType::Double { min, max } => min.zip(max).map(|(min, max)| [min, max]),
            RecordDataType::Integer { min, max }
            | RecordDataType::ScaledInteger { min, max, .. } => {
                let ends = [field.scaled(min), field.scaled(max)];
                Some([ends[0].min(ends[1]), ends[0].max(ends[1])])
            }
        };
        field
    }

    /// Smallest and largest value, where the file says so.
    pub(crate) fn limits(&self) -> Option<[f64; 2]> {
        self.limits
    }

    /// Whether values are whole numbers.
    pub(crate) fn is_whole(&self) -> bool {
        matches!(self.kind, Kind::Whole { .. })
    }

    /// The value of a whole number as it is stored.
    pub(crate) fn scaled(&self, value: i64) -> f64 {
        match self.kind {
            Kind::Steps { step, offset, .. } => value as f64 * step + offset,
            _ => value as f64,
        }
    }

    /// Calls `put` with the values of a stream from bit `first` on.
    pub(crate) fn floats(
        &self,
        bytes: &[u8],
        first: usize,
        n: usize,
        mut put: impl FnMut(usize, f64),
    ) {
        match self.kind {
            Kind::F32 => {
                unpack(bytes, first, 32, n, |i, word| {
                    put(i, f64::from(f32::from_bits(word as u32)))
                });
            }
            Kind::F64 => unpack(bytes, first, 64, n, |i, word| put(i, f64::from_bits(word))),
            Kind::Whole { min, .. } => {
                unpack(bytes, first, self.bits, n, |i, word| put(i, from_min(min, word) as f64));
            }
            Kind::Steps { min, step, offset, .. } => {
                unpack(bytes, first, self.bits, n, |i, word| {
                    put(i, from_min(min, word) as f64 * step + offset);
                });
            }
        }
    }

    /// Calls `put` with the values of a stream from bit `first` on as whole numbers; floats lose their fraction.
    pub(crate) fn whole(
        &self,
        bytes: &[u8],
        first: usize,
        n: usize,
        mut put: impl FnMut(usize, i64),
    ) {
        match self.kind {
            Kind::Whole { min, .. } => {
                unpack(bytes, first, self.bits, n, |i, word| put(i, from_min(min, word)));
            }
            // A cast of a float ends at the ends of the range, and is 0 for NaN.
            _ => self.floats(bytes, first, n, |i, value| put(i, value as i64)),
        }
    }
}

/// The largest distance from `min`.
fn range(min: i64, max: i64) -> u64 {
    // The difference of two i64 of which the second is not the smaller has 64 bits.
    max.max(min).wrapping_sub(min) as u64
}

/// A number from its distance; what damage makes larger than `i64` holds begins at the smallest again.
fn from_min(min: i64, distance: u64) -> i64 {
    min.wrapping_add(distance as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(data_type: RecordDataType) -> Field {
        Field::new(&Record { name: RecordName::Intensity, data_type })
    }

    #[test]
    fn widths_are_those_of_the_range() {
        let whole = |min, max| field(RecordDataType::Integer { min, max }).bits;
        assert_eq!([whole(0, 0), whole(0, 1), whole(0, 2), whole(-1, 254)], [0, 1, 2, 8]);
        assert_eq!([whole(0, 256), whole(i64::MIN, i64::MAX), whole(0, i64::MAX)], [9, 64, 63]);
    }

    #[test]
    fn values_count_from_the_smallest_and_in_steps() {
        let mut found = Vec::new();
        let whole = field(RecordDataType::Integer { min: -3, max: 12 });
        whole.whole(&[0x50], 0, 2, |_, value| found.push(value as f64));
        let steps =
            field(RecordDataType::ScaledInteger { min: -3, max: 12, scale: 0.5, offset: 10.0 });
        steps.floats(&[0x50], 0, 2, |_, value| found.push(value));
        let widest = field(RecordDataType::Integer { min: i64::MIN, max: i64::MAX });
        widest.whole(&[0xff; 8], 0, 1, |_, value| assert_eq!(value, i64::MAX));
        field(RecordDataType::F32)
            .whole(&(-2.5f32).to_le_bytes(), 0, 1, |_, value| found.push(value as f64));
        assert_eq!(found, [-3.0, 2.0, 8.5, 11.0, -2.0]);
        assert_eq!(steps.limits(), Some([8.5, 16.0]));
    }
}
