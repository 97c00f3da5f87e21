//! Wavefront OBJ: a line of text per vertex, normal or face. Objects, groups, materials, texture
//! coordinates, lines and curves are passed over.

use crate::cloud::buffer::Buffer;
use crate::error::{ReadFault, quoted};
use crate::faces::Faces;
use crate::formats::body::Body;
use crate::formats::lines::{Lines, MAX_LINE, number};
use crate::memory::{OutOfMemory, ask, grow};
use crate::table::{COLORS, Field, NORMALS, Table};
use glam::{DVec3, Vec3};
use std::io::BufRead;
use surfelshop_api::columns::Element;
use surfelshop_geometry::Progress;

/// Words that a line of such a file begins with.
const KEYWORDS: [&[u8]; 12] =
    [b"v", b"vn", b"vt", b"vp", b"f", b"o", b"g", b"s", b"l", b"p", b"mtllib", b"usemtl"];

/// Whether a file begins like an OBJ file, comments aside; a file that is one long comment is taken
/// for one by its name.
pub(crate) fn is_obj(head: &[u8], is_named_so: bool) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n' || byte == b'\r').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
    first.map_or(is_named_so, |line| {
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        KEYWORDS.contains(&word) && (word.len() < line.len() || is_named_so)
    })
}

/// Lines between two questions whether to stop.
const BLOCK: usize = 4096;

/// What the lines say.
#[derive(Default)]
struct ObjData {
    coordinates: Vec<f64>,
    /// Colours as written, and how many vertices came before the first one that has none.
    colors: Vec<[f32; 3]>,
    n_without_color: usize,
    normals: Vec<Vec3>,
    /// Corners of all faces in a row: vertex and normal, -1 where there is none.
    corners: Vec<[i64; 2]>,
    /// For each face the end of its corners.
    ends: Vec<usize>,
    n_unread: usize,
}

/// Reads points and faces.
pub(crate) fn read<R: BufRead>(body: Body<R>, progress: Progress<'_>) -> Result<Table, ReadFault> {
    let mut lines = Lines::new(body, 0);
    let mut found = ObjData::default();
    let mut whole: Vec<u8> = Vec::new();
    let mut count = 0usize;
    while lines.next()? {
        if count.is_multiple_of(BLOCK) {
            lines.body.report(progress)?;
        }
        count += 1;
        // A backslash at its end continues a line.
        let text = lines.text.trim_ascii_end();
        if let Some(begun) = text.strip_suffix(b"\\") {
            if whole.len() + begun.len() >= MAX_LINE {
                return Err(ReadFault::LongLine { line: lines.line, most: MAX_LINE });
            }
            whole.extend_from_slice(begun);
            whole.push(b' ');
            continue;
        }
        if whole.is_empty() {
            found.take(&lines.text, lines.line)?;
        } else {
            whole.extend_from_slice(&lines.text);
            found.take(&whole, lines.line)?;
            whole.clear();
        }
    }
    lines.body.report(progress)?;
    let n_points = found.coordinates.len() / 3;
    ask(found.bytes_as_table()).map_err(ReadFault::memory(n_points))?;
    found.table().map_err(ReadFault::memory(n_points))
}

impl ObjData {
    /// Makes room for what a line can say: a corner of a face takes a digit and a separator.
    fn make_room(&mut self, line: &[u8]) -> Result<(), OutOfMemory> {
        grow(&mut self.coordinates, 3)?;
        grow(&mut self.colors, 1)?;
        grow(&mut self.normals, 1)?;
        grow(&mut self.ends, 1)?;
        match line.trim_ascii_start().first() {
            Some(b'f') => grow(&mut self.corners, line.len() / 2 + 1),
            _ => Ok(()),
        }
    }

    /// Bytes besides its own that making a table of it takes: columns, sums of normals, triangles.
    fn bytes_as_table(&self) -> u64 {
        let n_rows = (self.coordinates.len() / 3) as u64;
        n_rows * (12 + 12 + 24 + 3) + self.corners.len() as u64 * 12
    }

    /// Takes what a line says.
    fn take(&mut self, line: &[u8], place: usize) -> Result<(), ReadFault> {
        self.make_room(line).map_err(ReadFault::memory(self.coordinates.len() / 3))?;
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => self.vertex(words, place),
            Some("vn") => {
                let [x, y, z] = numbers(&mut words, place)?;
                self.normals.push(DVec3::new(x, y, z).as_vec3());
                Ok(())
            }
            Some("f") => {
                self.face(words);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// `v x y z`, then nothing, a weight, a colour, or both.
    fn vertex<'a>(
        &mut self,
        mut words: impl Iterator<Item = &'a str>,
        place: usize,
    ) -> Result<(), ReadFault> {
        self.coordinates.extend(numbers::<3>(&mut words, place)?);
        let more: Vec<Option<f64>> = words.take(5).map(|word| number(word, Element::F64)).collect();
        let color = match more[..] {
            [Some(r), Some(g), Some(b)] | [_, Some(r), Some(g), Some(b)] => Some([r, g, b]),
            _ => None,
        };
        self.n_without_color += usize::from(color.is_none());
        self.colors.push(color.unwrap_or([f64::NAN; 3]).map(|channel| channel as f32));
        Ok(())
    }

    /// `f` and corners `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or backwards from -1.
    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) {
        let n_vertices = (self.coordinates.len() / 3) as i64;
        let n_normals = self.normals.len() as i64;
        let index = |word: &str, count: i64| match word.parse::<i64>() {
            Ok(index) if index > 0 => Some(index - 1),
            Ok(index) if index < 0 && -index <= count => Some(count + index),
            _ => None,
        };
        let start = self.corners.len();
        for word in words {
            let mut parts = word.split('/');
            let Some(vertex) = index(parts.next().unwrap_or_default(), n_vertices) else {
                self.corners.truncate(start);
                self.n_unread += 1;
                return;
            };
            let normal = parts.nth(1).and_then(|word| index(word, n_normals));
            self.corners.push([vertex, normal.unwrap_or(-1)]);
        }
        self.ends.push(self.corners.len());
    }

    /// All of it as a table.
    fn table(self) -> Result<Table, OutOfMemory> {
        let n_rows = self.coordinates.len() / 3;
        let mut table =
            Table { format: "OBJ".to_owned(), element: "v".to_owned(), n_rows, ..Table::default() };
        if self.n_without_color < n_rows {
            table.fields.push(colors(&self.colors));
            if self.n_without_color > 0 {
                let n_without = self.n_without_color;
                table.warnings.push(format!("{n_without} vertices have no colour and became grey"));
            }
        }
        table.fields.extend(self.vertex_normals(n_rows));
        let mut faces = Faces::new(n_rows);
        (0..self.n_unread).for_each(|_| faces.add_bad());
        let (mut start, mut corners) = (0, Vec::new());
        for &end in &self.ends {
            corners.clear();
            corners.extend(self.corners[start..end].iter().map(|[vertex, _]| *vertex));
            faces.polygon(&corners)?;
            start = end;
        }
        let (triangles, warning) = faces.finish();
        table.faces = triangles;
        table.warnings.extend(warning);
        table.fields.push(Field::coordinates(self.coordinates));
        Ok(table)
    }

    /// The normal that faces give each vertex, bit by bit where they agree, else the mean, zero
    /// where they give none. Without faces that name normals, the n-th normal is that of the n-th
    /// vertex where there are as many.
    fn vertex_normals(&self, n_rows: usize) -> Option<Field> {
        let mut named = vec![Vec3::ZERO; n_rows];
        let mut sums: Vec<DVec3> = Vec::new();
        for [vertex, normal] in &self.corners {
            let normal = usize::try_from(*normal).ok().and_then(|normal| self.normals.get(normal));
            let vertex = usize::try_from(*vertex).ok().filter(|vertex| *vertex < n_rows);
            let (Some(&normal), Some(vertex)) = (normal, vertex) else { continue };
            if named[vertex] == Vec3::ZERO {
                named[vertex] = normal;
            } else if named[vertex] != normal && sums.is_empty() {
                sums = vec![DVec3::ZERO; n_rows];
            }
        }
        if !sums.is_empty() {
            self.add_up(&mut sums);
            for (named, sum) in named.iter_mut().zip(&sums) {
                // Equal normals add up to a multiple, whose direction differs by its rounding.
                let mean = sum.normalize_or_zero();
                let differs = mean.distance_squared(named.as_dvec3()) > 1e-10;
                *named = if differs { mean.as_vec3() } else { *named };
            }
        }
        if named.iter().all(|&normal| normal == Vec3::ZERO) {
            if self.normals.is_empty() || self.normals.len() != n_rows {
                return None;
            }
            named.clone_from(&self.normals);
        }
        let values = Buffer::F32(bytemuck::cast_vec(named));
        Some(Field { names: NORMALS[0].map(str::to_owned).to_vec(), values })
    }

    /// Adds up the normals that faces give each vertex, made unit length.
    fn add_up(&self, sums: &mut [DVec3]) {
        for [vertex, normal] in &self.corners {
            let normal = usize::try_from(*normal).ok().and_then(|normal| self.normals.get(normal));
            let sum = usize::try_from(*vertex).ok().and_then(|vertex| sums.get_mut(vertex));
            if let (Some(normal), Some(sum)) = (normal, sum) {
                *sum += normal.as_dvec3().normalize_or_zero();
            }
        }
    }
}

/// The next numbers of a line.
fn numbers<'a, const N: usize>(
    words: &mut impl Iterator<Item = &'a str>,
    place: usize,
) -> Result<[f64; N], ReadFault> {
    let mut found = [0.0; N];
    for slot in &mut found {
        let word = words.next().unwrap_or_default();
        *slot = number(word, Element::F64).ok_or_else(|| ReadFault::Value {
            place: format!("line {place}"),
            expected: format!("{N} numbers"),
            found: quoted(word.as_bytes()),
        })?;
    }
    Ok(found)
}

/// Colours as 8-bit numbers, encoded as sRGB, since that is what programs divide by 255 to write;
/// some write them undivided.
fn colors(found: &[[f32; 3]]) -> Field {
    let most = found.as_flattened().iter().copied().fold(0.0, f32::max);
    let scale = if most > 1.0 { 1.0 } else { 255.0 };
    // The neutral albedo, encoded.
    const GREY: u8 = 188;
    let channel = |value: &f32| match value.is_nan() {
        true => GREY,
        false => (value * scale).round().clamp(0.0, 255.0) as u8,
    };
    let values = Buffer::U8(found.as_flattened().iter().map(channel).collect());
    Field { names: COLORS[0][..3].iter().map(|name| (*name).to_owned()).collect(), values }
}
