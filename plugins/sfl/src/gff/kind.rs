//! Types of values, as entries have them.

/// Unsigned bytes.
pub(crate) const U8: u16 = 0;
/// Signed bytes.
pub(crate) const I8: u16 = 1;
/// Unsigned 16-bit numbers.
pub(crate) const U16: u16 = 2;
/// Signed 16-bit numbers.
pub(crate) const I16: u16 = 3;
/// Unsigned 32-bit numbers.
pub(crate) const U32: u16 = 4;
/// Signed 32-bit numbers.
pub(crate) const I32: u16 = 5;
/// 32-bit floats.
pub(crate) const F32: u16 = 6;
/// 64-bit floats.
pub(crate) const F64: u16 = 7;
/// Text; the count includes a zero at the end.
pub(crate) const ASCII: u16 = 8;
/// Bytes of an application.
pub(crate) const APPLICATION: u16 = 9;
/// A large block of data: count in bytes, value always an offset.
pub(crate) const DATA: u16 = 10;
/// An offset.
pub(crate) const OFFSET: u16 = 11;
/// Two offsets, in the places of count and value.
pub(crate) const OFFSETS: u16 = 12;

/// Bytes of one value; `None` of types that have no values.
pub(crate) fn size(kind: u16) -> Option<u64> {
    match kind {
        U8 | I8 | ASCII | APPLICATION => Some(1),
        U16 | I16 => Some(2),
        U32 | I32 | F32 | OFFSET => Some(4),
        F64 => Some(8),
        _ => None,
    }
}
