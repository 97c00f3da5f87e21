//! The layout of the file.
//!
//! All numbers are little endian.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | `\x89SURFEL\n` |
//! | 8..12 | version, 1 |
//! | 12..16 | number of nodes, above 0 |
//! | 16..24, 24..32, 32..36 | offset, length and CRC-32 of the directory, JSON |
//! | 40..48, 48..56, 56..60 | offset, length and CRC-32 of the table of nodes |
//! | 60..64 | CRC-32 of bytes 0..60 |
//!
//! A record of the table has 120 bytes, and 24 for each column of the directory. Node 0 is the root; the children of a
//! node follow each other, and stand behind it.
//!
//! | bytes | what |
//! |---|---|
//! | 0..4, 4..8 | first child and number of children, 0 to 8 |
//! | 8..12 | number of surfels |
//! | 12..16 | level: halvings of the root's cube |
//! | 16..40 | origin, three f64: positions are offsets from it |
//! | 40..64 | middle of the box around the centres of all surfels beneath, three f64 |
//! | 64..68 | from there to the farthest centre |
//! | 68..72 | largest half axis of any surfel beneath and of its own |
//! | 72..76 | largest radius of its merged surfels; 0 of a leaf |
//! | 76..80 | how far from a merged surfel those that it stands for lie at most; 0 of a leaf |
//! | 80..92, 92..96 | axis of the cone of normals, and the least cosine to it; -1 where there is none |
//! | 96..104 | surfels of the leaves beneath |
//! | 104..120 | zeros |
//! | then for each column | offset u64, stored length u32, encoding u32, CRC-32 u32, zero u32 |
//!
//! A column of length 0 is absent from the node. Encoding 0 is the values as they are; 1 is their bytes in planes, all
//! lowest bytes first, as an LZ4 block.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::io::Read as _;
use std::path::Path;
use surfelshop_api::format::FileColumn;
use surfelshop_cloud::{Source, files};

/// The first bytes.
pub(crate) const MAGIC: [u8; 8] = *surfelshop_cloud::PYRAMID;
/// The version that is written.
pub(crate) const VERSION: u32 = 1;
/// Bytes before the first column.
pub(crate) const HEADER: usize = 64;
/// Bytes of a record before its columns, and of each of these.
const RECORD: usize = 120;
const COLUMN: usize = 24;
/// The most nodes of a file: 2^26 leaves of tens of thousands are more points than there are.
const MAX_NODES: u32 = 1 << 26;
/// The most columns.
const MAX_COLUMNS: usize = 4096;
/// The most surfels of a node.
pub(crate) const MAX_SURFELS: u32 = 1 << 28;
/// The longest directory, bytes.
const MAX_DIRECTORY: u64 = 64 << 20;

/// Whether a file that begins so is a pyramid.
#[must_use]
pub fn is_pyramid(head: &[u8]) -> bool {
    head.starts_with(&MAGIC)
}

/// Whether a file is a pyramid; one that cannot be read is none.
#[must_use]
pub fn is_pyramid_file(path: &Path) -> bool {
    let Ok((file, _)) = files::open(path) else { return false };
    let mut head = Vec::new();
    file.take(MAGIC.len() as u64).read_to_end(&mut head).is_ok() && is_pyramid(&head)
}

/// What the file says of the whole.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Directory {
    /// The program that made it.
    pub generator: String,
    /// The columns of the nodes; which of them a node has, its record says.
    pub columns: Vec<FileColumn>,
    /// Surfels of all leaves.
    pub n_surfels: u64,
    /// Number of leaves, and of all nodes.
    pub n_leaves: u64,
    /// See there.
    pub n_nodes: u64,
    /// Smallest and largest coordinates of the centres.
    pub bounds: [DVec3; 2],
    /// Largest radius of a surfel of a leaf, scene units.
    pub largest_radius: f32,
    /// What the files said that it was made of.
    pub source: StoredSource,
    /// What was done to the points, one sentence each.
    pub notes: Vec<String>,
}

/// What a file said of its points besides them.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct StoredSource {
    /// The axis that points upwards.
    pub up: surfelshop_api::format::UpAxis,
    /// Metres per unit; 0 where nobody said.
    pub metres_per_unit: f64,
    /// The coordinate reference system, as text.
    pub coordinate_system: String,
    /// When it was taken.
    pub time: String,
    /// Steps that coordinates were rounded to.
    pub step: Option<DVec3>,
    /// Where the scans were taken from.
    pub scanners: Vec<Option<DVec3>>,
}

impl From<&Source> for StoredSource {
    fn from(source: &Source) -> Self {
        Self {
            up: source.up,
            metres_per_unit: source.metres_per_unit,
            coordinate_system: source.coordinate_system.clone(),
            time: source.time.clone(),
            step: source.step,
            scanners: source.scanners().unwrap_or_default(),
        }
    }
}

impl StoredSource {
    /// The same for a cloud.
    #[must_use]
    pub fn of_cloud(&self) -> Source {
        let scan = |scanner: &Option<DVec3>| surfelshop_cloud::Scan {
            name: String::new(),
            pose: Default::default(),
            scanner: *scanner,
        };
        Source {
            up: self.up,
            metres_per_unit: self.metres_per_unit,
            coordinate_system: self.coordinate_system.clone(),
            time: self.time.clone(),
            step: self.step,
            scans: self.scanners.iter().map(scan).collect(),
            ..Source::default()
        }
    }
}

/// Where a column of a node is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Stored {
    pub(crate) offset: u64,
    pub(crate) length: u32,
    pub(crate) encoding: u32,
    pub(crate) crc: u32,
}

/// A node.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeRecord {
    /// First child among the nodes, and how many there are.
    pub children: [u32; 2],
    /// Its surfels.
    pub n_surfels: u32,
    /// Halvings of the root's cube.
    pub level: u32,
    /// What its positions are relative to.
    pub origin: DVec3,
    /// Middle of the box around all centres beneath.
    pub middle: DVec3,
    /// From there to the farthest, scene units.
    pub spread: f32,
    /// Largest half axis, scene units.
    pub reach: f32,
    /// Largest radius of merged surfels, scene units.
    pub grain: f32,
    /// How far from them those that they stand for lie at most, scene units.
    pub apart: f32,
    /// A unit vector.
    pub axis: Vec3,
    /// Least cosine of the angle between it and the normals; -1 where that is not known.
    pub cosine: f32,
    /// Surfels of the leaves beneath.
    pub n_beneath: u64,
    /// By the columns of the directory.
    pub(crate) columns: Vec<Stored>,
}

impl NodeRecord {
    /// Whether its surfels are those of the source.
    #[must_use]
    pub fn is_leaf(&self) -> bool {
        self.children[1] == 0
    }

    /// Bytes of its columns in the file.
    #[must_use]
    pub fn stored_bytes(&self) -> u64 {
        self.columns.iter().map(|column| u64::from(column.length)).sum()
    }

    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let start = out.len();
        for number in [self.children[0], self.children[1], self.n_surfels, self.level] {
            out.extend(number.to_le_bytes());
        }
        for number in self.origin.to_array().into_iter().chain(self.middle.to_array()) {
            out.extend(number.to_le_bytes());
        }
        let floats = [self.spread, self.reach, self.grain, self.apart];
        for number in floats.into_iter().chain(self.axis.to_array()).chain([self.cosine]) {
            out.extend(number.to_le_bytes());
        }
        out.extend(self.n_beneath.to_le_bytes());
        out.resize(start + RECORD, 0);
        for column in &self.columns {
            out.extend(column.offset.to_le_bytes());
            for number in [column.length, column.encoding, column.crc, 0] {
                out.extend(number.to_le_bytes());
            }
        }
    }

    fn of(bytes: &[u8]) -> Self {
        let u32_at = |at: usize| u32::from_le_bytes(array(bytes, at));
        let f32_at = |at: usize| f32::from_le_bytes(array(bytes, at));
        let f64_at = |at: usize| f64::from_le_bytes(array(bytes, at));
        let u64_at = |at: usize| u64::from_le_bytes(array(bytes, at));
        let vector = |at: usize| DVec3::new(f64_at(at), f64_at(at + 8), f64_at(at + 16));
        let columns = (RECORD..bytes.len()).step_by(COLUMN).map(|at| Stored {
            offset: u64_at(at),
            length: u32_at(at + 8),
            encoding: u32_at(at + 12),
            crc: u32_at(at + 16),
        });
        Self {
            children: [u32_at(0), u32_at(4)],
            n_surfels: u32_at(8),
            level: u32_at(12),
            origin: vector(16),
            middle: vector(40),
            spread: f32_at(64),
            reach: f32_at(68),
            grain: f32_at(72),
            apart: f32_at(76),
            axis: Vec3::new(f32_at(80), f32_at(84), f32_at(88)),
            cosine: f32_at(92),
            n_beneath: u64_at(96),
            columns: columns.collect(),
        }
    }

    /// What cannot be right in it, if anything is.
    pub(crate) fn fault(&self, number: u32, n_nodes: u32, end: u64) -> Option<&'static str> {
        let [first, count] = self.children;
        let floats = [self.spread, self.reach, self.grain, self.apart];
        let is_length = |x: &f32| x.is_finite() && *x >= 0.0;
        let stored = |stored: &Stored| {
            stored.offset.checked_add(u64::from(stored.length)).is_some_and(|last| last <= end)
        };
        if count > 8 || (count > 0 && (first <= number || first > n_nodes - count.min(n_nodes))) {
            Some("children that do not follow it")
        } else if self.n_surfels > MAX_SURFELS {
            Some("more surfels than a node may have")
        } else if !self.origin.is_finite() || !self.middle.is_finite() {
            Some("a place that is no number")
        } else if !floats.iter().all(is_length) || !self.axis.is_finite() {
            Some("a length that is none")
        } else if !self.cosine.is_finite() {
            Some("a cone that is none")
        } else if !self.columns.iter().all(stored) {
            Some("columns behind the file's end")
        } else {
            None
        }
    }
}

fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    // All callers stay within a record whose length was checked.
    let mut found = [0; N];
    if let Some(bytes) = bytes.get(at..at + N) {
        found.copy_from_slice(bytes);
    }
    found
}

/// Where the directory and the table of nodes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) n_nodes: u32,
    /// Offset, length and checksum.
    pub(crate) directory: (u64, u64, u32),
    pub(crate) nodes: (u64, u64, u32),
}

impl Header {
    pub(crate) fn bytes(&self) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        put(0, &MAGIC);
        put(8, &VERSION.to_le_bytes());
        put(12, &self.n_nodes.to_le_bytes());
        for (at, (offset, length, crc)) in [(16, self.directory), (40, self.nodes)] {
            put(at, &offset.to_le_bytes());
            put(at + 8, &length.to_le_bytes());
            put(at + 16, &crc.to_le_bytes());
        }
        let crc = crc32fast::hash(&bytes[..60]);
        bytes[60..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    /// Reads a header of a file of so many bytes.
    pub(crate) fn of(bytes: &[u8; HEADER], file: u64) -> Result<Self, String> {
        if !is_pyramid(bytes) {
            return Err("expected a pyramid, which begins with \\x89SURFEL; make one with \
                        `surfelshop index`"
                .to_owned());
        }
        let u32_at = |at: usize| u32::from_le_bytes(array(bytes, at));
        let u64_at = |at: usize| u64::from_le_bytes(array(bytes, at));
        let version = u32_at(8);
        if version != VERSION {
            return Err(format!(
                "expected a pyramid of version {VERSION}, found {version}; make it again with \
                 `surfelshop index`"
            ));
        }
        if u32_at(60) != crc32fast::hash(&bytes[..60]) {
            return Err(damaged("its first 64 bytes do not have their checksum"));
        }
        let part = |at: usize| (u64_at(at), u64_at(at + 8), u32_at(at + 16));
        let header = Self { n_nodes: u32_at(12), directory: part(16), nodes: part(40) };
        let is_within = |(offset, length, _): (u64, u64, u32)| {
            offset.checked_add(length).is_some_and(|end| end <= file)
        };
        for (part, what) in [(header.directory, "directory"), (header.nodes, "table of nodes")] {
            if !is_within(part) {
                return Err(damaged(&format!("its {what} reaches behind its end, byte {file}")));
            }
        }
        if let Some(fault) = header_fault(header.n_nodes, header.directory.1) {
            return Err(damaged(&format!("it has {fault}")));
        }
        Ok(header)
    }
}

/// What cannot be right in a header, if anything is.
pub(crate) fn header_fault(n_nodes: u32, directory: u64) -> Option<&'static str> {
    match (n_nodes, directory) {
        (0, _) => Some("no nodes"),
        (n, _) if n > MAX_NODES => Some("more nodes than a pyramid may have"),
        (_, length) if length > MAX_DIRECTORY => Some("a directory that is too long"),
        _ => None,
    }
}

/// A line about a damaged file.
pub(crate) fn damaged(what: &str) -> String {
    format!(
        "the pyramid is damaged: {what}; copy it again, or make it again with `surfelshop index`"
    )
}

/// The directory, in JSON.
pub(crate) fn directory(bytes: &[u8]) -> Result<Directory, String> {
    let found: Directory = serde_json::from_slice(bytes)
        .map_err(|error| damaged(&format!("its directory cannot be read ({error})")))?;
    if found.columns.len() > MAX_COLUMNS {
        return Err(damaged("its directory has too many columns"));
    }
    if !found.bounds.iter().all(|corner| corner.is_finite()) || !found.largest_radius.is_finite() {
        return Err(damaged("its directory has bounds that are no numbers"));
    }
    Ok(found)
}

/// Bytes of the table of nodes.
pub(crate) fn table_bytes(n_nodes: u32, n_columns: usize) -> u64 {
    u64::from(n_nodes) * (RECORD + COLUMN * n_columns) as u64
}

/// The nodes, each of which was checked.
pub(crate) fn nodes(
    bytes: &[u8],
    n_nodes: u32,
    n_columns: usize,
    end: u64,
) -> Result<Vec<NodeRecord>, String> {
    let mut found = Vec::with_capacity(n_nodes as usize);
    // Numbered level by level, so that each node but the root is the child of one.
    let mut next = 1u64;
    for (number, record) in bytes.chunks_exact(RECORD + COLUMN * n_columns).enumerate() {
        let node = NodeRecord::of(record);
        if let Some(fault) = node.fault(number as u32, n_nodes, end) {
            return Err(damaged(&format!("node {number} has {fault}")));
        }
        let [first, count] = node.children;
        if count > 0 && u64::from(first) != next {
            return Err(damaged(&format!("node {number} has the children of another")));
        }
        next += u64::from(count);
        found.push(node);
    }
    if next != found.len() as u64 {
        return Err(damaged("its nodes do not make a tree"));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_and_records_come_back() {
        let header = Header { n_nodes: 7, directory: (100, 20, 3), nodes: (120, 80, 9) };
        let bytes = header.bytes();
        assert_eq!(Header::of(&bytes, 200), Ok(header));
        assert!(Header::of(&bytes, 199).is_err(), "it ends too early");
        for at in 0..HEADER {
            let mut changed = bytes;
            changed[at] ^= 4;
            assert!(Header::of(&changed, 200).is_err(), "byte {at}");
        }
        let node = NodeRecord {
            children: [1, 2],
            n_surfels: 5,
            level: 3,
            origin: DVec3::new(1.0, 2.0, 1e6),
            middle: DVec3::new(0.5, -2.0, 3.0),
            spread: 1.5,
            reach: 0.25,
            grain: 0.125,
            apart: 0.5,
            axis: Vec3::Y,
            cosine: 0.75,
            n_beneath: 1 << 40,
            columns: vec![Stored { offset: 64, length: 9, encoding: 1, crc: 8 }],
        };
        let mut bytes = Vec::new();
        node.put(&mut bytes);
        assert_eq!(bytes.len() as u64, table_bytes(1, 1));
        for _ in 0..2 {
            NodeRecord { children: [0, 0], ..node.clone() }.put(&mut bytes);
        }
        assert_eq!(nodes(&bytes, 3, 1, 73).map(|nodes| nodes[0].clone()), Ok(node));
        assert!(nodes(&bytes, 3, 1, 72).is_err(), "columns behind the end");
        assert!(nodes(&bytes, 2, 1, 73).is_err(), "children that are not there");
        let third = bytes.len() / 3;
        assert!(nodes(&bytes[..2 * third], 3, 1, 73).is_err(), "a child is missing");
    }
}
