//! Writing batch by batch: how many points there are is written into the header when all are there.

use super::lists::scalar_type;
use super::properties::{binary_value, property_name, text_value};
use super::splats::SplatRecords;
use crate::error::WriteError;
use crate::formats::facts;
use ply_rs_bw::ply::ScalarType;
use std::collections::HashSet;
use std::io::{self, Write as _};
use std::path::Path;
use surfelshop_api::CloudView;
use surfelshop_api::columns::Element;
use surfelshop_api::format::{CloudHeader, CloudSourceHost, FileColumn, FileHost};

/// Letters of a number that is written later: as many as the largest has, padded with spaces, which readers
/// pass over.
const COUNT: usize = 20;

/// The file's end, so far.
struct Out<'a> {
    file: &'a dyn FileHost,
    place: u64,
}

impl Out<'_> {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_at(self.place, bytes)?;
        self.place += bytes.len() as u64;
        Ok(())
    }
}

/// Writes one cloud, in its own coordinates; what was lost in lines.
pub(crate) fn write_batches(
    file: &dyn FileHost,
    path: &Path,
    mut clouds: impl CloudSourceHost,
    ascii: bool,
) -> Result<Vec<String>, WriteError> {
    let io = |error: io::Error| WriteError::Io { path: path.to_owned(), error };
    let source = |error: surfelshop_api::Error| io(io::Error::other(error.message().to_owned()));
    let header = clouds.next_cloud().map_err(source)?.unwrap_or_default();
    let splats = SplatRecords::of_header(&header);
    let properties = properties(&header, splats.as_ref());
    check_names(&properties, path)?;
    let mut out = Out { file, place: 0 };
    let text = head(&header, &properties, splats.as_ref(), ascii);
    let place_of = |element: &str| text.find(element).map(|at| (at + element.len()) as u64);
    out.append(text.as_bytes()).map_err(io)?;
    let (mut n_points, mut n_faces) = (0u64, 0u64);
    let mut block = Vec::new();
    while let Some(batch) = clouds.next_batch().map_err(source)? {
        block.clear();
        match &splats {
            Some(splats) => (0..batch.len)
                .try_for_each(|row| splats.append(&mut block, &batch, row, ascii))
                .map_err(io)?,
            None => points(&mut block, &batch, ascii).map_err(io)?,
        }
        n_points += batch.len as u64;
        for [a, b, c] in batch.faces {
            if ascii {
                writeln!(block, "3 {a} {b} {c}").map_err(io)?;
            } else {
                block.push(3);
                [a, b, c].iter().for_each(|corner| block.extend_from_slice(&corner.to_le_bytes()));
            }
        }
        n_faces += batch.faces.len() as u64;
        out.append(&block).map_err(io)?;
    }
    for (element, count) in [("element vertex ", n_points), ("element face ", n_faces)] {
        if let Some(place) = place_of(element) {
            file.write_at(place, count.to_string().as_bytes()).map_err(io)?;
        }
    }
    Ok(header.left_out("PLY", facts::KEPT))
}

/// Names and types of the properties of points.
fn properties(header: &CloudHeader, splats: Option<&SplatRecords>) -> Vec<(String, Element)> {
    if let Some(splats) = splats {
        return splats.properties().map(|(name, element)| (name.to_owned(), element)).collect();
    }
    let of_column = |column: &FileColumn| {
        let (name, n, element) = (column.name.clone(), column.components as usize, column.element);
        (0..n).map(move |component| (property_name(&name, n, component), element))
    };
    header.columns.iter().flat_map(of_column).collect()
}

/// Refuses names that a reader could not tell apart or would split.
fn check_names(properties: &[(String, Element)], path: &Path) -> Result<(), WriteError> {
    let mut names = HashSet::new();
    for (name, _) in properties {
        let breaks = |c: char| c.is_whitespace() || c.is_control();
        let reason = if name.is_empty() || name.contains(breaks) {
            "names in PLY files have no spaces"
        } else if names.insert(name.to_ascii_lowercase()) {
            continue;
        } else {
            "another column has a property of this name"
        };
        let column = name.escape_debug().to_string();
        return Err(WriteError::ColumnName { path: path.to_owned(), column, reason });
    }
    Ok(())
}

/// What PLY calls a type.
fn type_name(element: Element) -> &'static str {
    match scalar_type(element) {
        ScalarType::Char => "char",
        ScalarType::UChar => "uchar",
        ScalarType::Short => "short",
        ScalarType::UShort => "ushort",
        ScalarType::Int => "int",
        ScalarType::UInt => "uint",
        ScalarType::Float => "float",
        ScalarType::Double => "double",
    }
}

fn head(
    header: &CloudHeader,
    properties: &[(String, Element)],
    splats: Option<&SplatRecords>,
    ascii: bool,
) -> String {
    let encoding = if ascii { "ascii" } else { "binary_little_endian" };
    let mut text = format!("ply\nformat {encoding} 1.0\n");
    // Positions are those of the world now, and columns are noted anew.
    let stale = |line: &str| {
        line.starts_with("surfelshop origin ") || line.starts_with("surfelshop column ")
    };
    for comment in header.comments.iter().flat_map(|comment| comment.lines()) {
        if !stale(comment) {
            text += &format!("comment {}\n", comment.replace('\r', " "));
        }
    }
    for comment in facts::comments(header) {
        text += &format!("comment {comment}\n");
    }
    for (i, column) in header.columns.iter().enumerate() {
        let is_foreign = !crate::cloud::column::has_fixed_type(&column.name)
            && splats.is_none_or(|splats| splats.is_other(i));
        if is_foreign && column.components > 1 {
            text += &format!("comment surfelshop column {} {}\n", column.name, column.components);
        }
    }
    let count = " ".repeat(COUNT);
    text += &format!("element vertex {count}\n");
    for (name, element) in properties {
        text += &format!("property {} {name}\n", type_name(*element));
    }
    if header.has_faces {
        text += &format!("element face {count}\nproperty list uchar int vertex_indices\n");
    }
    text + "end_header\n"
}

/// Appends the points of a batch.
fn points(block: &mut Vec<u8>, batch: &CloudView<'_>, ascii: bool) -> io::Result<()> {
    for row in 0..batch.len {
        for (i, column) in batch.columns.iter().enumerate() {
            let n = column.components as usize;
            for index in row * n..(row + 1) * n {
                if ascii {
                    if i > 0 || index > row * n {
                        block.push(b' ');
                    }
                    text_value(block, &column.values, index)?;
                } else {
                    binary_value(block, &column.values, index);
                }
            }
        }
        if ascii {
            block.push(b'\n');
        }
    }
    Ok(())
}
