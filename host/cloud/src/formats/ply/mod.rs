//! The PLY format (Turk 1994): a text header that declares elements and their properties, then
//! their values as text or as binary records.

mod ascii;
mod binary;
mod element;
mod faces;
mod header;
mod lists;
mod properties;
mod records;
mod splats;
mod write;
mod write_batches;

use crate::assemble::memory_estimate;
use crate::error::{ReadFault, listed};
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::formats::facts;
use crate::formats::lines::Lines;
use crate::formats::stream::{Layout, emit_table, refused};
use crate::options::ReadOptions;
use crate::table::Table;
use element::fields_of;
use faces::Corners;
use header::{ElementDef, Encoding, Header, Kind};
use std::collections::HashSet;
use std::io::BufRead;
use surfelshop_api::format::{BATCH, CloudHeader, CloudSinkHost};
use surfelshop_geometry::{Progress, part};

pub(crate) use write::{n_edits_left_out, write};
pub(crate) use write_batches::write_batches;

/// Whether a file begins like a PLY file of packed splats, of which only a plugin knows what the numbers mean.
pub(crate) fn is_packed(head: &[u8]) -> bool {
    const PROPERTY: &[u8] = b"packed_position";
    is_ply(head) && head.windows(PROPERTY.len()).any(|bytes| bytes == PROPERTY)
}

/// Whether a file begins like a PLY file, a byte order mark aside.
pub(crate) fn is_ply(head: &[u8]) -> bool {
    let head = head.strip_prefix(header::BYTE_ORDER_MARK).unwrap_or(head);
    head.strip_prefix(b"ply").is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
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
        let body = Body::new(reader, length.saturating_sub(header.length));
        Ok(Self { header, vertices, body })
    }

    /// The names of the points' properties.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.header.elements[self.vertices].properties.iter().map(|property| property.name.as_str())
    }

    /// Whether the points are joined to faces.
    pub(crate) fn has_faces(&self) -> bool {
        self.header.elements.iter().any(|element| Corners::of(element).is_some())
    }

    /// Asks whether the points, and what is made of them, fit into memory, before minutes are spent on them.
    fn ask_for_memory(&self, options: &ReadOptions<'_>) -> Result<(), ReadFault> {
        let element = &self.header.elements[self.vertices];
        // A header may announce more than the file has; that is said where it is read.
        let smallest = element::least_size(element).max(1);
        let least = match self.header.encoding {
            Encoding::Ascii => 2 * element.properties.len() as u64,
            Encoding::Binary { .. } => smallest,
        };
        if element.count.saturating_mul(least) > self.body.remaining.saturating_add(1) {
            return Ok(());
        }
        let woven = self.header.encoding != Encoding::Ascii && !element::has_lists(element);
        let fields = fields_of(element, woven);
        let columns = element.count.saturating_mul(memory_estimate::row_bytes(&fields));
        let n_points = usize::try_from(element.count).unwrap_or(usize::MAX);
        memory_estimate::ask(&fields, element.count, 0, options, columns)
            .map_err(ReadFault::memory(n_points))
    }

    /// What the header says.
    pub(crate) fn facts(&self, columns: Option<&[String]>) -> CloudHeader {
        let element = &self.header.elements[self.vertices];
        let woven = self.header.encoding != Encoding::Ascii && !element::has_lists(element);
        facts::said(CloudHeader {
            format: format!("PLY, {}", self.header.encoding.name()),
            rows: Some(element.count),
            columns: Layout::of(&fields_of(element, woven)).wanted(columns).columns(),
            has_faces: self.has_faces(),
            comments: self.header.comments.clone(),
            ..CloudHeader::default()
        })
    }

    /// Hands the points over, batch by batch, and the faces between them. Text, and records with lists, are read
    /// whole before.
    pub(crate) fn stream(
        self,
        options: &ReadOptions<'_>,
        columns: Option<&[String]>,
        sink: &mut dyn CloudSinkHost,
        progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        let element = &self.header.elements[self.vertices];
        let Encoding::Binary { big } = self.header.encoding else {
            let table = self.read(options, &part(progress, 0.0..0.8))?;
            return emit_table(&table, columns, sink, &part(progress, 0.8..1.0));
        };
        if element::has_lists(element) {
            let table = self.read(options, &part(progress, 0.0..0.8))?;
            return emit_table(&table, columns, sink, &part(progress, 0.8..1.0));
        }
        let header = self.facts(columns);
        if !sink.begin(&header).map_err(refused)? {
            return Ok(());
        }
        let Self { header, vertices, mut body } = self;
        let element = &header.elements[vertices];
        let n_rows = usize::try_from(element.count).unwrap_or(usize::MAX);
        let mut faces = Faces::new(n_rows);
        for other in &header.elements[..vertices] {
            binary::pass(&mut body, other, big, &mut faces, progress)?;
        }
        let layout = Layout::of(&fields_of(element, true)).wanted(columns);
        binary::blocks(&mut body, element, big, progress, |fields, rows| {
            layout.emit(fields, 0..rows, sink).map_err(refused)
        })?;
        let mut warnings = Vec::new();
        for other in after(&header.elements[vertices + 1..]) {
            let passed = binary::pass(&mut body, other, big, &mut faces, progress);
            if !goes_on(passed, &mut warnings)? {
                break;
            }
        }
        let (triangles, warning) = faces.finish();
        warnings.into_iter().chain(warning).for_each(|line| sink.warn(&line));
        triangles.chunks(BATCH).try_for_each(|faces| sink.faces(faces)).map_err(refused)
    }

    /// Reads the points and the faces between them; other elements are skipped. What follows the
    /// points may be damaged: the faces before the damage are kept.
    pub(crate) fn read(
        self,
        options: &ReadOptions<'_>,
        progress: Progress<'_>,
    ) -> Result<Table, ReadFault> {
        self.ask_for_memory(options)?;
        let Self { header, vertices, mut body } = self;
        let element = &header.elements[vertices];
        let mut table = Table {
            format: format!("PLY, {}", header.encoding.name()),
            element: element.name.clone(),
            ..Table::default()
        };
        let n_rows = usize::try_from(element.count).unwrap_or(usize::MAX);
        let mut faces = Faces::new(n_rows);
        let before = &header.elements[..vertices];
        let after = after(&header.elements[vertices + 1..]);
        match header.encoding {
            Encoding::Ascii => {
                let mut lines = Lines::new(body, header.n_lines);
                for other in before {
                    ascii::pass(&mut lines, other, &mut faces, progress)?;
                }
                table.fields = ascii::read(&mut lines, element, &mut table.warnings, progress)?;
                for other in after {
                    let passed = ascii::pass(&mut lines, other, &mut faces, progress);
                    if !goes_on(passed, &mut table.warnings)? {
                        break;
                    }
                }
            }
            Encoding::Binary { big } => {
                for other in before {
                    binary::pass(&mut body, other, big, &mut faces, progress)?;
                }
                table.fields = binary::read(&mut body, element, big, progress)?;
                for other in after {
                    let passed = binary::pass(&mut body, other, big, &mut faces, progress);
                    if !goes_on(passed, &mut table.warnings)? {
                        break;
                    }
                }
            }
        }
        if progress(1.0).is_break() {
            return Err(ReadFault::Cancelled);
        }
        table.n_rows =
            table.fields.first().map_or(0, |field| field.values.len() / field.names.len());
        table.comments = header.comments;
        let (triangles, warning) = faces.finish();
        table.faces = triangles;
        table.warnings.extend(warning);
        Ok(table)
    }
}

/// The elements after the points up to the last one that has faces; nobody looks at the rest.
fn after(elements: &[ElementDef]) -> &[ElementDef] {
    let last = elements.iter().rposition(|element| Corners::of(element).is_some());
    &elements[..last.map_or(0, |last| last + 1)]
}

/// Whether there is more to read after an element that followed the points. Damage becomes a
/// warning, since the points are complete.
fn goes_on(passed: Result<(), ReadFault>, warnings: &mut Vec<String>) -> Result<bool, ReadFault> {
    match passed {
        Ok(()) => Ok(true),
        Err(fault @ (ReadFault::Cancelled | ReadFault::Io(_))) => Err(fault),
        Err(fault) => {
            warnings.push(format!("the faces are incomplete: {fault}"));
            Ok(false)
        }
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
