//! Values of a column in their own type, and numbers of files turned into them.

use surfelshop_api::columns::{Element, Values};

/// A number that a column is made of.
pub(crate) trait Number: Copy + Default {
    /// The nearest number to a whole one, and whether it is the same.
    fn of_whole(value: i64) -> (Self, bool);
    /// The nearest number to a float; 0 for NaN where there is none.
    fn of_float(value: f64) -> Self;
}

macro_rules! whole_numbers {
    ($($T:ty),*) => {$(
        impl Number for $T {
            fn of_whole(value: i64) -> (Self, bool) {
                let nearest = value.clamp(i64::from(Self::MIN), i64::from(Self::MAX));
                // It was brought into the range of the type.
                (nearest as Self, nearest == value)
            }

            fn of_float(value: f64) -> Self {
                // A cast of a float ends at the ends of the range, and is 0 for NaN.
                value.round() as Self
            }
        }
    )*};
}

macro_rules! floats {
    ($($T:ty),*) => {$(
        impl Number for $T {
            fn of_whole(value: i64) -> (Self, bool) {
                (value as Self, true)
            }

            fn of_float(value: f64) -> Self {
                value as Self
            }
        }
    )*};
}

whole_numbers!(i8, u8, i16, u16, i32, u32);
floats!(f32, f64);

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Buffer {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Runs an expression on the values of a buffer, whatever their type is.
macro_rules! with_values {
    ($buffer:expr, $values:ident => $body:expr) => {
        match $buffer {
            $crate::element::Buffer::I8($values) => $body,
            $crate::element::Buffer::U8($values) => $body,
            $crate::element::Buffer::I16($values) => $body,
            $crate::element::Buffer::U16($values) => $body,
            $crate::element::Buffer::I32($values) => $body,
            $crate::element::Buffer::U32($values) => $body,
            $crate::element::Buffer::F32($values) => $body,
            $crate::element::Buffer::F64($values) => $body,
        }
    };
}
pub(crate) use with_values;

impl Buffer {
    /// So many zeros.
    pub(crate) fn zeros(element: Element, len: usize) -> Self {
        match element {
            Element::I8 => Self::I8(vec![0; len]),
            Element::U8 => Self::U8(vec![0; len]),
            Element::I16 => Self::I16(vec![0; len]),
            Element::U16 => Self::U16(vec![0; len]),
            Element::I32 => Self::I32(vec![0; len]),
            Element::U32 => Self::U32(vec![0; len]),
            Element::F32 => Self::F32(vec![0.0; len]),
            Element::F64 => Self::F64(vec![0.0; len]),
        }
    }

    /// A copy of borrowed values.
    pub(crate) fn of(values: &Values<'_>) -> Self {
        match *values {
            Values::I8(values) => Self::I8(values.to_vec()),
            Values::U8(values) => Self::U8(values.to_vec()),
            Values::I16(values) => Self::I16(values.to_vec()),
            Values::U16(values) => Self::U16(values.to_vec()),
            Values::I32(values) => Self::I32(values.to_vec()),
            Values::U32(values) => Self::U32(values.to_vec()),
            Values::F32(values) => Self::F32(values.to_vec()),
            Values::F64(values) => Self::F64(values.to_vec()),
        }
    }

    /// The values as the host takes them.
    pub(crate) fn values(&self) -> Values<'_> {
        match self {
            Self::I8(values) => Values::I8(values),
            Self::U8(values) => Values::U8(values),
            Self::I16(values) => Values::I16(values),
            Self::U16(values) => Values::U16(values),
            Self::I32(values) => Values::I32(values),
            Self::U32(values) => Values::U32(values),
            Self::F32(values) => Values::F32(values),
            Self::F64(values) => Values::F64(values),
        }
    }

    /// Makes room for so many values; what they are is not told.
    pub(crate) fn resize(&mut self, len: usize) {
        with_values!(self, values => values.resize(len, Default::default()));
    }

    /// Leaves out the points of which `keep` is false.
    pub(crate) fn retain(&mut self, components: usize, keep: &[bool]) {
        with_values!(self, values => {
            let (mut first, mut n_kept) = (0, 0);
            for run in keep.chunk_by(|a, b| a == b) {
                let len = components * run.len();
                if run[0] {
                    values.copy_within(first..first + len, n_kept);
                    n_kept += len;
                }
                first += len;
            }
            values.truncate(n_kept);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_end_at_the_ends_of_their_type() {
        assert_eq!(u8::of_whole(300), (255, false));
        assert_eq!(u32::of_whole(-1), (0, false));
        assert_eq!(i16::of_whole(-7), (-7, true));
        assert_eq!([u8::of_float(254.5), u8::of_float(-3.0), u8::of_float(f64::NAN)], [255, 0, 0]);
    }

    #[test]
    fn points_are_left_out_with_all_their_components() {
        let mut buffer = Buffer::U8((0..8).collect());
        buffer.retain(2, &[false, true, false, true]);
        assert_eq!(buffer, Buffer::U8(vec![2, 3, 6, 7]));
    }
}
