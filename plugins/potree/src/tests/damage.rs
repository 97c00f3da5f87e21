//! What is damaged is refused in one line, or read as far as it can be.

use super::octree::{ATTRIBUTES, Node, Octree};
use super::reading::nodes;
use super::{read, read_nodes, refusal};
use surfelshop_api::format::{CloudSink, Collected, FileSource, Format as _};
use surfelshop_api::prelude::{HostInfo, Job};

fn made(is_packed: bool) -> Octree {
    Octree::new(&ATTRIBUTES, &nodes(), is_packed)
}

#[test]
fn what_metadata_says_wrongly_is_named() {
    for (from, to, expected) in [
        ("\"2.0\"", "\"1.8\"", "expected a Potree octree of version 2, found `1.8`"),
        (
            "\"DEFAULT\"",
            "\"ZSTD\"",
            "expected points of the encoding DEFAULT or BROTLI, found `ZSTD`",
        ),
        ("\"spacing\": 0.75", "\"spacing\": 0", "a spacing above 0"),
        (
            "\"max\": [1008.0, 2008.0, 3008.0]",
            "\"max\": [1000.0, 2000.0, 3000.0]",
            "expected a boundingBox",
        ),
        (
            "\"name\": \"position\"",
            "\"name\": \"place\"",
            "expected an attribute `position` of three numbers, found none",
        ),
        (
            "\"size\": 12",
            "\"size\": 13",
            "the attribute `position` of 1 byte or more, and 65536 of all at most, found 3 elements of 4 bytes",
        ),
        ("\"elementSize\": 4", "\"elementSize\": 18446744073709551615", "the attribute `position`"),
        (
            "\"firstChunkSize\": 66",
            "\"firstChunkSize\": 67",
            "hierarchy.bin: expected a chunk of whole nodes",
        ),
        ("\"firstChunkSize\": 66", "\"firstChunkSize\": 44", "found the chunk's end"),
        ("\"firstChunkSize\": 66", "\"firstChunkSize\": 88", "found more"),
        (
            "\"offset\": [1000.0, 2000.0, 3000.0]",
            "\"offset\": [1000.0]",
            "expected a metadata.json of Potree 2",
        ),
        (
            "{\"version\"",
            "{\"versio\"",
            "expected a metadata.json of Potree 2; missing field `version`",
        ),
    ] {
        let mut octree = made(false);
        assert!(octree.metadata.contains(from), "{from}");
        octree.metadata = octree.metadata.replacen(from, to, 1);
        let line = refusal(&octree);
        assert!(line.contains(expected), "{line}");
    }
    let mut octree = made(false);
    octree.metadata = octree.metadata.replace("\"points\": 7", "\"points\": 8");
    let found = read(&octree).unwrap();
    assert_eq!(found.warnings, ["metadata.json announces 8 points, and the octree has 7"]);
}

#[test]
fn missing_files_are_named() {
    let octree = made(false);
    for (name, bytes) in [("hierarchy.bin", &octree.hierarchy), ("octree.bin", &octree.octree)] {
        let files =
            vec![("metadata.json", octree.metadata.clone().into_bytes()), (name, bytes.clone())];
        let mut found = Collected::default();
        let read = crate::Potree::new(&HostInfo::default()).unwrap().read(
            &FileSource::of_files(files),
            &(),
            &mut CloudSink::new(&mut found, None),
            &Job::new(&super::SerialHost),
        );
        let missing = if name == "octree.bin" { "hierarchy.bin" } else { "octree.bin" };
        let line = read.unwrap_err().to_string();
        assert!(line.contains(&format!("expected the file `{missing}`")), "{line}");
    }
}

#[test]
fn nodes_without_their_bytes_are_named() {
    for is_packed in [false, true] {
        let mut octree = made(is_packed);
        octree.octree.pop();
        assert!(refusal(&octree).contains("points in the octree of"));
        // A node with a point more than it has.
        let mut octree = made(is_packed);
        octree.hierarchy[2] += 1;
        let line = refusal(&octree);
        assert!(
            line.contains("octree.bin: the node of level 0, cell [0, 0, 0] with 3 points"),
            "{line}"
        );
        assert!(
            line.contains("expected 29 bytes a point")
                || line.contains("expected 35 bytes a point"),
            "{line}"
        );
        let mut octree = made(is_packed);
        octree.hierarchy[2..6].fill(0xff);
        assert!(refusal(&octree).contains("is damaged"));
    }
    let mut octree = made(true);
    octree.octree[..3].fill(0xff);
    assert!(refusal(&octree).contains("the node of level 0"));
    let tree = read_nodes(&made(true), Some(&[])).unwrap().clouds[0].header.tree.clone().unwrap();
    // Others can still be read.
    assert!(read_nodes(&octree, Some(&tree.nodes[1..2])).is_ok());
}

#[test]
fn chunks_that_lead_back_end() {
    // The chunk of the cell 4 names another, which is made the first one.
    let mut octree = made(false);
    let place = 66 + 22 + 6;
    octree.hierarchy[place..place + 8].fill(0);
    let line = refusal(&octree);
    assert!(line.contains("hierarchy.bin: expected"), "{line}");
    let root = Node { path: "", points: Vec::new(), is_apart: false };
    let mut octree = Octree::new(&ATTRIBUTES, &[root], false);
    // The root stands for the chunk that it is in.
    octree.hierarchy[0] = 2;
    octree.hierarchy[14] = 22;
    let line = refusal(&octree);
    assert!(line.contains("hierarchy.bin: expected a chunk of whole nodes"), "{line}");
}

/// Cost: two seconds.
#[test]
fn no_byte_does_harm() {
    for is_packed in [false, true] {
        let whole = made(is_packed);
        let mut n_refused = 0;
        let mut judge = |octree: &Octree| {
            for nodes in [None, Some(&[][..])] {
                match read_nodes(octree, nodes) {
                    Ok(found) => assert!(found.clouds.len() <= 1),
                    Err(error) => {
                        n_refused += 1;
                        assert!(!error.to_string().contains('\n'));
                    }
                }
            }
        };
        for flip in [0x01, 0x80, 0xff] {
            for i in 0..whole.hierarchy.len() {
                let mut octree = whole.clone();
                octree.hierarchy[i] ^= flip;
                judge(&octree);
            }
            for i in 0..whole.octree.len() {
                let mut octree = whole.clone();
                octree.octree[i] ^= flip;
                judge(&octree);
            }
        }
        for len in 0..whole.metadata.len() {
            let mut octree = whole.clone();
            octree.metadata.truncate(len);
            judge(&octree);
            // Digits, quotes and brackets that are others.
            for letter in ["9", "-", "e", "\"", "}", "{", "]", ","] {
                let mut octree = whole.clone();
                octree.metadata.replace_range(len..=len, letter);
                judge(&octree);
            }
        }
        for len in 0..whole.hierarchy.len() {
            let mut octree = whole.clone();
            octree.hierarchy.truncate(len);
            judge(&octree);
        }
        assert!(n_refused > 500, "{n_refused}");
    }
}

#[test]
fn attributes_that_are_too_many_or_too_large_are_refused_before_memory_is_taken() {
    let attribute = |n: u64, size: u64| {
        format!(
            r#"{{"name": "a", "size": {}, "numElements": {n}, "elementSize": {size}, "type": "uint8"}}"#,
            n * size
        )
    };
    for (attributes, expected) in [
        (vec![attribute(60_000, 1); 2], "65536 of all at most"),
        (vec![attribute(1, 1); 300], "at most 256 attributes, found"),
        (vec![attribute(0, 8)], "1 byte or more"),
        (vec![attribute(1 << 40, 0)], "1 byte or more"),
        (vec!["{}".to_owned(); 400_000], "at most 1048576 bytes"),
    ] {
        let mut octree = made(false);
        let more = format!("\"attributes\": [{}, ", attributes.join(","));
        octree.metadata = octree.metadata.replace("\"attributes\": [", &more);
        let line = refusal(&octree);
        assert!(line.contains(expected), "{line}");
    }
    // More than columns have, beside others that are read.
    let mut octree = made(false);
    let more = format!("\"attributes\": [{}, ", attribute(2000, 1));
    octree.metadata = octree.metadata.replace("\"attributes\": [", &more);
    octree.octree = [vec![0; 2000], octree.octree[..29].to_vec()].concat();
    octree.hierarchy = [&[1, 0, 1, 0, 0, 0][..], &[0; 8], &2029u64.to_le_bytes()].concat();
    octree.metadata = octree.metadata.replace("\"firstChunkSize\": 66", "\"firstChunkSize\": 22");
    let found = read(&octree).unwrap();
    assert!(found.warnings[0].contains("`a` of 2000 numbers"), "{:?}", found.warnings);
    assert_eq!(super::column(&found, "scan_angle"), [2.0]);
}
