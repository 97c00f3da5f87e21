//! Records of every kind, from files made by hand.

use super::clouds::{column, read, read_columns};
use super::files::{Made, bytes_of, file_of, resolution, set};
use surfelshop_api::columns::Element;
use surfelshop_api::format::{Collected, UpAxis};

const P: u32 = 1;

/// A file with one set of one resolution.
fn file(set: Made, n: u32, records: &[u8]) -> Vec<u8> {
    file_of(vec![set.child(resolution(n, records))])
}

fn only(found: &Collected) -> &surfelshop_api::format::CollectedCloud {
    assert_eq!(found.clouds.len(), 1);
    &found.clouds[0]
}

#[test]
fn positions_alone_are_a_cloud() {
    let records = bytes_of(&[1.0, -2.0, 3.5, 4.0, 5.0, 6.0]);
    let found = read(&file(set(1, 12, &[P], &[(0, 0)]), 2, &records)).unwrap();
    let cloud = only(&found);
    assert_eq!(column(cloud, "position"), [1.0, -2.0, 3.5, 4.0, 5.0, 6.0]);
    let header = &cloud.header;
    assert_eq!((header.rows, header.columns.len(), header.up), (Some(2), 1, UpAxis::Y));
    assert_eq!(header.columns[0].element, Element::F32);
    assert_eq!((header.name.as_str(), header.metres_per_unit), ("surfelSet00", 0.0));
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn every_property_becomes_its_column() {
    // In an order of its own, with two bytes that nothing has.
    let properties = [
        (27, 2),
        (0, 6),
        (4, 18),
        (5, 22),
        (6, 26),
        (7, 38),
        (8, 46),
        (9, 50),
        (10, 51),
        (11, 55),
        (12, 56),
        (13, 60),
        (14, 61),
        (24, 62),
        (28, 86),
        (29, 90),
        (30, 94),
        (31, 98),
        (32, 99),
        (35, 103),
        (33, 0),
        (34, 0),
        (1, 111),
    ];
    let bits = properties.iter().fold([0x000f_0000 | 2 << 2, 0], |mut bits, (id, _)| {
        bits[id / 32] |= 1_u32 << (id % 32);
        bits
    });
    let mut record = vec![0xee, 0xee];
    record.extend(0xa1b2_c3d4_u32.to_be_bytes());
    record.extend(bytes_of(&[1.0, 2.0, 3.0, 0.5, 0.75, 7.0, 8.0, 9.0, 0.125, 0.375]));
    record.extend([11, 12, 13, 14, 51, 21, 22, 23, 24, 102, 31, 32, 33, 255, 204, 99]);
    record.extend(bytes_of(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, -1.5]));
    record.extend(77_u32.to_be_bytes());
    record.extend(bytes_of(&[42.0]));
    record.push(5);
    record.extend([0x01, 0x02, 0x03, 0x04]);
    record.extend(bytes_of(&[0.25, -0.25]));
    record.extend([0x0d, 0xe0]);
    let properties = properties.map(|(id, place)| (id as u16, place));
    let found = read(&file(set(1, 113, &bits, &properties), 1, &record)).unwrap();
    let cloud = only(&found);
    let single = |value: f32| f64::from(value);
    assert_eq!(column(cloud, "position"), [1.0, 2.0, 3.0]);
    assert_eq!(column(cloud, "radius"), [0.5]);
    assert_eq!(column(cloud, "weight"), [0.75]);
    assert_eq!(column(cloud, "sampling_density"), [7.0, 8.0, 9.0]);
    assert_eq!(column(cloud, "texture"), [0.125, 0.375]);
    assert_eq!(column(cloud, "ambient"), [11.0, 12.0, 13.0]);
    assert_eq!(column(cloud, "color"), [21.0, 22.0, 23.0, 24.0]);
    assert_eq!(column(cloud, "specular"), [31.0, 32.0, 33.0]);
    assert_eq!(column(cloud, "ambient_coefficient"), [single(51.0 / 255.0)]);
    assert_eq!(column(cloud, "diffuse_coefficient"), [single(102.0 / 255.0)]);
    assert_eq!(column(cloud, "specular_coefficient"), [single(204.0 / 255.0)]);
    assert_eq!(column(cloud, "shininess"), [99.0]);
    assert_eq!(column(cloud, "tangent_u"), [0.1, 0.2, 0.3].map(single));
    assert_eq!(column(cloud, "tangent_v"), [0.4, 0.5, 0.6].map(single));
    assert_eq!(column(cloud, "isovalue"), [-1.5]);
    assert_eq!(column(cloud, "origin_cell"), [77.0]);
    assert_eq!(column(cloud, "camera_depth"), [42.0]);
    assert_eq!(column(cloud, "camera_id"), [5.0]);
    assert_eq!(column(cloud, "camera_xy"), [258.0, 772.0]);
    assert_eq!(column(cloud, "camera_angles"), [0.25, -0.25]);
    assert_eq!(column(cloud, "flags"), [f64::from(0xa1b2_c3d4_u32)]);
    let normal = column(cloud, "normal");
    assert!((normal[1] - 0.597_914).abs() < 1e-6 && (normal[2] - 0.801_459).abs() < 1e-6);
    assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
    assert!(found.warnings[0].contains("opacity of 1 "), "{:?}", found.warnings);
}

#[test]
fn properties_without_their_bit_or_their_number_are_not_there() {
    let records = bytes_of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
    // The radius has a place and no bit, the weight a bit and no place.
    let made = set(1, 20, &[P | 1 << 5], &[(0, 0), (4, 12), (15, 16), (500, 0)]);
    let found = read(&file(made, 1, &records)).unwrap();
    assert_eq!(only(&found).header.columns.len(), 1);
    // Colours without a model have no bytes.
    let made = set(1, 20, &[P | 1 << 10], &[(0, 0), (10, 12)]);
    assert_eq!(only(&read(&file(made, 1, &records)).unwrap()).header.columns.len(), 1);
    // What does not fit into a record is left out, but for positions.
    let made = set(1, 20, &[P | 1 << 4], &[(0, 0), (4, 17)]);
    let found = read(&file(made, 1, &records)).unwrap();
    assert!(found.warnings[0].contains("property 4 at byte 17"), "{:?}", found.warnings);
    let line = read(&file(set(1, 20, &[P], &[(0, 9)]), 1, &records)).unwrap_err().to_string();
    assert!(line.contains("expected positions"), "{line}");
}

#[test]
fn normals_and_radii_that_are_missing_come_from_tangents_or_density() {
    let tangents = bytes_of(&[1.0, 2.0, 3.0, 0.5, 0.0, 0.0, 0.0, 2.0, 0.0, 9.0, 9.0, 9.0, 7.0]);
    let bits = [P | 1 << 1 | 1 << 4 | 1 << 24];
    let places = [(0, 0), (24, 12), (1, 36), (4, 48)];
    for (version, normal, radius) in [(0, [0.0, 0.0, 1.0], 2.0), (1, [9.0, 9.0, 9.0], 7.0)] {
        let found = read(&file(set(version, 52, &bits, &places), 1, &tangents)).unwrap();
        assert_eq!(column(only(&found), "normal"), normal, "version {version}");
        assert_eq!(column(only(&found), "radius"), [radius], "version {version}");
    }
    let bits = [P | 1 << 24];
    let found = read(&file(set(1, 52, &bits, &places[..2]), 1, &tangents)).unwrap();
    assert_eq!(column(only(&found), "normal"), [0.0, 0.0, 1.0]);
    assert_eq!(column(only(&found), "radius"), [2.0]);
    // d = 1.44 / (pi r^2) has the radius r.
    let density = bytes_of(&[0.0, 0.0, 0.0, 0.0, 1.44 / (std::f32::consts::PI * 0.25), 0.0]);
    let found = read(&file(set(1, 24, &[P | 1 << 6], &[(0, 0), (6, 12)]), 1, &density)).unwrap();
    assert!((column(only(&found), "radius")[0] - 0.5).abs() < 1e-6);
    assert!(column(only(&found), "normal").is_empty());
}

#[test]
fn codes_that_say_nothing_are_said_and_left_out() {
    let mut records = bytes_of(&[1.0, 2.0, 3.0]);
    records.extend([0xe0, 0x00]);
    records.extend(bytes_of(&[1.0, 2.0, 3.0]));
    records.extend([0xc0, 0x00]);
    let made = set(1, 14, &[P | 1 << 1 | 2 << 2], &[(0, 0), (1, 12)]);
    let found = read(&file(made, 2, &records)).unwrap();
    assert_eq!(column(only(&found), "normal"), [0.0; 6]);
    assert!(found.warnings[0].contains("1 normals have invalid codes"), "{:?}", found.warnings);
    let made = set(1, 14, &[P | 1 << 1 | 1 << 2], &[(0, 0), (1, 12)]);
    let found = read(&file(made, 2, &records)).unwrap();
    assert!(column(only(&found), "normal").is_empty());
    assert!(found.warnings[0].contains("ico8"), "{:?}", found.warnings);
    // Pointshop3D wrote angles of cameras over the position.
    let made = set(1, 14, &[P, 1 << 3], &[(0, 0), (35, 0)]);
    let found = read(&file(made, 2, &records)).unwrap();
    assert!(column(only(&found), "camera_angles").is_empty());
    assert!(found.warnings[0].contains("angles"), "{:?}", found.warnings);
}

#[test]
fn colours_of_every_model_become_red_green_blue_and_opacity() {
    let expected: [(u32, &[u8], &[f64]); 8] = [
        (0x01_0000, &[9], &[9.0, 9.0, 9.0]),
        (0x09_0000, &[9, 200], &[9.0, 9.0, 9.0, 200.0]),
        (0x07_0000, &[1, 2, 3], &[1.0, 2.0, 3.0]),
        (0x0f_0000, &[1, 2, 3, 0], &[1.0, 2.0, 3.0, 0.0]),
        (0x0f_0000, &[1, 2, 3, 255], &[1.0, 2.0, 3.0]),
        (0x10_0000, &[100, 128, 128], &[100.0, 100.0, 100.0]),
        (0x10_0000, &[100, 138, 148], &[123.0, 84.0, 120.0]),
        (0x18_0000, &[0, 0, 255, 7], &[145.0, 0.0, 0.0, 7.0]),
    ];
    for (model, bytes, rgba) in expected {
        let mut records = bytes_of(&[1.0, 2.0, 3.0]);
        records.extend(bytes);
        let record = records.len() as u32;
        let made = set(1, record, &[P | 1 << 10 | model], &[(0, 0), (10, 12)]);
        let found = read(&file(made, 1, &records)).unwrap();
        assert_eq!(column(only(&found), "color"), rgba, "{model:#x} {bytes:?}");
    }
}

#[test]
fn only_wanted_columns_are_read() {
    let mut records = bytes_of(&[1.0, 2.0, 3.0, 0.5]);
    records.extend([1, 2, 3, 4]);
    let bits = [P | 1 << 4 | 1 << 10 | 0x0f_0000];
    let bytes = file(set(1, 20, &bits, &[(0, 0), (4, 12), (10, 16)]), 1, &records);
    let names = |wanted: &[&str]| -> Vec<String> {
        let wanted: Vec<String> = wanted.iter().map(|&name| name.to_owned()).collect();
        let found = read_columns(&bytes, Some(&wanted)).unwrap();
        only(&found).header.columns.iter().map(|column| column.name.clone()).collect()
    };
    assert_eq!(names(&["position"]), ["position"]);
    assert_eq!(names(&["position", "color"]), ["position", "color"]);
    assert_eq!(names(&["radius"]), ["position", "radius"]);
}
