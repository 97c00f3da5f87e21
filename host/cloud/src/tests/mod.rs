//! Tests through the public functions, on files made here byte by byte.

mod assembly;
mod clouds;
mod damaged;
mod edits;
mod files;
mod formats;
mod meshes;
mod objects;
mod scene;
mod splats;
mod strokes;
mod transforms;
mod writing;

use crate::{Buffer, Loaded, ReadError, ReadOptions, read};
use std::path::PathBuf;
use surfelshop_api::columns::Element;
use tempfile::TempDir;

pub(crate) const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

/// A folder with one file of these bytes.
pub(crate) fn file(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("test.ply");
    std::fs::write(&path, bytes).unwrap();
    (folder, path)
}

pub(crate) fn try_load(bytes: &[u8]) -> Result<Loaded, ReadError> {
    let (_folder, path) = file(bytes);
    read(path, &ReadOptions::default())
}

/// Loads a file and checks what holds for every loaded cloud.
pub(crate) fn load(bytes: &[u8]) -> Loaded {
    let loaded = try_load(bytes).unwrap_or_else(|error| panic!("{error}"));
    let (cloud, summary) = (&loaded.cloud, &loaded.summary);
    assert_eq!(cloud.positions().len(), cloud.len());
    assert_eq!(cloud.normals().len(), cloud.len());
    assert_eq!(cloud.radii().len(), cloud.len());
    // Files may hold normals that are a few parts in 10^5 off; their bits are kept.
    assert!(cloud.normals().iter().all(|n| (n.length_squared() - 1.0).abs() < 1.1e-4));
    assert!(cloud.radii().iter().all(|&r| r > 0.0 && r.is_finite()));
    let len = cloud.len() as u64;
    assert_eq!(summary.n_surfels, len);
    assert_eq!(summary.n_in_file, len + summary.n_dropped);
    let (n, r, c) = (&summary.normals, &summary.radii, &summary.colors);
    let of_file = n.given + n.normalised + n.repaired;
    assert_eq!(of_file + n.from_triangles + n.of_splats + n.estimated, len);
    assert_eq!(r.given + r.from_triangles + r.of_splats + r.estimated + r.clamped, len);
    assert_eq!(c.given + c.of_splats + c.neutral + c.replaced, len);
    loaded
}

/// The one line that a file is refused with, without its path.
pub(crate) fn refusal(bytes: &[u8]) -> String {
    let (_folder, path) = file(bytes);
    let error = read(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    error.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
}

/// A PLY file under construction: every value is written in the type its property declares.
pub(crate) struct Ply {
    encoding: &'static str,
    header: String,
    body: Vec<u8>,
}

impl Ply {
    pub(crate) fn new(encoding: &'static str) -> Self {
        let header = format!("ply\nformat {encoding} 1.0\n");
        Self { encoding, header, body: Vec::new() }
    }

    pub(crate) fn line(mut self, line: &str) -> Self {
        self.header.push_str(line);
        self.header.push('\n');
        self
    }

    /// Declares an element of scalar properties such as `float x`, and appends its rows.
    pub(crate) fn element(mut self, name: &str, properties: &[&str], rows: &[Vec<f64>]) -> Self {
        self = self.line(&format!("element {name} {}", rows.len()));
        for property in properties {
            self = self.line(&format!("property {property}"));
        }
        for row in rows {
            for (property, value) in properties.iter().zip(row) {
                let kind = property.split(' ').next().unwrap();
                self.value(kind, *value);
            }
            self.end_row();
        }
        self
    }

    pub(crate) fn value(&mut self, kind: &str, value: f64) {
        let big = self.encoding == "binary_big_endian";
        if self.encoding == "ascii" {
            let text = if kind.starts_with("float") && !kind.ends_with("64") {
                (value as f32).to_string()
            } else {
                value.to_string()
            };
            self.body.extend(format!("{text} ").bytes());
            return;
        }
        let mut bytes = match kind {
            "char" | "int8" => (value as i8).to_le_bytes().to_vec(),
            "uchar" | "uint8" => (value as u8).to_le_bytes().to_vec(),
            "short" | "int16" => (value as i16).to_le_bytes().to_vec(),
            "ushort" | "uint16" => (value as u16).to_le_bytes().to_vec(),
            "int" | "int32" => (value as i32).to_le_bytes().to_vec(),
            "uint" | "uint32" => (value as u32).to_le_bytes().to_vec(),
            "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
            "double" | "float64" => value.to_le_bytes().to_vec(),
            other => panic!("{other}"),
        };
        if big {
            bytes.reverse();
        }
        self.body.extend(bytes);
    }

    pub(crate) fn end_row(&mut self) {
        if self.encoding == "ascii" {
            self.body.push(b'\n');
        }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.header.clone().into_bytes();
        bytes.extend(b"end_header\n");
        bytes.extend(&self.body);
        bytes
    }

    pub(crate) fn load(&self) -> Loaded {
        load(&self.bytes())
    }
}

pub(crate) const XYZ: [&str; 3] = ["float x", "float y", "float z"];

/// Rows of the corners of a cube of edge 2.
pub(crate) fn cube() -> Vec<Vec<f64>> {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|i| vec![sign(i, 0), sign(i, 1), sign(i, 2)]).collect()
}

/// Each row with values appended.
pub(crate) fn with(rows: Vec<Vec<f64>>, value: impl Fn(usize) -> Vec<f64>) -> Vec<Vec<f64>> {
    rows.into_iter().enumerate().map(|(i, row)| [row, value(i)].concat()).collect()
}

/// Property lists joined.
pub(crate) fn also<'a>(properties: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [properties, more].concat()
}

/// The least and the greatest value of a type, zero, one and another.
pub(crate) fn edge_values(element: Element) -> [f64; 5] {
    let (least, most) = match element {
        Element::I8 => (i8::MIN.into(), i8::MAX.into()),
        Element::U8 => (0.0, u8::MAX.into()),
        Element::I16 => (i16::MIN.into(), i16::MAX.into()),
        Element::U16 => (0.0, u16::MAX.into()),
        Element::I32 => (i32::MIN.into(), i32::MAX.into()),
        Element::U32 => (0.0, u32::MAX.into()),
        Element::F32 => (f32::MIN.into(), f32::MIN_POSITIVE.into()),
        Element::F64 => (f64::MIN, f64::MIN_POSITIVE),
    };
    [least, most, 0.0, 1.0, 7.0]
}

/// A column's values, whatever their type.
pub(crate) fn values(loaded: &Loaded, column: &str) -> Vec<f64> {
    let buffer: &Buffer = loaded.cloud.column(column).unwrap().values();
    buffer.iter_f64().collect()
}
