//! Values of columns, of any type, as numbers and as bytes.

use surfelshop_api::columns::Values;

/// Calls the same code on the slice of any type.
macro_rules! each_type {
    ($values:expr, $slice:ident => $body:expr) => {
        match $values {
            surfelshop_api::columns::Values::I8($slice) => $body,
            surfelshop_api::columns::Values::U8($slice) => $body,
            surfelshop_api::columns::Values::I16($slice) => $body,
            surfelshop_api::columns::Values::U16($slice) => $body,
            surfelshop_api::columns::Values::I32($slice) => $body,
            surfelshop_api::columns::Values::U32($slice) => $body,
            surfelshop_api::columns::Values::F32($slice) => $body,
            surfelshop_api::columns::Values::F64($slice) => $body,
        }
    };
}
pub(super) use each_type;

/// A number of a column.
pub(super) trait Value: Copy {
    /// The number, exactly.
    fn number(self) -> f64;
    /// Writes the bytes, least significant first, to where they fit.
    fn put(self, bytes: &mut [u8]);
}

macro_rules! value {
    ($($type:ty),*) => {
        $(impl Value for $type {
            #[inline]
            fn number(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn put(self, bytes: &mut [u8]) {
                let own = self.to_le_bytes();
                if let Some(bytes) = bytes.first_chunk_mut() {
                    *bytes = own;
                }
            }
        })*
    };
}
value!(i8, u8, i16, u16, i32, u32, f32, f64);

/// Whether all values satisfy a condition.
pub(super) fn all(values: &Values<'_>, is_right: impl Fn(f64) -> bool) -> bool {
    each_type!(values, slice => slice.iter().all(|value| is_right(value.number())))
}
