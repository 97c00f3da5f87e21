//! Numbers in little-endian bytes, and their types as LAS files name them.

use surfelshop_api::columns::Element;

/// `N` bytes of a record; zeros where it ends before them.
#[inline]
pub(crate) fn bytes<const N: usize>(record: &[u8], at: usize) -> [u8; N] {
    let part = at.checked_add(N).and_then(|end| record.get(at..end));
    part.and_then(|part| part.try_into().ok()).unwrap_or([0; N])
}

/// An unsigned number of two bytes; 0 behind the end.
pub(crate) fn u16_at(record: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes(record, at))
}

/// An unsigned number of four bytes; 0 behind the end.
pub(crate) fn u32_at(record: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes(record, at))
}

/// An unsigned number of eight bytes; 0 behind the end.
pub(crate) fn u64_at(record: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes(record, at))
}

/// A float of eight bytes; 0 behind the end.
pub(crate) fn f64_at(record: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(bytes(record, at))
}

/// The text of a field of fixed length, which ends at its first zero byte; control characters are left out.
pub(crate) fn text(field: &[u8]) -> String {
    let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
    let text = String::from_utf8_lossy(&field[..end]);
    text.trim().chars().filter(|letter| !letter.is_control()).collect()
}

/// Part of a file's bytes, empty where it is not there.
pub(crate) fn part(bytes: &[u8], at: usize, len: usize) -> &[u8] {
    let rest = bytes.get(at..).unwrap_or_default();
    &rest[..len.min(rest.len())]
}

/// The type of an extra-bytes field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Number {
    /// The types in the order of their codes, which start at 1.
    const ALL: [Self; 10] = [
        Self::U8,
        Self::I8,
        Self::U16,
        Self::I16,
        Self::U32,
        Self::I32,
        Self::U64,
        Self::I64,
        Self::F32,
        Self::F64,
    ];

    /// The type and the number of components of a code, 1 to 30; `None` for others.
    pub(crate) fn of_code(code: u8) -> Option<(Self, usize)> {
        let place = usize::from(code).checked_sub(1)?;
        let components = place / Self::ALL.len() + 1;
        (components <= 3).then(|| (Self::ALL[place % Self::ALL.len()], components))
    }

    /// The code of one number of a type that columns have.
    pub(crate) fn code_of(element: Element) -> u8 {
        match element {
            Element::U8 => 1,
            Element::I8 => 2,
            Element::U16 => 3,
            Element::I16 => 4,
            Element::U32 => 5,
            Element::I32 => 6,
            Element::F32 => 9,
            Element::F64 => 10,
        }
    }

    /// Bytes of a number.
    pub(crate) const fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The type of a column with such numbers; `None` for whole numbers of eight bytes.
    pub(crate) const fn element(self) -> Option<Element> {
        Some(match self {
            Self::U8 => Element::U8,
            Self::I8 => Element::I8,
            Self::U16 => Element::U16,
            Self::I16 => Element::I16,
            Self::U32 => Element::U32,
            Self::I32 => Element::I32,
            Self::F32 => Element::F32,
            Self::F64 => Element::F64,
            Self::U64 | Self::I64 => return None,
        })
    }

    /// A number of a record; whole numbers of eight bytes are rounded to the nearest `f64`.
    pub(crate) fn read(self, record: &[u8], at: usize) -> f64 {
        match self {
            Self::U8 => f64::from(u8::from_le_bytes(bytes(record, at))),
            Self::I8 => f64::from(i8::from_le_bytes(bytes(record, at))),
            Self::U16 => f64::from(u16_at(record, at)),
            Self::I16 => f64::from(i16::from_le_bytes(bytes(record, at))),
            Self::U32 => f64::from(u32_at(record, at)),
            Self::I32 => f64::from(i32::from_le_bytes(bytes(record, at))),
            Self::U64 => u64_at(record, at) as f64,
            Self::I64 => i64::from_le_bytes(bytes(record, at)) as f64,
            Self::F32 => f64::from(f32::from_le_bytes(bytes(record, at))),
            Self::F64 => f64_at(record, at),
        }
    }
}
