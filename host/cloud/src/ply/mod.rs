//! The PLY format (Turk 1994): a text header that declares elements and their properties, then
//! their values as text or as binary records.

mod ascii;
mod binary;
mod header;
mod lists;
mod write;

use crate::buffer::Buffer;
use crate::error::{ReadFault, listed};
use crate::table::{Field, Table, n_together};
use header::{Encoding, Header, Kind};
use std::collections::HashSet;
use std::io::{BufRead, Read};
use surfelshop_geometry::Progress;

pub(crate) use write::write;

/// Whether a file begins like a PLY file, a byte order mark aside.
pub(crate) fn is_ply(head: &[u8]) -> bool {
    let head = head.strip_prefix(header::BYTE_ORDER_MARK).unwrap_or(head);
    head.strip_prefix(b"ply").is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
}

/// What is left of a file after its header; knows how much that is.
struct Body<R> {
    reader: R,
    remaining: u64,
    total: u64,
}

impl<R: Read> Read for Body<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n_read = self.reader.read(buffer)?;
        self.remaining = self.remaining.saturating_sub(n_read as u64);
        Ok(n_read)
    }
}

impl<R> Body<R> {
    /// Asks whether to go on, telling how much of the body is read.
    fn tell(&self, progress: Progress<'_>) -> Result<(), ReadFault> {
        let done = 1.0 - self.remaining as f64 / self.total.max(1) as f64;
        if progress(done.clamp(0.0, 1.0)).is_break() {
            return Err(ReadFault::Cancelled);
        }
        Ok(())
    }
}

/// A PLY file whose header is read.
pub(crate) struct File<R> {
    header: Header,
    /// The place of the element that holds points.
    vertices: usize,
    body: Body<R>,
}

impl<R: BufRead> File<R> {
    /// Reads the header of a file of `length` bytes.
    pub(crate) fn open(mut reader: R, length: u64) -> Result<Self, ReadFault> {
        let header = header::read(&mut reader)?;
        let vertices = vertex_element(&header)?;
        let remaining = length.saturating_sub(header.length);
        Ok(Self { header, vertices, body: Body { reader, remaining, total: remaining } })
    }

    /// The names of the points' properties.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.header.elements[self.vertices].properties.iter().map(|property| property.name.as_str())
    }

    /// Reads the points; other elements are skipped, and what follows the points is not looked at.
    pub(crate) fn read(self, progress: Progress<'_>) -> Result<Table, ReadFault> {
        let Self { header, vertices, mut body } = self;
        let element = &header.elements[vertices];
        let mut table = Table {
            format: format!("PLY, {}", header.encoding.name()),
            element: element.name.clone(),
            ..Table::default()
        };
        let before = &header.elements[..vertices];
        table.fields = match header.encoding {
            Encoding::Ascii => ascii::read(body, &header, before, element, &mut table, progress)?,
            Encoding::Binary { big } => {
                for skipped in before {
                    binary::skip(&mut body, skipped, big, progress)?;
                }
                binary::read(&mut body, element, big, progress)?
            }
        };
        if progress(1.0).is_break() {
            return Err(ReadFault::Cancelled);
        }
        table.n_rows =
            table.fields.first().map_or(0, |field| field.values.len() / field.names.len());
        table.comments = header.comments;
        Ok(table)
    }
}

/// The place of the element that holds points; it has distinct property names.
fn vertex_element(header: &Header) -> Result<usize, ReadFault> {
    let named = |name: &str| {
        header.elements.iter().position(|element| element.name.eq_ignore_ascii_case(name))
    };
    let place = ["vertex", "vertices", "point", "points"].into_iter().find_map(named);
    let place = place.ok_or_else(|| ReadFault::NoVertices {
        found: listed(header.elements.iter().map(|element| element.name.as_str())),
    })?;
    let mut names = HashSet::new();
    for property in &header.elements[place].properties {
        if !names.insert(property.name.to_ascii_lowercase()) {
            return Err(ReadFault::Header {
                line: property.line,
                expected: "a name that the element does not have yet".to_owned(),
                found: crate::error::quoted(property.name.as_bytes()),
            });
        }
    }
    let element = &header.elements[place];
    let has = |name| {
        element
            .properties
            .iter()
            .any(|p| matches!(p.kind, Kind::Scalar(_)) && p.name.eq_ignore_ascii_case(name))
    };
    if !["x", "y", "z"].into_iter().all(has) {
        return Err(ReadFault::NoCoordinates {
            element: element.name.clone(),
            found: listed(element.properties.iter().map(|p| p.name.as_str())),
        });
    }
    Ok(place)
}

/// Empty fields for the scalar properties of an element, with room for its rows; where `woven`,
/// neighbours of one type that belong together share one.
fn empty_fields(element: &header::ElementDef, woven: bool) -> Vec<Field> {
    let n_rows = usize::try_from(element.count).unwrap_or(0);
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
                values: Buffer::with_capacity(scalar, n_rows * n_names),
            });
        }
        rest = others;
    }
    fields
}
