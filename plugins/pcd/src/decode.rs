//! Bytes of points as values of columns.

use crate::header::{Field, Kind};
use crate::layout::{Column, Origin};
use surfelshop_api::columns::{Element, Values};

/// Where the elements of a field lie: the first, and how far apart those of neighbouring points are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub start: usize,
    pub stride: usize,
}

/// Points in memory.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub bytes: &'a [u8],
    pub fields: &'a [Field],
    /// Where each field lies.
    pub places: &'a [Place],
    /// The first of them that are meant, and how many.
    pub first: usize,
    pub n: usize,
}

/// Elements of a field, the first at the beginning, the others a stride apart.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    kind: Kind,
    size: usize,
}

impl<'a> Rows<'a> {
    /// A component of a field.
    fn elements(&self, field: usize, component: usize) -> Elements<'a> {
        let (Field { kind, size, .. }, place) = (&self.fields[field], self.places[field]);
        let start = place.start + self.first * place.stride + component * size;
        let bytes = self.bytes.get(start..).unwrap_or_default();
        Elements { bytes, stride: place.stride, kind: *kind, size: *size }
    }
}

/// Values that a batch is made of.
pub(crate) enum Decoded {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Decoded {
    /// What the sink takes.
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
}

/// The values of a column.
pub(crate) fn decode(column: &Column, rows: &Rows<'_>) -> Decoded {
    match &column.origin {
        Origin::Packed(field) => Decoded::U8(unpacked(column, rows.elements(*field, 0), rows.n)),
        Origin::Fields(fields) => fields_of(column, fields, rows),
    }
}

fn unpacked(column: &Column, elements: Elements<'_>, n: usize) -> Vec<u8> {
    let components = column.column.components as usize;
    let mut out = vec![0; n * components];
    let words = elements.bytes.chunks(elements.stride.max(1));
    for (color, word) in out.chunks_exact_mut(components).zip(words) {
        if let Some(&[blue, green, red, alpha]) = word.first_chunk() {
            let channels = [red, green, blue, alpha];
            color.copy_from_slice(&channels[..components]);
        }
    }
    out
}

fn fields_of(column: &Column, fields: &[usize], rows: &Rows<'_>) -> Decoded {
    let components = column.column.components as usize;
    let sources: Vec<Elements<'_>> = match fields {
        [field] => (0..components).map(|component| rows.elements(*field, component)).collect(),
        several => several.iter().map(|&field| rows.elements(field, 0)).collect(),
    };
    macro_rules! whole {
        ($variant:ident, $type:ty) => {{
            let mut out = vec![0; rows.n * components];
            for (component, source) in sources.iter().enumerate() {
                gather(source, &mut out, component, components, <$type>::from_le_bytes);
            }
            Decoded::$variant(out)
        }};
    }
    match column.column.element {
        Element::I8 => whole!(I8, i8),
        Element::U8 => whole!(U8, u8),
        Element::I16 => whole!(I16, i16),
        Element::U16 => whole!(U16, u16),
        Element::I32 => whole!(I32, i32),
        Element::U32 => whole!(U32, u32),
        Element::F32 => {
            let mut out = vec![0.0; rows.n * components];
            for (component, source) in sources.iter().enumerate() {
                match (source.kind, source.size) {
                    (Kind::Float, 4) => {
                        gather(source, &mut out, component, components, f32::from_le_bytes);
                    }
                    _ => widened(source, &mut out, component, components, |value| value as f32),
                }
            }
            Decoded::F32(out)
        }
        Element::F64 => {
            let mut out = vec![0.0; rows.n * components];
            for (component, source) in sources.iter().enumerate() {
                widened(source, &mut out, component, components, |value| value);
            }
            Decoded::F64(out)
        }
    }
}

/// Puts elements of `N` bytes into one component of `out`.
fn gather<const N: usize, T>(
    source: &Elements<'_>,
    out: &mut [T],
    component: usize,
    components: usize,
    read: impl Fn([u8; N]) -> T,
) {
    let chunks = source.bytes.chunks(source.stride.max(1));
    for (values, chunk) in out.chunks_exact_mut(components).zip(chunks) {
        if let Some(bytes) = chunk.first_chunk() {
            values[component] = read(*bytes);
        }
    }
}

/// Puts elements of any type into one component of `out`, by way of f64, which holds all but large ones of 8 bytes.
fn widened<T>(
    source: &Elements<'_>,
    out: &mut [T],
    component: usize,
    components: usize,
    narrow: impl Fn(f64) -> T,
) {
    macro_rules! from {
        ($type:ty) => {
            gather(source, out, component, components, |bytes| {
                narrow(<$type>::from_le_bytes(bytes) as f64)
            })
        };
    }
    match (source.kind, source.size) {
        (Kind::Signed, 1) => from!(i8),
        (Kind::Signed, 2) => from!(i16),
        (Kind::Signed, 4) => from!(i32),
        (Kind::Signed, 8) => from!(i64),
        (Kind::Unsigned, 1) => from!(u8),
        (Kind::Unsigned, 2) => from!(u16),
        (Kind::Unsigned, 4) => from!(u32),
        (Kind::Unsigned, 8) => from!(u64),
        (Kind::Float, 4) => from!(f32),
        (Kind::Float, 8) => from!(f64),
        // The layout takes no such fields.
        _ => {}
    }
}
