//! The header: elements and where their properties lie.

use super::super::rest_of;
use super::points::CHUNK;
use surfelshop_api::format::FileSource;
use surfelshop_api::prelude::{Error, Result};

/// Most bytes of a header.
const MOST_BYTES: u64 = 1 << 16;

/// Bounds of positions and of logarithms of sizes.
pub(super) const BOUNDS: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];

/// Bounds of colours, which older files do not have.
pub(super) const COLOR_BOUNDS: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];

pub(super) const PACKED: [&str; 4] =
    ["packed_position", "packed_rotation", "packed_scale", "packed_color"];

/// Types of properties: the names of a type, and its bytes.
const TYPES: [(&[&str], usize); 8] = [
    (&["char", "int8"], 1),
    (&["uchar", "uint8"], 1),
    (&["short", "int16"], 2),
    (&["ushort", "uint16"], 2),
    (&["int", "int32"], 4),
    (UINT, 4),
    (FLOAT, 4),
    (&["double", "float64"], 8),
];

const FLOAT: &[&str] = &["float", "float32"];
const UINT: &[&str] = &["uint", "uint32"];
const UCHAR: &[&str] = &["uchar", "uint8"];

/// A property of an element.
#[derive(Debug)]
struct Property {
    name: String,
    kind: String,
    offset: usize,
}

/// An element, and where its rows lie.
#[derive(Debug)]
pub(super) struct Element {
    name: String,
    pub(super) rows: u64,
    pub(super) start: u64,
    /// Bytes of a row.
    pub(super) stride: usize,
    properties: Vec<Property>,
}

impl Element {
    /// Where a property of one of these types lies in a row.
    fn offset(&self, name: &str, kinds: &[&str]) -> Result<usize> {
        let kind = kinds[0];
        let line = format!("`property {kind} {name}` of the element `{}`", self.name);
        match self.properties.iter().find(|property| property.name == name) {
            None => Err(Error::new(format!(
                "expected {line}, found none: this is no compressed PLY of Gaussians"
            ))),
            Some(found) if !kinds.contains(&found.kind.as_str()) => {
                Err(Error::new(format!("expected {line}, found the type `{}`", found.kind)))
            }
            Some(found) => Ok(found.offset),
        }
    }
}

/// A header.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) chunk: Element,
    pub(super) vertex: Element,
    /// Spherical harmonics beyond the first, where there are some.
    pub(super) harmonics: Option<Element>,
    pub(super) bounds: [usize; 12],
    pub(super) color_bounds: Option<[usize; 6]>,
    pub(super) packed: [usize; 4],
    /// Where spherical harmonics lie: those of red, of green, of blue.
    pub(super) rest: Vec<usize>,
    pub(super) comments: Vec<String>,
}

/// Where several properties of one type lie in a row.
fn offsets<const N: usize>(
    element: &Element,
    names: [&str; N],
    kinds: &[&str],
) -> Result<[usize; N]> {
    let mut offsets = [0; N];
    for (offset, name) in offsets.iter_mut().zip(names) {
        *offset = element.offset(name, kinds)?;
    }
    Ok(offsets)
}

impl Header {
    /// Reads the header, and holds what it announces against the file's length.
    pub(super) fn read(file: &FileSource) -> Result<Self> {
        let bytes = file.bytes_at(0, file.length().min(MOST_BYTES))?;
        let (mut elements, comments) = elements(&bytes)?;
        let mut end = elements.iter().map(|element| element.start).next().unwrap_or(0);
        for element in &elements {
            let next = (element.stride as u64).checked_mul(element.rows);
            end = next.and_then(|bytes| end.checked_add(bytes)).unwrap_or(u64::MAX);
            if end > file.length() {
                return Err(Error::new(format!(
                    "expected {} rows of the element `{}` up to byte {end}, found {} bytes: the file is cut short",
                    element.rows,
                    element.name,
                    file.length()
                )));
            }
        }
        let mut take = |name: &str| {
            let place = elements.iter().position(|element| element.name == name);
            place.map(|place| elements.swap_remove(place))
        };
        let [chunk, vertex] = ["chunk", "vertex"].map(|name| {
            take(name).ok_or_else(|| {
                Error::new(format!(
                    "expected the element `{name}`, found none: this is no compressed PLY of Gaussians"
                ))
            })
        });
        let (chunk, vertex) = (chunk?, vertex?);
        let harmonics = take("sh").filter(|element| !element.properties.is_empty());
        let expected = vertex.rows.div_ceil(CHUNK as u64);
        if chunk.rows != expected {
            return Err(Error::new(format!(
                "expected {expected} chunks of {} Gaussians, found {}",
                vertex.rows, chunk.rows
            )));
        }
        let has_colors = chunk.properties.iter().any(|property| property.name == COLOR_BOUNDS[0]);
        let color_bounds =
            if has_colors { Some(offsets(&chunk, COLOR_BOUNDS, FLOAT)?) } else { None };
        let rest = match &harmonics {
            Some(element) => rest(element, vertex.rows)?,
            None => Vec::new(),
        };
        let bounds = offsets(&chunk, BOUNDS, FLOAT)?;
        let packed = offsets(&vertex, PACKED, UINT)?;
        Ok(Self { bounds, color_bounds, packed, rest, chunk, vertex, harmonics, comments })
    }

    /// The degree of spherical harmonics.
    pub(super) fn degree(&self) -> usize {
        (0..=3).rfind(|degree| 3 * rest_of(*degree) <= self.rest.len()).unwrap_or(0)
    }
}

/// Where the properties of spherical harmonics lie in a row.
fn rest(element: &Element, rows: u64) -> Result<Vec<usize>> {
    if element.rows != rows {
        return Err(Error::new(format!(
            "expected spherical harmonics of {rows} Gaussians, found those of {}",
            element.rows
        )));
    }
    let names = element.properties.iter().filter(|property| property.name.starts_with("f_rest_"));
    let n = names.count();
    if ![1, 2, 3].map(|degree| 3 * rest_of(degree)).contains(&n) {
        return Err(Error::new(format!(
            "expected 9, 24 or 45 properties f_rest_0 and so on of the element `sh`, found {n}"
        )));
    }
    (0..n).map(|i| element.offset(&format!("f_rest_{i}"), UCHAR)).collect()
}

/// The elements of a header, in the order of the file, and its comments.
fn elements(bytes: &[u8]) -> Result<(Vec<Element>, Vec<String>)> {
    let (mut elements, mut comments): (Vec<Element>, Vec<String>) = Default::default();
    let (mut place, mut is_binary) = (0, false);
    for (number, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
        place += line.len();
        let odd = || {
            let shown: String = String::from_utf8_lossy(line).trim_end().chars().take(60).collect();
            let shown = shown.escape_debug();
            Error::new(format!(
                "line {} of the header: expected a line of PLY, found `{shown}`",
                number + 1
            ))
        };
        let text = std::str::from_utf8(line).ok().ok_or_else(odd)?.trim();
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] if number == 0 => {}
            _ if number == 0 => {
                return Err(Error::new(
                    "expected the word `ply` at the beginning, found something else",
                ));
            }
            ["format", "binary_little_endian", _] => is_binary = true,
            ["format", other, ..] => {
                return Err(Error::new(format!(
                    "expected `format binary_little_endian`, found `{other}`"
                )));
            }
            ["comment", ..] | ["obj_info", ..] => {
                comments.push(text.split_once(' ').map_or("", |(_, text)| text).trim().to_owned());
            }
            ["element", name, rows] => {
                let rows = rows.parse().ok().ok_or_else(odd)?;
                let (name, properties) = (name.to_owned(), Vec::new());
                elements.push(Element { name, rows, start: 0, stride: 0, properties });
            }
            ["property", kind, name] => {
                let known = TYPES.iter().find(|(names, _)| names.contains(&kind));
                let (_, size) = known.ok_or_else(odd)?;
                let element = elements.last_mut().ok_or_else(odd)?;
                let (name, kind) = (name.to_owned(), kind.to_owned());
                element.properties.push(Property { name, kind, offset: element.stride });
                element.stride += size;
            }
            ["end_header"] if is_binary && line.ends_with(b"\n") => {
                let mut start = place as u64;
                for element in &mut elements {
                    element.start = start;
                    // Held against the length of the file by whoever reads the header.
                    let bytes = element.rows.saturating_mul(element.stride as u64);
                    start = start.saturating_add(bytes);
                }
                return Ok((elements, comments));
            }
            [] => {}
            _ => return Err(odd()),
        }
    }
    Err(Error::new(format!(
        "expected `format` and `end_header` within {MOST_BYTES} bytes, found no end of the header: the file is damaged"
    )))
}
