//! What is read, in both encodings.

use super::octree::{ATTRIBUTES, Attribute, Node, Octree, stored};
use super::{column, read, read_nodes};
use crate::decode;
use surfelshop_api::columns::Element;
use surfelshop_api::format::{Collected, PointNode, UpAxis};
use surfelshop_api::glam::DVec3;

/// The stored point of coordinates in steps, with values that follow from them.
pub(super) fn point(steps: [i32; 3]) -> Vec<u8> {
    let mut bytes: Vec<u8> = steps.into_iter().flat_map(i32::to_le_bytes).collect();
    bytes.extend((steps[0] as u16).to_le_bytes());
    bytes.extend((steps[1] as i8).to_le_bytes());
    bytes.extend((f64::from(steps[2]) + 0.5).to_le_bytes());
    bytes.extend([steps[0], -1, 0x1234].into_iter().flat_map(|x| (x as u16).to_le_bytes()));
    bytes
}

fn node(path: &'static str, steps: &[[i32; 3]], is_apart: bool) -> Node {
    Node { path, points: steps.iter().map(|&steps| point(steps)).collect(), is_apart }
}

/// Four nodes with points, and one without; the cell 4 begins a chunk, and in that the cell 43, too.
pub(super) fn nodes() -> Vec<Node> {
    vec![
        node("", &[[1, 2, 3], [15, 30, 60]], false),
        node("0", &[[0, 0, 0], [7, 15, 31], [-1, 4, 5]], false),
        node("4", &[], true),
        node("43", &[[8, 8, 16]], true),
        node("436", &[[10, 12, 20]], false),
    ]
}

fn both() -> [Collected; 2] {
    [false, true].map(|is_packed| read(&Octree::new(&ATTRIBUTES, &nodes(), is_packed)).unwrap())
}

#[test]
fn both_encodings_hold_the_same_points() {
    let [plain, packed] = both();
    for found in [&plain, &packed] {
        assert_eq!(found.warnings, [""; 0]);
        let header = &found.clouds[0].header;
        assert_eq!((header.rows, header.up, &*header.name), (Some(7), UpAxis::Z, "made"));
        assert_eq!(
            (&*header.coordinate_system, &header.comments[..]),
            ("EPSG:2992", &["by hand".to_owned()][..])
        );
        assert_eq!(header.bounds, Some([DVec3::new(0.5, 1.0, 2.0), DVec3::new(7.0, 8.0, 9.0)]));
        assert_eq!((header.step, header.tree.as_ref()), (Some(DVec3::new(0.5, 0.25, 0.125)), None));
        let columns: Vec<(&str, u32, Element)> =
            header.columns.iter().map(|c| (&*c.name, c.components, c.element)).collect();
        let expected = [
            ("position", 3, Element::F64),
            ("intensity", 1, Element::U16),
            ("scan_angle", 1, Element::F32),
            ("gps_time", 1, Element::F64),
            ("color", 3, Element::U16),
        ];
        assert_eq!(columns, expected);
        // In the order of the file.
        let steps = nodes().into_iter().flat_map(|node| node.points);
        let expected: Vec<f64> = steps
            .flat_map(|point| {
                let at = |i: usize| {
                    f64::from(i32::from_le_bytes(point[4 * i..][..4].try_into().unwrap()))
                };
                [1000.0 + 0.5 * at(0), 2000.0 + 0.25 * at(1), 3000.0 + 0.125 * at(2)]
            })
            .collect();
        assert_eq!(column(found, "position"), expected);
        assert_eq!(column(found, "scan_angle"), [2.0, 30.0, 0.0, 15.0, 4.0, 8.0, 12.0]);
        assert_eq!(column(found, "intensity")[4], 65535.0);
        assert_eq!(column(found, "color")[..3], [1.0, 65535.0, f64::from(0x1234)]);
        assert_eq!(column(found, "gps_time")[1], 60.5);
    }
    assert_eq!(plain.clouds[0].columns, packed.clouds[0].columns);
    assert_ne!(plain.clouds[0].header.format, packed.clouds[0].header.format);
}

#[test]
fn nodes_are_read_one_by_one_and_their_points_lie_in_their_cells() {
    for is_packed in [false, true] {
        let octree = Octree::new(&ATTRIBUTES, &nodes(), is_packed);
        let whole = read_nodes(&octree, Some(&[])).unwrap();
        let tree = whole.clouds[0].header.tree.clone().unwrap();
        assert_eq!((tree.low, tree.side, tree.spacing), (DVec3::new(1e3, 2e3, 3e3), 8.0, 0.75));
        let keys: Vec<(u32, [u32; 3], u64)> =
            tree.nodes.iter().map(|node| (node.level, node.cell, node.points)).collect();
        let expected = [(0, [0, 0, 0], 2), (1, [0, 0, 0], 3), (2, [2, 1, 1], 1), (3, [5, 3, 2], 1)];
        assert_eq!(keys, expected);
        // But for the cell 0, one point of which lies beyond the cube.
        for node in [&tree.nodes[3], &tree.nodes[2], &tree.nodes[0]] {
            let found = read_nodes(&octree, Some(&[*node])).unwrap();
            assert_eq!(found.clouds[0].header.tree.as_ref().unwrap().nodes, []);
            let positions = column(&found, "position");
            assert_eq!(positions.len() as u64, 3 * node.points);
            let side = tree.side / f64::from(1 << node.level);
            for place in positions.as_chunks::<3>().0 {
                let cell = (DVec3::from_array(*place) - tree.low) / side;
                assert_eq!(cell.floor().to_array(), node.cell.map(f64::from), "{place:?}");
            }
        }
        let turned: Vec<PointNode> = tree.nodes.iter().rev().copied().collect();
        let found = read_nodes(&octree, Some(&turned)).unwrap();
        assert_eq!(column(&found, "scan_angle"), [12.0, 8.0, 0.0, 15.0, 4.0, 2.0, 30.0]);
    }
}

#[test]
fn attributes_of_all_kinds_are_columns() {
    const KINDS: [Attribute; 11] = [
        ("odd", "bits", 1, 3, ""),
        ("position", "int32", 3, 4, "\"min\": []"),
        ("NormalX", "float", 1, 4, "\"min\": []"),
        ("NormalY", "float", 1, 4, "\"min\": []"),
        ("NormalZ", "float", 1, 4, "\"min\": []"),
        ("count", "int64", 1, 8, "\"min\": []"),
        ("scan angle", "int16", 1, 2, "\"min\": []"),
        ("height", "uint16", 2, 2, "\"scale\": [0.5, 2], \"offset\": [1, -1]"),
        ("radius", "uint8", 1, 1, "\"min\": []"),
        ("count", "uint8", 1, 1, "\"min\": []"),
        ("normal", "int8", 3, 1, "\"min\": []"),
    ];
    let mut kinds = KINDS;
    kinds[0].4 = "\"min\": []";
    let mut point = vec![9, 9, 9];
    point.extend([4i32, 8, 16].into_iter().flat_map(i32::to_le_bytes));
    point.extend([0.0f32, 0.6, 0.8].into_iter().flat_map(f32::to_le_bytes));
    point.extend((-3i64).to_le_bytes());
    point.extend((-1000i16).to_le_bytes());
    point.extend([10u16, 20].into_iter().flat_map(u16::to_le_bytes));
    point.extend([7, 8, 1, 2, 255]);
    for is_packed in [false, true] {
        let node = Node { path: "", points: vec![point.clone(); 2], is_apart: false };
        let found = read(&Octree::new(&kinds, &[node], is_packed)).unwrap();
        assert_eq!(
            found.warnings,
            ["the attribute `odd` of 1 numbers of the type `bits` with 3 bytes is left out"]
        );
        assert_eq!(column(&found, "position")[3..], [1002.0, 2002.0, 3002.0]);
        let normal = [0.0, f64::from(0.6f32), f64::from(0.8f32)];
        assert_eq!(column(&found, "normal")[3..], normal);
        assert_eq!(column(&found, "count"), [-3.0, -3.0]);
        assert_eq!(column(&found, "scan_angle"), [-6.0, -6.0]);
        assert_eq!(column(&found, "height"), [6.0, 39.0, 6.0, 39.0]);
        assert_eq!(column(&found, "count_"), [8.0, 8.0]);
        // Not a float, which radii are, nor three of them.
        assert_eq!(column(&found, "radius_"), [7.0, 7.0]);
        assert_eq!(column(&found, "normal_")[..3], [1.0, 2.0, -1.0]);
    }
}

#[test]
fn streams_of_the_reference_encoder_are_decompressed() {
    // 40 times "surfel by surfel, ", and the numbers from 0 to 39, by the encoder of the format's authors.
    const STREAM: [u8; 46] = [
        0x1b, 0xf7, 0x02, 0xe8, 0xc5, 0xe6, 0x46, 0xa9, 0x1e, 0x7f, 0xa1, 0x26, 0x36, 0x48, 0x24,
        0x9d, 0xc1, 0x36, 0x44, 0x16, 0x82, 0x2a, 0xdb, 0x4c, 0x0a, 0x21, 0x4e, 0xc7, 0x7d, 0x67,
        0x7a, 0x51, 0x1f, 0x1d, 0x4f, 0x62, 0x50, 0x91, 0x85, 0x97, 0x8f, 0x2d, 0xb1, 0xa8, 0x79,
        0x00,
    ];
    let mut expected = b"surfel by surfel, ".repeat(40);
    expected.extend(0..40);
    assert_eq!(decode::decompressed(&STREAM, expected.len()).unwrap(), expected);
    let line = decode::decompressed(&STREAM, expected.len() - 1).unwrap_err().to_string();
    assert!(line.contains("more than the 759 bytes"), "{line}");
    let long = b"0123456789abcdef".repeat(10_000);
    assert_eq!(decode::decompressed(&stored(&long), long.len()).unwrap(), long);
    assert_eq!(decode::decompressed(&stored(&[]), 0).unwrap(), b"");
    assert!(decode::decompressed(&STREAM[..30], 760).is_err());
}
