//! Extra bytes, and what their names mean.

use super::handmade::Handmade;
use super::{column, has, read};
use crate::extra::descriptor;
use surfelshop_api::columns::Element;

/// A file of one point with these fields of extra bytes and these values of them.
fn file(fields: &[[u8; 192]], values: &[u8]) -> Vec<u8> {
    let mut made = Handmade::new(4, 6).with_walk(1, values.len());
    let start = made.points.len() - values.len();
    made.points[start..].copy_from_slice(values);
    made.records.push(("LASF_Spec", 4, fields.concat()));
    made.las()
}

fn element(found: &surfelshop_api::format::Collected, name: &str) -> (Element, u32) {
    let (_, column) = found.clouds[0].header.column(name).unwrap();
    (column.element, column.components)
}

#[test]
fn numbers_of_all_types_are_read() {
    let types: [(u8, Vec<u8>, Element, f64); 10] = [
        (1, vec![200], Element::U8, 200.0),
        (2, vec![200], Element::I8, -56.0),
        (3, 60_000u16.to_le_bytes().to_vec(), Element::U16, 60_000.0),
        (4, (-3i16).to_le_bytes().to_vec(), Element::I16, -3.0),
        (5, u32::MAX.to_le_bytes().to_vec(), Element::U32, 4_294_967_295.0),
        (6, i32::MIN.to_le_bytes().to_vec(), Element::I32, -2_147_483_648.0),
        (7, (1u64 << 60).to_le_bytes().to_vec(), Element::F64, (1u64 << 60) as f64),
        (8, (-5i64).to_le_bytes().to_vec(), Element::F64, -5.0),
        (9, 0.25f32.to_le_bytes().to_vec(), Element::F32, 0.25),
        (10, 1e300f64.to_le_bytes().to_vec(), Element::F64, 1e300),
    ];
    let (mut fields, mut values) = (Vec::new(), Vec::new());
    for (code, bytes, ..) in &types {
        fields.push(descriptor(&format!("type {code}"), "what it is", *code));
        values.extend(bytes);
    }
    // Three components of two bytes, which newer versions of the standard no longer have.
    fields.push(descriptor("three", "", 23));
    values.extend([1u16, 2, 3].iter().flat_map(|value| value.to_le_bytes()));
    let found = read(file(&fields, &values)).unwrap();
    for (code, _, expected, value) in types {
        let name = format!("type {code}");
        assert_eq!(element(&found, &name), (expected, 1));
        assert_eq!(column(&found, &name), [value]);
        assert_eq!(found.clouds[0].header.column(&name).unwrap().1.description, "what it is");
    }
    assert_eq!(
        (element(&found, "three"), column(&found, "three")),
        ((Element::U16, 3), &[1.0, 2.0, 3.0][..])
    );
    let said = found.warnings.iter().filter(|line| line.contains("64 bits")).count();
    assert_eq!((said, found.warnings.len()), (2, 2));
}

#[test]
fn scales_and_offsets_make_floats() {
    let mut field = descriptor("height", "", 4);
    field[3] = 8 | 16;
    field[112..120].copy_from_slice(&0.01f64.to_le_bytes());
    field[136..144].copy_from_slice(&100f64.to_le_bytes());
    let mut idle = descriptor("idle", "", 4);
    idle[3] = 8;
    idle[112..120].copy_from_slice(&1f64.to_le_bytes());
    let values = [(-250i16).to_le_bytes(), 7i16.to_le_bytes()].concat();
    let found = read(file(&[field, idle], &values)).unwrap();
    assert_eq!(
        (element(&found, "height").0, column(&found, "height")),
        (Element::F64, &[97.5][..])
    );
    assert_eq!((element(&found, "idle").0, column(&found, "idle")), (Element::I16, &[7.0][..]));
}

#[test]
fn names_that_are_taken_or_have_a_meaning_of_another_shape_get_a_mark() {
    let names = ["Intensity", "twice", "Twice", "", "normal", "material", "a\u{7}b"];
    let fields: Vec<_> = names.iter().map(|name| descriptor(name, "", 1)).collect();
    let found = read(file(&fields, &[1, 2, 3, 4, 5, 6, 7])).unwrap();
    let columns = &found.clouds[0].header.columns;
    let names: Vec<_> = columns[12..].iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["Intensity_", "twice", "Twice_", "extra_15", "normal_", "material", "ab"]);
}

#[test]
fn components_come_together() {
    let float = |name: &str, text: &str| descriptor(name, text, 9);
    let fields = [
        float("NormalX", ""),
        float("NormalZ", ""),
        float("tangent_u_0", "component 1 of 3"),
        float("tangent_u_1", "component 2 of 3"),
        float("tangent_u_2", "component 3 of 3"),
        float("NormalY", ""),
        float("half_0", "component 1 of 2"),
        float("radius", ""),
        float("intensity_", "the column intensity"),
        float("nir_", "the column nir"),
    ];
    let values: Vec<u8> = (1..=10).flat_map(|value| (value as f32).to_le_bytes()).collect();
    let found = read(file(&fields, &values)).unwrap();
    assert_eq!(column(&found, "normal"), [1.0, 6.0, 2.0]);
    assert_eq!(column(&found, "tangent_u"), [3.0, 4.0, 5.0]);
    assert_eq!(column(&found, "half_0"), [7.0]);
    assert_eq!(column(&found, "radius"), [8.0]);
    assert_eq!(
        (element(&found, "intensity").0, column(&found, "intensity")),
        (Element::F32, &[9.0][..])
    );
    assert_eq!(column(&found, "nir"), [10.0]);
    assert!(!has(&found, "intensity_") && !has(&found, "nir_") && !has(&found, "NormalX"));
}

#[test]
fn fields_may_be_described_in_several_records() {
    let mut made = Handmade::new(4, 6).with_walk(2, 3);
    made.records.push(("LASF_Spec", 4, descriptor("first", "", 1).to_vec()));
    made.records.push(("LASF_Spec", 4, descriptor("second", "", 3).to_vec()));
    let found = read(made.las()).unwrap();
    assert!(has(&found, "first") && has(&found, "second") && found.warnings.is_empty());
}

#[test]
fn bytes_that_nobody_describes_are_one_column() {
    let made = Handmade::new(2, 1).with_walk(5, 4);
    let found = read(made.las()).unwrap();
    assert_eq!(element(&found, "extra_bytes"), (Element::U8, 4));
    let last = &made.points[made.points.len() - 4..];
    let found_last = &column(&found, "extra_bytes")[16..];
    assert!(found_last.iter().zip(last).all(|(found, byte)| *found == f64::from(*byte)));
    assert!(found.warnings[0].contains("4 extra bytes"), "{:?}", found.warnings);
}
