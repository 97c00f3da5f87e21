use super::*;
use surfelshop_api::columns::Element;

#[test]
fn quantised_and_interleaved_positions_are_read() {
    let mut b = Builder::default();
    // Three positions of shorts, with normals of bytes behind them, 12 bytes apart.
    let mut bytes = Vec::new();
    for (position, normal) in [
        ([0i16, 32767, -32768], [0i8, 127, 0]),
        ([16384, 0, 1], [-128, 0, 0]),
        ([1, 2, 3], [0, 0, 127]),
    ] {
        bytes.extend(position.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([9, 9]);
        bytes.extend(normal.iter().map(|&v| v as u8));
        bytes.push(9);
    }
    // The last element ends before its stride does.
    bytes.pop();
    let view = b.view(&bytes, r#","byteStride":12"#);
    let view = format!(r#""bufferView":{view},"#);
    let position = b.accessor_of(&view, SHORT, "VEC3", 3, r#","normalized":true"#);
    let normal = b.accessor_of(&view, BYTE, "VEC3", 3, r#","normalized":true,"byteOffset":8"#);
    b.mesh(&format!(r#"{{"mode":0,"attributes":{{"POSITION":{position},"NORMAL":{normal}}}}}"#));
    let found = b.found();
    let s = 1.0 / 32767.0;
    near(values(&found, "position"), &[0.0, 1.0, -1.0, 16384.0 * s, 0.0, s, s, 2.0 * s, 3.0 * s]);
    near(values(&found, "normal"), &[0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    b.accessors[0] = b.accessors[0].replace(r#","normalized":true"#, "");
    near(
        values(&b.found(), "position"),
        &[0.0, 32767.0, -32768.0, 16384.0, 0.0, 1.0, 1.0, 2.0, 3.0],
    );
    assert_eq!(only(&b.found()).header.columns[0].element, Element::F64);
    b.views[0] = b.views[0].replace(r#""byteStride":12"#, r#""byteStride":4"#);
    assert!(b.refusal().contains("4 bytes are no distance of elements of 6"));
}

#[test]
fn sparse_elements_stand_in_the_place_of_others() {
    let mut b = Builder::default();
    let n = 70_000usize;
    let dense: Vec<u8> = (0..3 * n).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let dense = b.view(&dense, "");
    let places = [1u32, 65_535, 65_536, 69_999];
    let indices: Vec<u8> = places.iter().flat_map(|v| v.to_le_bytes()).collect();
    let indices = b.view(&indices, "");
    let others: Vec<u8> = (0..12).flat_map(|i| (-1.0 - i as f32).to_le_bytes()).collect();
    let others = b.view(&others, "");
    let sparse = format!(
        r#","sparse":{{"count":4,"indices":{{"bufferView":{indices},"componentType":{UNSIGNED_INT}}},"values":{{"bufferView":{others}}}}}"#
    );
    b.accessor_of(&format!(r#""bufferView":{dense},"#), FLOAT, "VEC3", n, &sparse);
    b.mesh(r#"{"mode":0,"attributes":{"POSITION":0}}"#);
    let mut expected: Vec<f64> = (0..3 * n).map(|i| i as f64).collect();
    for (i, place) in places.iter().enumerate() {
        (0..3).for_each(|axis| expected[3 * *place as usize + axis] = -1.0 - (3 * i + axis) as f64);
    }
    assert_eq!(values(&b.found(), "position"), expected);
    // Without others, all are zero.
    let mut zeros = b.clone();
    zeros.accessors[0] = zeros.accessors[0].replace(
        &format!(r#""bufferView":{dense},"componentType":{FLOAT},"#),
        &format!(r#""componentType":{FLOAT},"#),
    );
    let found = zeros.found();
    let position = values(&found, "position");
    assert_eq!((position[0], position[3], position[5], position[6]), (0.0, -1.0, -3.0, 0.0));
    let start = b.views[indices].find("byteOffset").unwrap() + 12;
    let offset: usize = b.views[indices][start..].split(',').next().unwrap().parse().unwrap();
    b.bytes[offset..offset + 4].copy_from_slice(&65_535u32.to_le_bytes());
    assert!(b.refusal().contains("in rising order"), "{}", b.refusal());
}

#[test]
fn elements_without_bytes_are_few() {
    let mut b = Builder::default();
    b.accessor_of("", FLOAT, "VEC3", 4_000_000_000, "");
    b.mesh(r#"{"mode":0,"attributes":{"POSITION":0}}"#);
    assert!(b.refusal().contains("expected bytes of 4000000000 elements"));
    b.accessors[0] = b.accessors[0].replace("4000000000", "2");
    near(values(&b.found(), "position"), &[0.0; 6]);
    let draco = r#"{"mode":4,"attributes":{"POSITION":0},"extensions":{"KHR_draco_mesh_compression":{"bufferView":0}}}"#;
    b.rest.clear();
    b.mesh(draco);
    assert!(b.refusal().contains("Draco"));
}

#[test]
fn attributes_of_own_names_are_columns() {
    let mut b = Builder::default();
    let one = b.floats(&[1.0, 2.0, 3.0], "VEC3");
    let two = b.floats(&[4.0, 5.0, 6.0, 7.0, 8.0, 9.0], "VEC3");
    let intensity = b.accessor(&[1, 2], UNSIGNED_BYTE, "SCALAR", 2, "");
    let share = b.accessor(&[51], UNSIGNED_BYTE, "SCALAR", 1, r#","normalized":true"#);
    let time = b.floats(&[0.5], "SCALAR");
    let flow = b.floats(&[0.25, 0.75], "VEC2");
    let short = b.accessor(&[1, 0], SHORT, "SCALAR", 1, "");
    b.mesh(&format!(
        r#"{{"mode":0,"attributes":{{"POSITION":{one},"_SHARE":{share},"_TIME":{time},"_FLOW":{flow},"_MIXED":{short},"_POSITION":{time},"_odd:Name":{time},"KHR_x:Y":{time}}}}},
           {{"mode":0,"attributes":{{"POSITION":{two},"_INTENSITY":{intensity},"_MIXED":{intensity},"_TIME":{time}}}}}"#
    ));
    let found = b.found();
    let none = f64::NAN;
    for (name, element, expected) in [
        ("intensity", Element::U8, &[0.0, 1.0, 2.0][..]),
        ("share", Element::F32, &[0.2, none, none]),
        ("time", Element::F32, &[0.5, none, none]),
        ("flow", Element::F32, &[0.25, 0.75, none, none, none, none]),
        ("mixed", Element::F64, &[1.0, 1.0, 2.0]),
        ("position_", Element::F32, &[0.5, none, none]),
        ("odd:name", Element::F32, &[0.5, none, none]),
    ] {
        near(values(&found, name), expected);
        assert_eq!(only(&found).header.column(name).unwrap().1.element, element);
    }
    assert_eq!(only(&found).header.columns.len(), 8);
    // The name that is none, and a time for one of two points.
    assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
    assert!(
        found
            .warnings
            .iter()
            .any(|line| line.contains("_TIME was left out: expected 2 elements, found 1"))
    );
}

#[test]
fn large_clouds_come_in_batches() {
    let mut b = Builder::default();
    let n = 200_000;
    let position: Vec<f32> = (0..3 * n).map(|i| i as f32).collect();
    let position = b.floats(&position, "VEC3");
    let value: Vec<f32> = (0..n).map(|i| -(i as f32)).collect();
    let value = b.floats(&value, "SCALAR");
    b.mesh(&format!(r#"{{"mode":0,"attributes":{{"POSITION":{position},"_V":{value}}}}}"#));
    let found = b.found();
    assert!(values(&found, "position").iter().enumerate().all(|(i, v)| *v == i as f64));
    assert!(values(&found, "v").iter().enumerate().all(|(i, v)| *v == -(i as f64)));
    assert_eq!(only(&found).header.columns[0].element, Element::F32);
}
