use super::*;
use surfelshop_api::glam::DVec3;
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};

const ENCODINGS: [Encoding; 3] = [Encoding::Binary, Encoding::Ascii, Encoding::BinaryCompressed];

/// A thousand points.
fn cloud(position: impl Fn(usize) -> f64) -> TestCloud {
    cloud_of(1000, position)
}

/// Points with a column of each type; every 17th without a place.
pub(super) fn cloud_of(n: u32, position: impl Fn(usize) -> f64) -> TestCloud {
    let place = |i: usize| if (i / 3).is_multiple_of(17) { f64::NAN } else { position(i) };
    let wave = |i: usize| (i as f32 * 0.37).sin();
    TestCloud { batch: 300, ..TestCloud::default() }
        .column("label", 1, Owned::U32((0..n).map(|i| i * 4_000_003).collect()))
        .column("position", 3, Owned::F64((0..3 * n as usize).map(place).collect()))
        .column("normal", 3, Owned::F32((0..3 * n as usize).map(wave).collect()))
        .column("color", 3, Owned::U8((0..3 * n).map(|i| (i * 7) as u8).collect()))
        .column("intensity", 1, Owned::U16((0..n).map(|i| (i * 65) as u16).collect()))
        .column("return_number", 1, Owned::U8((0..n).map(|i| (i % 5) as u8).collect()))
        .column("gps_time", 1, Owned::F64((0..n).map(|i| 1e9 + f64::from(i) / 7.0).collect()))
        .column("feature", 5, Owned::F32((0..5 * n as usize).map(wave).collect()))
        .column("a", 2, Owned::I8((0..2 * n).map(|i| i as i8).collect()))
        .column("b", 1, Owned::I16((0..n).map(|i| (i * 77) as i16).collect()))
        .column("c", 1, Owned::I32((0..n as i32).map(|i| i * -2_000_003).collect()))
}

fn narrow(i: usize) -> f64 {
    f64::from(i as f32 * 0.1)
}

/// That everything is as it was written.
fn same(found: &Collected, written: &TestCloud) {
    let cloud = &found.clouds[0];
    assert_eq!(cloud.header.rows, Some(written.n_rows() as u64));
    for (column, expected) in written.header.columns.iter().zip(&written.columns) {
        let (_, read) = cloud.header.column(&column.name).unwrap();
        if column.name != "position" {
            assert_eq!(read, column);
        }
        let expected: Vec<f64> = expected.all().iter_f64().collect();
        assert_eq!(bits(values(found, &column.name)), bits(&expected), "{}", column.name);
    }
    assert_eq!(cloud.header.columns.len(), written.header.columns.len());
}

#[test]
fn every_column_comes_back_in_every_encoding() {
    for encoding in ENCODINGS {
        let written = cloud(narrow);
        let (bytes, lines) = write(written.clone(), encoding).unwrap();
        assert_eq!(lines, Vec::<String>::new());
        let found = read(&bytes).unwrap();
        same(&found, &written);
        assert_eq!(found.warnings, Vec::<String>::new());
        let (_, position) = found.clouds[0].header.column("position").unwrap();
        assert_eq!(position.element, Element::F32);
        let word = ["binary", "ascii", "binary_compressed"];
        let place = ENCODINGS.iter().position(|e| *e == encoding).unwrap();
        assert_eq!(found.clouds[0].header.format, format!("PCD 0.7, {}", word[place]));
    }
}

#[test]
fn positions_that_need_eight_bytes_have_them() {
    // From the first point on, or only in the last batch, when the others were written narrow.
    for first in [0, 2900] {
        for encoding in ENCODINGS {
            let written =
                cloud(|i| if i < first { narrow(i) } else { 500_000.0 + i as f64 * 0.001 });
            let (bytes, lines) = write(written.clone(), encoding).unwrap();
            let found = read(&bytes).unwrap();
            same(&found, &written);
            let (_, position) = found.clouds[0].header.column("position").unwrap();
            assert_eq!((position.element, lines.len()), (Element::F64, 0));
        }
    }
}

#[test]
fn unknown_numbers_grids_and_scanners_are_written() {
    for encoding in ENCODINGS {
        let mut written = cloud(narrow);
        written.header.scanner = Some(DVec3::new(1.5, -2.25, 1e-7));
        let (bytes, _) = write(written.clone(), encoding).unwrap();
        let header = &read(&bytes).unwrap().clouds[0].header;
        assert_eq!((header.rows, header.grid), (Some(1000), None));
        assert_eq!(header.scanner, written.header.scanner);
        written.header.rows = Some(1000);
        written.header.grid = Some([40, 25]);
        let (bytes, _) = write(written.clone(), encoding).unwrap();
        assert_eq!(read(&bytes).unwrap().clouds[0].header.grid, Some([40, 25]));
        written.header.grid = Some([40, 26]);
        let (bytes, lines) = write(written.clone(), encoding).unwrap();
        assert!(lines[0].contains("grid of 40 x 26"), "{lines:?}");
        assert_eq!(read(&bytes).unwrap().clouds[0].header.grid, None);
    }
}

#[test]
fn empty_clouds_pass() {
    for encoding in ENCODINGS {
        let cloud = TestCloud::default().column("position", 3, Owned::F64(vec![]));
        let (bytes, _) = write(cloud, encoding).unwrap();
        let found = read(&bytes).unwrap();
        assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (Some(0), 0));
    }
}

#[test]
fn colors_are_packed_and_unpacked() {
    let positions = |n: usize| Owned::F64((0..3 * n).map(|i| i as f64).collect());
    for encoding in ENCODINGS {
        let rgba: Vec<u8> = vec![1, 2, 3, 4, 255, 254, 253, 252];
        let cloud = TestCloud::default().column("position", 3, positions(2)).column(
            "color",
            4,
            Owned::U8(rgba),
        );
        let (bytes, lines) = write(cloud, encoding).unwrap();
        let found = read(&bytes).unwrap();
        assert_eq!(values(&found, "color"), [1.0, 2.0, 3.0, 4.0, 255.0, 254.0, 253.0, 252.0]);
        assert!(lines.is_empty());
        let wide: Vec<u16> = vec![0, 128, 129, 65535, 32768, 257];
        let cloud = TestCloud::default().column("position", 3, positions(2)).column(
            "color",
            3,
            Owned::U16(wide),
        );
        let (bytes, lines) = write(cloud, encoding).unwrap();
        assert_eq!(values(&read(&bytes).unwrap(), "color"), [0.0, 0.0, 1.0, 255.0, 128.0, 1.0]);
        assert_eq!(lines, ["`color` is rounded to 8 bits of sRGB"]);
        let linear = vec![0.0, srgb_to_linear(100.0 / 255.0), 7.0, f32::NAN, -1.0, 1.0];
        let cloud = TestCloud::default().column("position", 3, positions(2)).column(
            "color",
            3,
            Owned::F32(linear),
        );
        let (bytes, lines) = write(cloud, encoding).unwrap();
        assert_eq!(values(&read(&bytes).unwrap(), "color"), [0.0, 100.0, 255.0, 0.0, 0.0, 255.0]);
        assert_eq!((lines.len(), linear_to_srgb(0.0)), (1, 0.0));
    }
}

#[test]
fn what_cannot_be_held_is_said() {
    let mut cloud = TestCloud { faces: vec![[0, 1, 2]], ..TestCloud::default() }
        .column("position", 3, Owned::F64((0..9).map(f64::from).collect()))
        .column("two words", 1, Owned::U8(vec![1, 2, 3]))
        .column("x", 1, Owned::U8(vec![4, 5, 6]));
    cloud.header.coordinate_system = "EPSG:25832".to_owned();
    cloud.header.has_faces = true;
    let (bytes, lines) = write(cloud, Encoding::Binary).unwrap();
    for part in [
        "`two words` was written as `two_words`",
        "`x` was written as `x_`",
        "triangles",
        "reference",
    ] {
        assert!(lines.iter().any(|line| line.contains(part)), "{part}: {lines:?}");
    }
    let found = read(&bytes).unwrap();
    assert_eq!((values(&found, "two_words")[1], values(&found, "x_")[2]), (2.0, 6.0));
    let without = TestCloud::default().column("normal", 3, Owned::F32(vec![0.0; 3]));
    assert!(write(without, Encoding::Binary).unwrap_err().to_string().contains("position"));
}

#[test]
fn headers_are_as_pcl_writes_them() {
    let cloud = TestCloud::default()
        .column("position", 3, Owned::F64(vec![0.1f32.into(), 2.0, 1e-9f32.into()]))
        .column("color", 3, Owned::U8(vec![255, 128, 0]))
        .column("gps_time", 1, Owned::F64(vec![1e20]))
        .column("feature", 2, Owned::F32(vec![f32::NAN, -0.0]));
    let (bytes, _) = write(cloud, Encoding::Ascii).unwrap();
    let expected = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
        FIELDS x y z rgb gpstime feature\nSIZE 4 4 4 4 8 4\nTYPE F F F U F F\nCOUNT 1 1 1 1 1 2\n\
        WIDTH 1\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n\
        0.1 2 1e-9 16744448 1e20 nan -0\n";
    // The first line is as long as a header of any number of points needs it.
    let text = String::from_utf8(bytes).unwrap();
    let (title, rest) = text.split_once('\n').unwrap();
    assert_eq!(format!("{}\n{rest}", title.trim_end()), expected);
}

/// Invariant: how a sensor was turned comes back, and one at zero without a grid is not lost without a line
/// Cost: milliseconds
#[test]
fn sensors_come_back_as_they_were_turned() {
    let points = || TestCloud::default().column("position", 3, Owned::F64(vec![0.5; 6]));
    let (bytes, _) = write(points(), Encoding::Ascii).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let turned = text.replace("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 4 5 6 0.6 0.8 0 0");
    let found = read(turned.as_bytes()).unwrap();
    let header = &found.clouds[0].header;
    assert_eq!(header.scanner, Some(DVec3::new(4.0, 5.0, 6.0)));
    let mut again = points();
    (again.header.scanner, again.header.comments) = (header.scanner, header.comments.clone());
    let (bytes, lines) = write(again, Encoding::Ascii).unwrap();
    assert!(String::from_utf8(bytes).unwrap().contains("VIEWPOINT 4 5 6 0.6 0.8 0 0"));
    assert!(lines.is_empty(), "{lines:?}");
    let mut zero = points();
    zero.header.scanner = Some(DVec3::ZERO);
    let (_, lines) = write(zero, Encoding::Ascii).unwrap();
    assert_eq!(lines, ["PCD has no place for the place of the scanner"]);
}
