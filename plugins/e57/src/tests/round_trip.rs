//! What was written is what is read.

use super::*;
use surfelshop_api::columns::Element;
use surfelshop_api::format::Pose;
use surfelshop_api::glam::{DQuat, DVec3};

fn places(n: usize, seed: u64) -> Buffer {
    let mut random = Random(seed);
    Buffer::F64((0..3 * n).map(|_| 40.0 * random.float()).collect())
}

fn header(name: &str, at: f64) -> CloudHeader {
    CloudHeader {
        name: name.to_owned(),
        pose: Pose {
            rotation: DQuat::from_rotation_z(at) * DQuat::from_rotation_x(0.3),
            translation: DVec3::new(at, -2.0 * at, 4e5),
        },
        scanner: Some(DVec3::ZERO),
        up: UpAxis::Z,
        metres_per_unit: 1.0,
        coordinate_system: "EPSG:25832".to_owned(),
        time: "2024-05-17 09:30:00 UTC".to_owned(),
        comments: vec!["sensor vendor: Maker".to_owned(), "a note".to_owned()],
        ..CloudHeader::default()
    }
}

/// Two scans with different poses.
pub(super) fn two_scans() -> Vec<TestCloud> {
    let mut random = Random(3);
    let (n, m) = (5000, 1500);
    let first = TestCloud { header: header("hall, north", 0.7), ..TestCloud::default() }
        .with("position", 3, places(n, 1))
        .with("color", 3, Buffer::U8((0..3 * n).map(|_| random.next() as u8).collect()))
        .with("intensity", 1, Buffer::F32((0..n).map(|_| random.float() as f32).collect()))
        .with("row_index", 1, Buffer::U32((0..n as u32).map(|i| i / 50).collect()))
        .with("column_index", 1, Buffer::U32((0..n as u32).map(|i| i % 50).collect()))
        .with("normal", 3, Buffer::F32((0..3 * n).map(|_| random.float() as f32).collect()));
    let second = TestCloud { header: header("hall, south", -1.9), ..TestCloud::default() }
        .with("position", 3, places(m, 2))
        .with("color", 3, Buffer::U16((0..3 * m).map(|_| random.next() as u16).collect()))
        .with("intensity", 1, Buffer::U16((0..m).map(|_| random.next() as u16).collect()))
        .with("return_number", 1, Buffer::U8((0..m).map(|i| (i % 3) as u8 + 1).collect()))
        .with("n_returns", 1, Buffer::U8(vec![3; m]))
        .with("time_stamp", 1, Buffer::F64((0..m).map(|i| i as f64 * 1e-6).collect()))
        .with("tangent_u", 3, Buffer::F32((0..3 * m).map(|_| random.float() as f32).collect()))
        .with("radius", 1, Buffer::F32((0..m).map(|i| i as f32).collect()))
        .with("label", 1, Buffer::I16((0..m).map(|i| i as i16 - 700).collect()))
        .with("classification", 1, Buffer::U8((0..m).map(|i| i as u8).collect()));
    let mut scans = vec![first, second];
    "s".clone_into(&mut scans[1].header.columns[5].unit);
    scans
}

fn widened(values: &Buffer) -> Vec<f64> {
    values.values().iter_f64().collect()
}

#[test]
fn two_scans_come_back_with_all_their_columns() {
    let mut clouds = two_scans();
    let (bytes, lines) = written(&clouds);
    assert_eq!(lines, Vec::<String>::new());
    let found = read(bytes).unwrap();
    // One scan has colours of 16 bits, so that both do.
    let Buffer::U8(bytes) = &clouds[0].columns[1] else { panic!() };
    clouds[0].columns[1] = Buffer::U16(bytes.iter().map(|&byte| u16::from(byte) * 257).collect());
    clouds[0].header.columns[1].element = Element::U16;
    assert_eq!((found.clouds.len(), &found.warnings), (2, &vec![]));
    for (i, cloud) in clouds.iter().enumerate() {
        let header = &found.clouds[i].header;
        assert_eq!(header.columns, cloud.header.columns);
        for ((column, values), found) in
            cloud.header.columns.iter().zip(&cloud.columns).zip(&found.clouds[i].columns)
        {
            assert_eq!(&widened(values), found, "{}", column.name);
        }
        let expected = &cloud.header;
        assert_eq!((&header.name, header.rows), (&expected.name, Some(cloud.len() as u64)));
        assert_eq!(
            (&header.time, &header.coordinate_system),
            (&expected.time, &expected.coordinate_system)
        );
        assert_eq!((header.scanner, header.up), (expected.scanner, expected.up));
        assert_eq!(header.pose.translation, expected.pose.translation);
        assert!(header.pose.rotation.dot(expected.pose.rotation).abs() > 1.0 - 1e-15);
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for place in widened(&cloud.columns[0]).chunks(3).map(DVec3::from_slice) {
            bounds = [bounds[0].min(place), bounds[1].max(place)];
        }
        // In the scan's own axes, as the standard has it, however its pose turns it.
        assert_eq!(header.bounds, Some(bounds));
        for comment in ["sensor vendor: Maker", "description: a note"] {
            assert!(header.comments.iter().any(|found| found == comment), "{:?}", header.comments);
        }
    }
    assert!(found.clouds[0].header.format.contains("2 scans"));
}

#[test]
fn headers_and_wanted_columns_are_read_alone() {
    struct Headers(Vec<CloudHeader>, bool);
    impl CloudSinkHost for Headers {
        fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
            self.0.push(header.clone());
            Ok(self.1)
        }
        fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
            assert!(self.1 && values.len() == 2);
            Ok(())
        }
        fn faces(&mut self, _triangles: &[[u32; 3]]) -> Result<()> {
            panic!("no triangles")
        }
        fn warn(&mut self, line: &str) {
            panic!("{line}")
        }
    }
    let (mut bytes, _) = written(&two_scans());
    let mut wanted = Headers(Vec::new(), true);
    read_into(bytes.clone(), &mut wanted, Some(&["intensity".to_owned()])).unwrap();
    let names: Vec<_> = wanted.0[0].columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["position", "intensity"]);

    // The points of the first scan are damaged: nobody reads them.
    bytes[2000] ^= 1;
    let mut headers = Headers(Vec::new(), false);
    read_into(bytes.clone(), &mut headers, None).unwrap();
    let rows: Vec<_> = headers.0.iter().map(|header| header.rows).collect();
    assert_eq!(rows, [Some(5000), Some(1500)]);
    assert!(headers.0.iter().all(|header| header.bounds.is_some()));
    assert!(read(bytes).unwrap_err().to_string().starts_with("scan 1: expected the checksum"));
}

#[test]
fn an_empty_scan_is_a_cloud_without_points() {
    let empty = TestCloud::default().with("position", 3, Buffer::F64(Vec::new())).with(
        "intensity",
        1,
        Buffer::F32(Vec::new()),
    );
    let mut clouds = two_scans();
    clouds.insert(1, empty);
    let found = read(written(&clouds).0).unwrap();
    let rows: Vec<_> = found.clouds.iter().map(|cloud| cloud.header.rows.unwrap()).collect();
    assert_eq!(rows, [5000, 0, 1500]);
    assert!(found.clouds[1].columns[0].is_empty() && found.clouds[1].header.bounds.is_none());
    assert_eq!(column(&found, 2, "intensity").len(), 1500);
    // A file without any scan.
    assert!(read(written(&[]).0).unwrap_err().to_string().contains("expected scans"));
}

#[test]
fn positions_are_stored_as_they_are() {
    let mut cloud = TestCloud::default();
    cloud.header.columns.clear();
    let single = cloud.clone().with("position", 3, Buffer::F64(vec![0.5, 1.25, -3.0]));
    let double = cloud.clone().with("position", 3, Buffer::F64(vec![0.1, 1.25, -3.0]));
    cloud.header.step = Some(DVec3::splat(0.001));
    let mut random = Random(9);
    let stepped: Vec<f64> =
        (0..300).map(|_| (random.below(1_000_000) as f64 - 3e5) * 0.001 + 5e6).collect();
    let steps = cloud.with("position", 3, Buffer::F64(stepped.clone()));
    let (bytes, lines) = written(&[single, double, steps.clone()]);
    assert_eq!(lines, Vec::<String>::new());
    let found = read(bytes).unwrap();
    let element = |i: usize| found.clouds[i].header.columns[0].element.name();
    assert_eq!([element(0), element(1), element(2)], ["f32", "f64", "f64"]);
    assert_eq!(found.clouds[2].header.step, Some(DVec3::splat(0.001)));
    assert_eq!(column(&found, 0, "position"), [0.5, 1.25, -3.0]);
    assert_eq!(column(&found, 1, "position"), [0.1, 1.25, -3.0]);
    let pairs = column(&found, 2, "position").iter().zip(&stepped);
    assert!(pairs.into_iter().all(|(found, expected)| (found - expected).abs() < 2e-9));
    let mut between = steps;
    between.columns[0] = Buffer::F64(vec![0.001, 0.0, 0.0, 0.0014, 0.0, 0.0]);
    let (bytes, lines) = written(&[between]);
    assert_eq!(lines, ["the coordinates of 1 points are rounded to whole steps"]);
    assert_eq!(column(&read(bytes).unwrap(), 0, "position")[3], 0.001);
}

#[test]
fn what_the_file_cannot_hold_is_said() {
    let mut cloud = TestCloud::default()
        .with("position", 3, Buffer::F64(vec![0.0, 0.1, 0.2, f64::NAN, 0.0, 0.0, 1.0, 1.1, 1.2]))
        .with("color", 4, Buffer::F32([0.5, 1.0, 0.0, 1.0].repeat(3)))
        .with("gps_time", 1, Buffer::F64(vec![1.0, 2.0, 3.0]))
        .with("f dc", 2, Buffer::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
        .with("f_dc", 2, Buffer::U8(vec![0; 6]))
        .with("wide", 1001, Buffer::U8(vec![0; 3003]))
        .with("return_number", 1, Buffer::U8(vec![1, 1, 0]))
        .with("n_returns", 1, Buffer::U8(vec![1, 1, 0]))
        .with("scan", 1, Buffer::U32(vec![0; 3]));
    (cloud.faces, cloud.header.has_faces) = (vec![[0, 1, 2]], true);
    cloud.header.name = "a]]>b\u{1}".to_owned();
    cloud.header.time = "in spring".to_owned();
    cloud.header.metres_per_unit = 0.3048;
    cloud.header.up = UpAxis::Y;
    cloud.header.scanner = Some(DVec3::X);
    let (bytes, lines) = written(&[cloud.clone()]);
    let expected = [
        "opacity",
        "linear colours",
        "`gps_time` is written",
        "`f dc` is written as `f_dc`",
        "`f_dc` is not written",
        "`wide` is not written",
        "triangles",
        "in spring",
        "0.3048",
        "points up",
        "1 points without finite",
        "1 values of `return_number`",
    ];
    for part in expected {
        assert!(lines.iter().any(|line| line.contains(part)), "{part}: {lines:?}");
    }
    assert_eq!(lines.len(), expected.len(), "{lines:?}");
    let found = read(bytes).unwrap();
    let names: Vec<_> = found.clouds[0].header.columns.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(
        names,
        ["position", "color", "return_number", "n_returns", "time_stamp", "f_dc", "scan"]
    );
    assert_eq!(found.clouds[0].header.name, "a]] >b");
    assert_eq!(column(&found, 0, "f_dc"), [1.0, 2.0, 5.0, 6.0]);
    assert_eq!(column(&found, 0, "color")[..3], [48192.0, 65535.0, 0.0]);
    assert_eq!(column(&found, 0, "return_number"), [1.0, 1.0]);
}

#[test]
fn a_cloud_that_is_no_scan_stays_without_a_scanner() {
    let merged = TestCloud::default().with("position", 3, places(100, 5));
    let mut seen = merged.clone();
    seen.header.scanner = Some(DVec3::ZERO);
    // Each in a file of its own: a pose says something of the other scans, too.
    let scanner = |cloud: TestCloud| read(written(&[cloud]).0).unwrap().clouds[0].header.scanner;
    assert_eq!((scanner(merged), scanner(seen)), (None, Some(DVec3::ZERO)));
}

/// Invariant: a scanner beside zero stands at the zero of the axes that E57 writes
/// Cost: milliseconds
#[test]
fn scans_are_moved_to_where_their_scanner_is_zero() {
    let mut cloud = TestCloud::default().with("position", 3, places(100, 5));
    let turn = DQuat::from_rotation_z(0.5);
    cloud.header.pose.rotation = turn;
    cloud.header.pose.translation = DVec3::new(10.0, 20.0, 30.0);
    cloud.header.scanner = Some(DVec3::new(1.0, -2.0, 0.5));
    cloud.header.up = UpAxis::Z;
    let before = cloud.header.clone();
    let (bytes, lines) = written(&[cloud.clone()]);
    assert!(lines.is_empty(), "{lines:?}");
    let found = read(bytes).unwrap();
    let after = &found.clouds[0].header;
    assert_eq!(after.scanner, Some(DVec3::ZERO));
    let seen_from = before.pose.place(DVec3::new(1.0, -2.0, 0.5));
    assert!((after.pose.translation - seen_from).length() < 1e-12);
    let old: Vec<f64> = places(100, 5).values().iter_f64().collect();
    let new = column(&found, 0, "position");
    for (old, new) in old.chunks_exact(3).zip(new.chunks_exact(3)) {
        let [old, new] =
            [before.pose.place(DVec3::from_slice(old)), after.pose.place(DVec3::from_slice(new))];
        assert!((old - new).length() < 1e-9, "{old} {new}");
    }
}

/// Invariant: E57 has no place for the axis that points up, which a line says with what to do
/// Cost: milliseconds
#[test]
fn the_axis_that_points_up_is_said_where_it_is_not_z() {
    for (up, said) in [
        (UpAxis::Z, None),
        (UpAxis::Y, Some("y points up in this cloud, and E57 is read with z up: say `--up y`")),
        (
            UpAxis::Unknown,
            Some(
                "this cloud does not say which axis points up, and E57 is read with z up: say `--up y`, if it is y",
            ),
        ),
    ] {
        let mut cloud = TestCloud::default().with("position", 3, places(9, 5));
        cloud.header.up = up;
        assert_eq!(written(&[cloud]).1, said.into_iter().collect::<Vec<_>>());
    }
}

#[test]
fn feet_become_metres() {
    let foot = 0.3048;
    let mut cloud = TestCloud::default()
        .with("position", 3, Buffer::F64(vec![10.0, 20.0, 30.0, -1.0, 0.0, 2.5]))
        .with("radius", 1, Buffer::F32(vec![1.0, 2.0]))
        .with("quality", 1, Buffer::F32(vec![1.0, 2.0]));
    cloud.header.metres_per_unit = foot;
    cloud.header.up = UpAxis::Z;
    cloud.header.pose.translation = DVec3::new(100.0, 0.0, 0.0);
    let (bytes, lines) = written(&[cloud]);
    assert!(lines.len() == 1 && lines[0].contains("units of 0.3048 m become metres"), "{lines:?}");
    let found = read(bytes).unwrap();
    let header = &found.clouds[0].header;
    assert_eq!(header.metres_per_unit, 1.0);
    assert!((header.pose.translation - DVec3::new(30.48, 0.0, 0.0)).length() < 1e-12);
    let places = [10.0, 20.0, 30.0, -1.0, 0.0, 2.5].map(|feet| feet * foot);
    assert_eq!(column(&found, 0, "position"), places);
    assert_eq!(column(&found, 0, "radius"), [0.3048, 0.6096].map(|r: f32| f64::from(r)));
    assert_eq!(column(&found, 0, "quality"), [1.0, 2.0]);
}
