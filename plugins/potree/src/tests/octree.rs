//! Octrees made byte by byte, as `PotreeConverter` writes them.

use surfelshop_api::format::FileSource;

/// An attribute: name, type, elements, bytes of an element, what else `metadata.json` says of it.
pub(super) type Attribute = (&'static str, &'static str, usize, usize, &'static str);

/// Attributes of a LAS file in the order of the converter.
pub(super) const ATTRIBUTES: [Attribute; 5] = [
    ("position", "int32", 3, 4, r#""min": [0.5, 1, 2], "max": [7, 8, 9], "scale": [1, 1, 1]"#),
    ("intensity", "uint16", 1, 2, r#""scale": [1], "offset": [0]"#),
    ("scan angle rank", "uint8", 1, 1, r#""min": [-18], "max": [-1]"#),
    ("gps-time", "double", 1, 8, "\"histogram\": [1, 2]"),
    ("rgb", "uint16", 3, 2, "\"min\": [0, 0, 0]"),
];

/// A node: its path from the root, such as `07`, and its points as they are stored in the encoding DEFAULT.
pub(super) struct Node {
    pub(super) path: &'static str,
    pub(super) points: Vec<Vec<u8>>,
    /// Whether it begins a chunk of its own.
    pub(super) is_apart: bool,
}

/// The three files.
#[derive(Clone, Debug)]
pub(super) struct Octree {
    pub(super) metadata: String,
    pub(super) hierarchy: Vec<u8>,
    pub(super) octree: Vec<u8>,
}

impl Octree {
    pub(super) fn files(&self) -> FileSource {
        FileSource::of_files(vec![
            ("metadata.json", self.metadata.clone().into_bytes()),
            ("hierarchy.bin", self.hierarchy.clone()),
            ("octree.bin", self.octree.clone()),
        ])
    }

    /// The octree of these nodes, each after those above it; compressed or not.
    pub(super) fn new(attributes: &[Attribute], nodes: &[Node], is_packed: bool) -> Self {
        let mut octree = Vec::new();
        let places: Vec<(u64, u64)> = nodes
            .iter()
            .map(|node| {
                let bytes = match is_packed {
                    true => stored(&packed(attributes, &node.points)),
                    false => node.points.concat(),
                };
                let at = octree.len() as u64;
                octree.extend(&bytes);
                (at, bytes.len() as u64)
            })
            .collect();
        let (hierarchy, first) = hierarchy(nodes, &places);
        let encoding = if is_packed { "BROTLI" } else { "DEFAULT" };
        let n: usize = nodes.iter().map(|node| node.points.len()).sum();
        let list: Vec<String> = attributes
            .iter()
            .map(|(name, kind, n, size, more)| {
                let bytes = n * size;
                format!(
                    r#"{{"name": "{name}", "description": "", "size": {bytes}, "numElements": {n},
                    "elementSize": {size}, "type": "{kind}", {more}}}"#
                )
            })
            .collect();
        let metadata = format!(
            r#"{{"version": "2.0", "name": "made", "description": "by hand", "points": {n}, "projection": "EPSG:2992",
            "hierarchy": {{"firstChunkSize": {first}, "stepSize": 4, "depth": 2}},
            "offset": [1000.0, 2000.0, 3000.0], "scale": [0.5, 0.25, 0.125], "spacing": 0.75,
            "boundingBox": {{"min": [1000.0, 2000.0, 3000.0], "max": [1008.0, 2008.0, 3008.0]}},
            "encoding": "{encoding}", "attributes": [{}]}}"#,
            list.join(", ")
        );
        Self { metadata, hierarchy, octree }
    }
}

/// All chunks, and how many bytes the first has.
fn hierarchy(nodes: &[Node], places: &[(u64, u64)]) -> (Vec<u8>, usize) {
    // The paths of a chunk in its order, level by level from its root.
    let chunk = |root: &str| -> Vec<usize> {
        let mut found: Vec<usize> = (0..nodes.len())
            .filter(|&i| {
                let path = nodes[i].path;
                let apart = |j: &Node| {
                    j.is_apart
                        && j.path != root
                        && j.path.starts_with(root)
                        && path.starts_with(j.path)
                };
                // What begins another chunk is named, and what is beneath is not.
                path.starts_with(root) && !nodes.iter().any(|j| apart(j) && j.path != path)
            })
            .collect();
        found.sort_by_key(|&i| (nodes[i].path.len(), nodes[i].path));
        found
    };
    let roots: Vec<&str> =
        std::iter::once("").chain(nodes.iter().filter(|n| n.is_apart).map(|n| n.path)).collect();
    let sizes: Vec<usize> = roots.iter().map(|root| 22 * chunk(root).len()).collect();
    let mut bytes = Vec::new();
    for root in &roots {
        for i in chunk(root) {
            let path = nodes[i].path;
            let is_child =
                |other: &&Node| other.path.len() == path.len() + 1 && other.path.starts_with(path);
            let bit = |child: &Node| 1u8 << (child.path.as_bytes()[path.len()] - b'0');
            let mask = nodes.iter().filter(is_child).map(bit).fold(0, |all, bit| all | bit);
            let other = roots.iter().position(|other| *other == path && path != *root);
            let (kind, place) = match other {
                Some(i) => (2, (sizes[..i].iter().sum::<usize>() as u64, sizes[i] as u64)),
                None => (u8::from(mask == 0), places[i]),
            };
            bytes.extend([kind, mask]);
            bytes.extend((nodes[i].points.len() as u32).to_le_bytes());
            bytes.extend(place.0.to_le_bytes());
            bytes.extend(place.1.to_le_bytes());
        }
    }
    (bytes, sizes[0])
}

/// The bits of three numbers in turn, of each the lower 16.
fn dealt(numbers: [u32; 3]) -> u64 {
    let bit = |i: usize| u64::from(numbers[i % 3] >> (i / 3) & 1) << i;
    (0..48).map(bit).fold(0, |all, bit| all | bit)
}

/// The bytes of a node attribute after attribute.
pub(super) fn packed(attributes: &[Attribute], points: &[Vec<u8>]) -> Vec<u8> {
    let (mut bytes, mut before) = (Vec::new(), 0);
    for (name, _, n, size, _) in attributes {
        for point in points {
            let value = &point[before..before + n * size];
            match *name {
                "position" => {
                    let numbers = [0, 4, 8].map(|at| {
                        // As the converter does it.
                        u32::from_le_bytes(value[at..at + 4].try_into().unwrap()).wrapping_add(1)
                    });
                    bytes.extend(dealt(numbers.map(|x| x >> 16)).to_le_bytes());
                    bytes.extend(dealt(numbers).to_le_bytes());
                }
                "rgb" => {
                    let numbers =
                        [0, 2, 4].map(|at| u32::from(value[at]) | u32::from(value[at + 1]) << 8);
                    bytes.extend(dealt(numbers).to_le_bytes());
                }
                _ => bytes.extend(value),
            }
        }
        before += n * size;
    }
    bytes
}

/// A stream of RFC 7932 whose blocks are not compressed.
pub(super) fn stored(bytes: &[u8]) -> Vec<u8> {
    let (mut stream, mut is_first) = (Vec::new(), true);
    for block in bytes.chunks(1 << 16) {
        let len = block.len() as u32 - 1;
        // Not the last; lengths of four half bytes; the length; not compressed.
        let head = len << 3 | 1 << 19;
        // Before the first, windows of 2^16 bytes.
        let head = if is_first { head << 1 } else { head };
        stream.extend(&head.to_le_bytes()[..3]);
        stream.extend(block);
        is_first = false;
    }
    // The last, and empty.
    stream.push(if is_first { 0b110 } else { 0b11 });
    stream
}
