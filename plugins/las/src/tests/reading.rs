//! Files that are not compressed.

use super::handmade::{Handmade, LENGTHS};
use super::{column, has, read, read_columns};
use surfelshop_api::format::UpAxis;

/// A record of a format whose fields all have values of their own.
fn record(format: u8) -> Vec<u8> {
    let mut record = Vec::new();
    for place in [-3i32, 500, i32::MAX] {
        record.extend(place.to_le_bytes());
    }
    record.extend(40_000u16.to_le_bytes());
    if format < 6 {
        // Return 3 of 5, direction 1, edge 1; class 17, synthetic and withheld; 11 degrees to the left.
        record.extend([3 | 5 << 3 | 3 << 6, 17 | 5 << 5, 245, 99]);
        record.extend(1234u16.to_le_bytes());
    } else {
        // Return 9 of 14; key point and overlap, channel 2, edge 1.
        record.extend([9 | 14 << 4, 10 | 2 << 4 | 2 << 6, 203, 99]);
        record.extend((-2500i16).to_le_bytes());
        record.extend(1234u16.to_le_bytes());
    }
    if !matches!(format, 0 | 2) {
        record.extend(98_765.432_1f64.to_le_bytes());
    }
    if matches!(format, 2 | 3 | 5 | 7 | 8 | 10) {
        record.extend([1u16, 300, 65_535].iter().flat_map(|value| value.to_le_bytes()));
    }
    if matches!(format, 8 | 10) {
        record.extend(4321u16.to_le_bytes());
    }
    record.resize(LENGTHS[usize::from(format)], 0);
    record
}

#[test]
fn every_point_format_is_read() {
    for format in 0..=10u8 {
        for minor in if format < 6 { 0..=4 } else { 4..=5 } {
            let made =
                Handmade { points: record(format).repeat(3), ..Handmade::new(minor, format) };
            let found = read(made.las()).unwrap_or_else(|line| panic!("{format}: {line}"));
            let header = &found.clouds[0].header;
            assert_eq!(header.format, format!("LAS 1.{minor}, point format {format}"));
            assert_eq!((header.rows, header.up), (Some(3), UpAxis::Z));
            assert_eq!(header.step.unwrap().to_array(), made.scale);
            assert_eq!(header.time, "2020-02-29");
            assert_eq!(header.comments, ["system: a scanner", "software: by hand"]);
            assert_eq!(header.bounds.unwrap()[1].x, 7e9);
            let place = [-3.0 * 0.01 + 1000.0, 500.0 * 0.02 - 2000.0, f64::from(i32::MAX) * 0.5];
            assert_eq!(column(&found, "position"), place.repeat(3));
            let is_new = format >= 6;
            let expected = [
                ("intensity", 40_000.0),
                ("return_number", if is_new { 9.0 } else { 3.0 }),
                ("n_returns", if is_new { 14.0 } else { 5.0 }),
                ("classification", if is_new { 203.0 } else { 17.0 }),
                ("class_flags", if is_new { 10.0 } else { 5.0 }),
                ("scan_flags", if is_new { 2.0 } else { 3.0 }),
                ("scan_angle", if is_new { -15.0 } else { -11.0 }),
                ("user_data", 99.0),
                ("point_source", 1234.0),
            ];
            for (name, value) in expected {
                assert_eq!(column(&found, name), [value; 3], "{name} of format {format}");
            }
            assert_eq!(has(&found, "scanner_channel"), is_new);
            if is_new {
                assert_eq!(column(&found, "scanner_channel"), [2.0; 3]);
            }
            let optional: [(&str, &[u8], &[f64]); 3] = [
                ("gps_time", &[1, 3, 4, 5, 6, 7, 8, 9, 10], &[98_765.432_1]),
                ("color", &[2, 3, 5, 7, 8, 10], &[1.0, 300.0, 65_535.0]),
                ("nir", &[8, 10], &[4321.0]),
            ];
            for (name, formats, values) in optional {
                assert_eq!(has(&found, name), formats.contains(&format), "{name} of {format}");
                if has(&found, name) {
                    assert_eq!(column(&found, name), values.repeat(3), "{name} of {format}");
                }
            }
            let waveforms = matches!(format, 4 | 5 | 9 | 10);
            let said = found.warnings.iter().any(|line| line.contains("waveforms"));
            assert_eq!((said, found.warnings.len()), (waveforms, usize::from(waveforms)));
        }
    }
}

#[test]
fn points_go_over_in_batches_and_only_columns_that_are_wanted() {
    let made = Handmade::new(2, 3).with_walk(150_000, 0);
    let all = read(made.las()).unwrap();
    assert_eq!(column(&all, "intensity").len(), 150_000);
    let wanted = ["color".to_owned(), "gps_time".to_owned()];
    let some = read_columns(made.las(), Some(&wanted)).unwrap();
    let names: Vec<_> =
        some.clouds[0].header.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["position", "gps_time", "color"]);
    for name in names {
        assert!(column(&all, name) == column(&some, name), "{name}");
    }
}

#[test]
fn numbers_of_points_are_those_of_the_file() {
    let made = Handmade::new(2, 0).with_walk(10, 0);
    for (announced, cut, expected, said) in [
        (10, 0, 10, ""),
        (12, 0, 10, "announces 12 points, the file has 10"),
        (10, 25, 8, "announces 10 points, the file has 8"),
        (0, 0, 10, "announces 0 points, the file has 10"),
        (7, 0, 10, "announces 7 points, the file has 10"),
        (7, 5, 7, "55 bytes behind the 7 points"),
    ] {
        let mut bytes = Handmade { announced: Some(announced), ..made.clone() }.las();
        bytes.truncate(bytes.len() - cut);
        let found = read(bytes).unwrap();
        assert_eq!(found.clouds[0].header.rows, Some(expected));
        assert_eq!(column(&found, "intensity").len() as u64, expected);
        let lines = found.warnings.join("; ");
        assert!(lines.contains(said) && lines.is_empty() == said.is_empty(), "{lines}");
    }
    let none = Handmade { announced: Some(9), ..Handmade::new(2, 0) };
    let line = read(none.las()).unwrap_err().to_string();
    assert!(line.contains("expected 9 points"), "{line}");
    assert_eq!(read(Handmade::new(2, 0).las()).unwrap().clouds[0].header.rows, Some(0));
    // Records behind the points are no points.
    let mut later = Handmade::new(4, 6).with_walk(3, 0);
    later.later.push(("somebody", 5, vec![0; 30 * 7 - 60]));
    assert!(read(later.las()).unwrap().warnings.is_empty());
    let mut both = later.las();
    both[107..111].copy_from_slice(&2u32.to_le_bytes());
    let found = read(both).unwrap();
    assert_eq!(found.clouds[0].header.rows, Some(3));
    assert!(found.warnings[0].contains("and 2 in the field of older versions"));
}

#[test]
fn coordinate_systems_are_found_before_and_behind_the_points() {
    let wkt = r#"PROJCS["here",GEOGCS["g",UNIT["degree",0.0174]],UNIT["foot",0.3048]]"#;
    let body = [wkt.as_bytes(), b"\0\0"].concat();
    let mut before = Handmade::new(2, 0).with_walk(2, 0);
    before.records.push(("LASF_Projection", 2112, body.clone()));
    before.records.push(("LASF_Spec", 3, b"a field in spring\0".to_vec()));
    let mut behind = Handmade::new(4, 6).with_walk(2, 0);
    behind.later.push(("LASF_Projection", 2112, body));
    for made in [&before, &behind] {
        let found = read(made.las()).unwrap();
        let header = &found.clouds[0].header;
        assert_eq!((header.coordinate_system.as_str(), header.metres_per_unit), (wkt, 0.3048));
    }
    let header = read(before.las()).unwrap().clouds.remove(0).header;
    assert_eq!(header.comments[2], "a field in spring");
    let keys = [1u16, 1, 0, 2, 3072, 0, 1, 2225, 3076, 0, 1, 9003];
    let mut keyed = Handmade::new(1, 1).with_walk(2, 0);
    let directory = keys.iter().flat_map(|key| key.to_le_bytes()).collect();
    keyed.records.push(("LASF_Projection", 34735, directory));
    let header = read(keyed.las()).unwrap().clouds.remove(0).header;
    assert_eq!(header.coordinate_system, "EPSG:2225");
    assert_eq!(header.metres_per_unit, 1200.0 / 3937.0);
}

#[test]
fn headers_that_cannot_be_right_are_refused_in_a_line() {
    let good = Handmade::new(4, 7).with_walk(3, 0).las();
    let changed: [(usize, &[u8], &str); 8] = [
        (0, b"LAST", "begins with LASF"),
        (24, &[2], "LAS 1.0 to 1.5, found 2.4"),
        (25, &[6], "found 1.6"),
        (94, &[100, 0], "at least 227 bytes, found 100"),
        (96, &[20, 0, 0, 0], "behind the header of 375 bytes, found them at byte 20"),
        (104, &[11], "from 0 to 10, found 11"),
        (105, &[35, 0], "at least 36 bytes in point format 7, found 35"),
        (131, &[0; 8], "scales of coordinates"),
    ];
    for (at, bytes, said) in changed {
        let mut file = good.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        let line = read(file).unwrap_err().to_string();
        assert!(line.contains(said), "{line}");
    }
    for len in [200, 300] {
        let line = read(good[..len].to_vec()).unwrap_err().to_string();
        assert!(line.contains(&format!("found {len}: the file is cut short")), "{line}");
    }
    assert!(read(Vec::new()).is_err());
}
