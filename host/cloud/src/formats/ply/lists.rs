//! Binary elements with lists, whose records have no fixed size: read by `ply-rs-bw`, which caps
//! what it allocates for a list before it has seen its items.

use super::element::at_end;
use super::header::{ElementDef, Kind};
use crate::error::{ReadFault, quoted};
use crate::formats::body::Body;
use crate::table::Field;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{
    self, Addable, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use std::io::{Error, Read};
use surfelshop_api::columns::Element;
use surfelshop_geometry::Progress;

/// The scalars of a record in the order of its properties; f64 holds every type exactly.
struct Row(Vec<f64>);

macro_rules! keep {
    ($($set:ident: $type:ty),*) => {
        $(fn $set(&mut self, _name: &str, value: $type) -> PropertyAccessResult {
            self.0.push(f64::from(value));
            PropertyAccessResult::Set
        })*
    };
}

macro_rules! pass_over {
    ($($set:ident: $type:ty),*) => {
        $(fn $set(&mut self, _name: &str, _value: Vec<$type>) -> PropertyAccessResult {
            PropertyAccessResult::Ignored
        })*
    };
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self(Vec::new())
    }
    keep!(
        set_char: i8, set_uchar: u8, set_short: i16, set_ushort: u16,
        set_int: i32, set_uint: u32, set_float: f32, set_double: f64
    );
    pass_over!(
        set_list_char: i8, set_list_uchar: u8, set_list_short: i16, set_list_ushort: u16,
        set_list_int: i32, set_list_uint: u32, set_list_float: f32, set_list_double: f64
    );
}

/// Longest record, bytes: its lists are held in memory while it is read.
const MAX_RECORD: u64 = 64 << 20;

/// Records between two questions whether to stop.
const BLOCK: u64 = 4096;

/// Passes over an element.
pub(super) fn skip<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    each(body, element, big, progress, |_| ())
}

/// Appends the scalars of each record to their columns.
pub(super) fn read<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    fields: &mut [Field],
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    each(body, element, big, progress, |row| {
        for (field, value) in fields.iter_mut().zip(row.0) {
            // The value was read as the field's own type.
            field.values.push(value);
        }
    })
}

fn each<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    big: bool,
    progress: Progress<'_>,
    mut take: impl FnMut(Row),
) -> Result<(), ReadFault> {
    let parser = Parser::<Row>::new();
    let definition = definition(element);
    for record in 0..element.count {
        if record % BLOCK == 0 {
            body.report(progress)?;
        }
        let mut body = body.by_ref().take(MAX_RECORD);
        let row = if big {
            parser.read_big_endian_element(&mut body, &definition)
        } else {
            parser.read_little_endian_element(&mut body, &definition)
        };
        if row.is_err() && body.limit() == 0 {
            let element = element.name.clone();
            return Err(ReadFault::LongRecord { element, record, most: MAX_RECORD });
        }
        take(row.map_err(|error| match error.kind() {
            std::io::ErrorKind::InvalidInput => ReadFault::Value {
                place: format!("record {record} of element {}", quoted(element.name.as_bytes())),
                expected: "a list with a length of at least 0".to_owned(),
                found: "a negative length".to_owned(),
            },
            _ => at_end(Error::from(error), element),
        })?);
    }
    Ok(())
}

/// The element as the crate describes it. Properties are numbered: under their own names, those
/// that come twice would become one.
fn definition(element: &ElementDef) -> ply::ElementDef {
    let mut definition = ply::ElementDef::new(element.name.clone());
    for (i, property) in element.properties.iter().enumerate() {
        let kind = match property.kind {
            Kind::Scalar(scalar) => PropertyType::Scalar(scalar_type(scalar)),
            Kind::List { length, item } => {
                PropertyType::List(scalar_type(length), scalar_type(item))
            }
        };
        definition.properties.add(PropertyDef::new(i.to_string(), kind));
    }
    definition
}

/// The crate's word for an element type.
pub(super) fn scalar_type(element: Element) -> ScalarType {
    match element {
        Element::I8 => ScalarType::Char,
        Element::U8 => ScalarType::UChar,
        Element::I16 => ScalarType::Short,
        Element::U16 => ScalarType::UShort,
        Element::I32 => ScalarType::Int,
        Element::U32 => ScalarType::UInt,
        Element::F32 => ScalarType::Float,
        Element::F64 => ScalarType::Double,
    }
}
