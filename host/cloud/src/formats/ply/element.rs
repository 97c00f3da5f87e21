//! The records of an element: their size, the columns that they become, and the message where the file ends
//! inside them.

use super::header::{ElementDef, Kind};
use crate::cloud::buffer::Buffer;
use crate::error::ReadFault;
use crate::table::{Field, n_together};

/// Bytes of a record; with lists, of one whose lists are all empty.
pub(super) fn least_size(element: &ElementDef) -> u64 {
    element
        .properties
        .iter()
        .map(|property| match property.kind {
            Kind::Scalar(scalar) => scalar.size() as u64,
            Kind::List { length, .. } => length.size() as u64,
        })
        .sum()
}

pub(super) fn has_lists(element: &ElementDef) -> bool {
    element.properties.iter().any(|property| matches!(property.kind, Kind::List { .. }))
}

/// Empty fields for the scalar properties of an element, with room for its rows; where `woven`,
/// neighbours of one type that belong together share one.
pub(super) fn empty_fields(element: &ElementDef, woven: bool) -> Result<Vec<Field>, ReadFault> {
    let n_rows = usize::try_from(element.count).unwrap_or(usize::MAX);
    let mut fields = fields_of(element, woven);
    for field in &mut fields {
        let length = n_rows.saturating_mul(field.names.len());
        field.values =
            Buffer::with_room(field.values.element(), length).map_err(ReadFault::memory(n_rows))?;
    }
    Ok(fields)
}

/// The same without room.
pub(super) fn fields_of(element: &ElementDef, woven: bool) -> Vec<Field> {
    let mut fields = Vec::new();
    let mut rest = &element.properties[..];
    while let Some(first) = rest.first() {
        let alike = rest.iter().take_while(|property| property.kind == first.kind);
        let names = alike.map(|property| property.name.as_str());
        let n_names = if woven { n_together(names) } else { 1 };
        let (together, others) = rest.split_at(n_names);
        if let Kind::Scalar(scalar) = first.kind {
            fields.push(Field {
                names: together.iter().map(|property| property.name.clone()).collect(),
                values: Buffer::with_capacity(scalar, 0),
            });
        }
        rest = others;
    }
    fields
}

/// An end of file becomes a message about the element.
pub(super) fn at_end(error: std::io::Error, element: &ElementDef) -> ReadFault {
    if error.kind() == std::io::ErrorKind::UnexpectedEof { shrunk(element) } else { error.into() }
}

/// The file ends inside an element.
pub(super) fn shrunk(element: &ElementDef) -> ReadFault {
    ReadFault::Truncated {
        element: element.name.clone(),
        expected: format!("{} records", element.count),
        found: "the file's end before them".to_owned(),
    }
}
