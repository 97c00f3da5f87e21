//! The Object File Format of Geomview: counts, then a line of text per vertex and per face.

use crate::cloud::buffer::Buffer;
use crate::error::{ReadFault, quoted};
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::formats::lines::{Lines, number};
use crate::memory::ask;
use crate::table::{COLORS, Field, NORMALS, Table};
use std::io::BufRead;
use surfelshop_api::columns::Element;
use surfelshop_geometry::Progress;

/// Whether a file begins like an OFF file, comments aside: `OFF` with letters for normals, colours
/// and more before it.
pub(crate) fn is_off(head: &[u8]) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n' || byte == b'\r').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    let word = first.and_then(|line| line.split(u8::is_ascii_whitespace).next());
    let letters = word.and_then(|word| word.strip_suffix(b"OFF"));
    letters.is_some_and(|letters| letters.iter().all(|letter| b"STCN4n".contains(letter)))
}

/// Lines between two questions whether to stop.
const BLOCK: usize = 4096;

/// What a vertex has besides its place.
#[derive(Clone, Copy)]
struct VertexLayout {
    normals: bool,
    colors: bool,
}

/// Reads points and faces. What follows the points may be damaged.
pub(crate) fn read<R: BufRead>(body: Body<R>, progress: Progress<'_>) -> Result<Table, ReadFault> {
    let mut lines = Content(Lines::new(body, 0));
    let (kinds, [n_vertices, n_faces]) = header(&mut lines)?;
    let least = if kinds.normals { 12 } else { 6 };
    // Each number takes a digit and a separator; the last separator may be missing.
    let remaining = lines.0.body.remaining;
    if n_vertices.checked_mul(least).is_none_or(|least| least > remaining.saturating_add(1)) {
        return Err(truncated("vertices", n_vertices, format!("{remaining} bytes")));
    }
    let n_vertices = usize::try_from(n_vertices).unwrap_or(usize::MAX);
    let mut table = Table {
        format: "OFF".to_owned(),
        element: "vertices".to_owned(),
        n_rows: n_vertices,
        ..Table::default()
    };
    // Numbers as they are read, and the columns that are made of them.
    let bytes = if kinds.normals { 24 + 12 + 12 } else { 24 + 12 };
    let bytes = bytes + if kinds.colors { 24 + 3 } else { 0 };
    ask((n_vertices as u64).saturating_mul(bytes)).map_err(ReadFault::memory(n_vertices))?;
    vertices(&mut lines, kinds, &mut table, progress)?;
    let mut faces = Faces::new(n_vertices);
    let mut corners = Vec::new();
    for face in 0..n_faces {
        if face.is_multiple_of(BLOCK as u64) {
            lines.0.body.report(progress)?;
        }
        let Some(text) = lines.next()? else {
            let fault = truncated("faces", n_faces, face.to_string());
            table.warnings.push(format!("the faces are incomplete: {fault}"));
            break;
        };
        match corners_of(&text, &mut corners) {
            Some(()) => faces.polygon(&corners).map_err(ReadFault::memory(n_vertices))?,
            None => faces.add_bad(),
        }
    }
    lines.0.body.report(progress)?;
    let (triangles, warning) = faces.finish();
    table.faces = triangles;
    table.warnings.extend(warning);
    Ok(table)
}

fn truncated(element: &str, expected: u64, found: String) -> ReadFault {
    let expected = format!("{expected} lines");
    ReadFault::Truncated { element: element.to_owned(), expected, found }
}

/// Lines without their comments.
struct Content<R>(Lines<R>);

impl<R: BufRead> Content<R> {
    /// The next line that is more than a comment.
    fn next(&mut self) -> Result<Option<String>, ReadFault> {
        while self.0.next()? {
            let text = String::from_utf8_lossy(&self.0.text);
            let text = text.split('#').next().unwrap_or_default().trim();
            if !text.is_empty() {
                return Ok(Some(text.to_owned()));
            }
        }
        Ok(None)
    }
}

/// The first word and the counts, which stand on its line or the next one.
fn header<R: BufRead>(lines: &mut Content<R>) -> Result<(VertexLayout, [u64; 2]), ReadFault> {
    let fault = |line: usize, expected: &str, found: &str| ReadFault::Header {
        line,
        expected: expected.to_owned(),
        found: quoted(found.as_bytes()),
    };
    let first = lines.next()?.unwrap_or_default();
    let (word, rest) = first.split_once(char::is_whitespace).unwrap_or((&first, ""));
    let letters = word.strip_suffix("OFF").unwrap_or(word);
    let is_known = letters.chars().all(|letter| matches!(letter, 'C' | 'N'));
    if !is_known || rest.trim_start().starts_with("BINARY") {
        return Err(fault(lines.0.line, "OFF, COFF, NOFF or CNOFF as text", &first));
    }
    let kinds = VertexLayout { normals: letters.contains('N'), colors: letters.contains('C') };
    let counts = match rest.trim() {
        "" => lines.next()?.unwrap_or_default(),
        rest => rest.to_owned(),
    };
    let mut numbers = counts.split_ascii_whitespace().map(|word| word.parse::<u64>().ok());
    match (numbers.next().flatten(), numbers.next().flatten()) {
        (Some(vertices), Some(faces)) => Ok((kinds, [vertices, faces])),
        _ => Err(fault(lines.0.line, "the numbers of vertices and faces", &counts)),
    }
}

/// Reads the lines of vertices into columns: place, normal, colour.
fn vertices<R: BufRead>(
    lines: &mut Content<R>,
    kinds: VertexLayout,
    table: &mut Table,
    progress: Progress<'_>,
) -> Result<(), ReadFault> {
    let n_before = if kinds.normals { 6 } else { 3 };
    let n_numbers = n_before + if kinds.colors { 3 } else { 0 };
    let (mut places, mut normals) = (Vec::with_capacity(table.n_rows * 3), Vec::new());
    let mut colors: Vec<f64> = Vec::new();
    for vertex in 0..table.n_rows {
        if vertex.is_multiple_of(BLOCK) {
            lines.0.body.report(progress)?;
        }
        let Some(text) = lines.next()? else {
            return Err(truncated("vertices", table.n_rows as u64, vertex.to_string()));
        };
        let mut words = text.split_ascii_whitespace();
        for place in 0..n_numbers {
            let word = words.next().unwrap_or_default();
            let value = number(word, Element::F64).ok_or_else(|| ReadFault::Value {
                place: format!("line {}", lines.0.line),
                expected: format!("{n_numbers} numbers"),
                found: quoted(word.as_bytes()),
            })?;
            match place {
                0..3 => places.push(value),
                _ if place < n_before => normals.push(value as f32),
                _ => colors.push(value),
            }
        }
    }
    table.fields.push(Field::coordinates(places));
    let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
    if kinds.normals {
        table.fields.push(Field { names: names(&NORMALS[0]), values: Buffer::F32(normals) });
    }
    if kinds.colors {
        // Whole numbers to 255, or parts of 1; both stand for what a screen is sent.
        let most = colors.iter().copied().fold(0.0, f64::max);
        let scale = if most > 1.0 { 1.0 } else { 255.0 };
        let bytes = colors.iter().map(|value| (value * scale).round().clamp(0.0, 255.0) as u8);
        let values = Buffer::U8(bytes.collect());
        table.fields.push(Field { names: names(&COLORS[0][..3]), values });
    }
    Ok(())
}

/// Reads a face: how many corners, which, and perhaps a colour.
fn corners_of(text: &str, corners: &mut Vec<i64>) -> Option<()> {
    corners.clear();
    let mut words = text.split_ascii_whitespace();
    for _ in 0..words.next()?.parse::<u64>().ok()? {
        corners.push(words.next()?.parse().ok()?);
    }
    Some(())
}
