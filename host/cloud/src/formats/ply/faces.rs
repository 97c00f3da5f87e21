//! Elements that say how points are joined: polygons and strips of triangles.

use super::element::{at_end, shrunk};
use super::header::{ElementDef, Kind};
use crate::error::{ReadFault, quoted};
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::memory::grow;
use std::io::Read;
use surfelshop_api::columns::Element;
use surfelshop_geometry::Progress;

/// The list of an element that names the corners of its faces.
#[derive(Clone, Copy)]
pub(super) struct Corners {
    /// The place of the list among the element's properties.
    pub(super) property: usize,
    /// Whether it holds strips of triangles rather than a polygon.
    strips: bool,
    item: Element,
}

impl Corners {
    /// The list of corners of an element; `None` where it has none.
    pub(super) fn of(element: &ElementDef) -> Option<Self> {
        let names = ["vertex_indices", "vertex_index"];
        element.properties.iter().enumerate().find_map(|(property, declared)| {
            let Kind::List { item, .. } = declared.kind else { return None };
            let is_named = names.iter().any(|name| declared.name.eq_ignore_ascii_case(name));
            let is_whole = !matches!(item, Element::F32 | Element::F64);
            let strips = element.name.to_ascii_lowercase().contains("strip");
            (is_named && is_whole).then_some(Self { property, strips, item })
        })
    }

    /// Adds what a record says.
    pub(super) fn add(self, corners: &mut [i64], faces: &mut Faces) -> Result<(), ReadFault> {
        let n_points = faces.n_rows();
        if !self.strips {
            return faces.polygon(corners).map_err(ReadFault::memory(n_points));
        }
        // -1 as an unsigned number.
        if self.item == Element::U32 {
            let is_mark = |corner: &&mut i64| **corner == i64::from(u32::MAX);
            corners.iter_mut().filter(is_mark).for_each(|corner| *corner = -1);
        }
        faces.strip(corners).map_err(ReadFault::memory(n_points))
    }
}

/// Records between two questions whether to stop.
const BLOCK: u64 = 4096;

/// Bytes of a list between two questions whether to stop; also what is read of a list before its
/// end is known to be there.
const PIECE: usize = 1 << 16;

/// Reads the faces of an element. Those before a fault are kept.
///
/// Nothing is allocated by the element's count, and for a list no more than what is read of it.
pub(super) fn read<R: Read>(
    body: &mut Body<R>,
    element: &ElementDef,
    list: Corners,
    big: bool,
    faces: &mut Faces,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    let mut corners = Vec::new();
    let mut piece = vec![0; PIECE];
    for record in 0..element.count {
        if record % BLOCK == 0 {
            body.report(progress)?;
        }
        corners.clear();
        for (place, property) in element.properties.iter().enumerate() {
            let (item, length) = match property.kind {
                Kind::Scalar(scalar) => (scalar, 1),
                Kind::List { length, item } => {
                    let bytes = &mut piece[..length.size()];
                    body.read_exact(bytes).map_err(|error| at_end(error, element))?;
                    let length = u64::try_from(integer(length, bytes, big)).ok();
                    (item, length.ok_or_else(|| negative(element, record))?)
                }
            };
            let size = length.saturating_mul(item.size() as u64);
            if size > body.remaining {
                return Err(shrunk(element));
            }
            let mut left = usize::try_from(size).ok().ok_or_else(|| shrunk(element))?;
            while left > 0 {
                if left > PIECE {
                    body.report(progress)?;
                }
                let bytes = &mut piece[..left.min(PIECE)];
                body.read_exact(bytes).map_err(|error| at_end(error, element))?;
                left -= bytes.len();
                if place == list.property {
                    let values = bytes.chunks_exact(item.size());
                    grow(&mut corners, values.len()).map_err(ReadFault::memory(faces.n_rows()))?;
                    corners.extend(values.map(|value| integer(item, value, big)));
                }
            }
        }
        list.add(&mut corners, faces)?;
    }
    Ok(())
}

fn negative(element: &ElementDef, record: u64) -> ReadFault {
    ReadFault::Value {
        place: format!("record {record} of element {}", quoted(element.name.as_bytes())),
        expected: "a list with a length of at least 0".to_owned(),
        found: "a negative length".to_owned(),
    }
}

/// A whole number of this type; 0 for a type of other numbers, of which lists of corners have none.
fn integer(element: Element, bytes: &[u8], big: bool) -> i64 {
    let mut wide = [0; 4];
    for (place, byte) in bytes.iter().take(4).enumerate() {
        wide[if big { bytes.len() - 1 - place } else { place } % 4] = *byte;
    }
    let [low, high, ..] = wide;
    match element {
        Element::I8 => i64::from(low.cast_signed()),
        Element::U8 => i64::from(low),
        Element::I16 => i64::from(i16::from_le_bytes([low, high])),
        Element::U16 => i64::from(u16::from_le_bytes([low, high])),
        Element::I32 => i64::from(i32::from_le_bytes(wide)),
        Element::U32 => i64::from(u32::from_le_bytes(wide)),
        Element::F32 | Element::F64 => 0,
    }
}
