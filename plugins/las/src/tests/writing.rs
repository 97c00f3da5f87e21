//! Files that are written, and read again.

use super::handmade::Handmade;
use super::{Cloud, Owned, column, has, read, write};
use crate::{Settings, Version};
use surfelshop_api::format::{Collected, UpAxis};
use surfelshop_api::glam::DVec3;

fn settings(version: Version) -> Settings {
    Settings { version, ..Settings::default() }
}

/// A cloud as it was read, to be written.
fn cloud_of(found: &Collected) -> Cloud {
    use surfelshop_api::columns::Element;
    let read = &found.clouds[0];
    let columns = read.columns.iter().zip(&read.header.columns);
    let columns = columns.map(|(values, column)| match column.element {
        Element::U8 => Owned::U8(values.iter().map(|&value| value as u8).collect()),
        Element::U16 => Owned::U16(values.iter().map(|&value| value as u16).collect()),
        Element::F32 => Owned::F32(values.iter().map(|&value| value as f32).collect()),
        _ => Owned::F64(values.clone()),
    });
    let (mut header, columns) = (read.header.clone(), columns.collect());
    // Those of a file that is made here are too wide.
    header.bounds = None;
    Cloud { header, columns, batch: 130, n_clouds: 1, n_done: 0 }
}

#[test]
fn every_point_format_comes_back() {
    for format in 0..=10u8 {
        let minor = if format < 6 { 2 } else { 4 };
        let mut made = Handmade::new(minor, format).with_walk(700, 3);
        made.scale = [0.25, 0.5, 0.125];
        made.offset = [0.0; 3];
        let before = read(made.las()).unwrap();
        for name in ["a.las", "a.laz"] {
            for version in [Version::Auto, Version::Newer] {
                let (bytes, lines) = write(cloud_of(&before), &settings(version), name).unwrap();
                let after = read(bytes).unwrap();
                let (one, other) = (&before.clouds[0], &after.clouds[0]);
                let what = format!("format {format} as {} ({lines:?})", other.header.format);
                assert!(after.warnings.is_empty(), "{what}: {:?}", after.warnings);
                assert_eq!(other.header.rows, Some(700), "{what}");
                let [low, high] = other.header.bounds.unwrap();
                for (values, column) in one.columns.iter().zip(&one.header.columns) {
                    let found = super::column(&after, &column.name);
                    let most = if column.name == "scan_angle" { 0.0031 } else { 0.0 };
                    let off = values.iter().zip(found).map(|(a, b)| (a - b).abs());
                    assert!(off.fold(0.0, f64::max) <= most, "{} of {what}", column.name);
                    if column.name == "position" {
                        let least = values.chunks(3).map(|p| p[0]).fold(f64::MAX, f64::min);
                        let most = values.chunks(3).map(|p| p[2]).fold(f64::MIN, f64::max);
                        assert_eq!((low.x, high.z), (least, most));
                    }
                }
                let is_older = format < 6 && version == Version::Auto;
                let expected = format!(
                    "LA{} 1.{}, point format {}",
                    if name.ends_with('z') { 'Z' } else { 'S' },
                    if is_older { 2 } else { 4 },
                    match format {
                        0..=5 if is_older => [0, 1, 2, 3, 1, 3][usize::from(format)],
                        0 | 1 | 4 | 6 | 9 => 6,
                        8 | 10 => 8,
                        _ => 7,
                    }
                );
                assert_eq!(other.header.format, expected);
                assert_eq!(other.header.time, "2020-02-29");
            }
        }
    }
}

fn line(n: usize) -> Vec<f64> {
    (0..n).flat_map(|i| [i as f64 * 0.5, 10.0, -1.0]).collect()
}

#[test]
fn columns_without_a_field_become_extra_bytes_and_come_back() {
    let n = 20;
    let floats = |k: usize| (0..n * k).map(|i| i as f32 * 0.1).collect::<Vec<_>>();
    let cloud = || {
        Cloud::at(line(n))
            .with("normal", 3, Owned::F32(floats(3)))
            .with("radius", 1, Owned::F32(floats(1)))
            .with("tangent_u", 3, Owned::F32(floats(3)))
            .with("intensity", 1, Owned::F32(floats(1)))
            .with("classification", 1, Owned::I16((0..n as i16).map(|i| i - 5).collect()))
            .with("a name of more than thirty-two bytes", 1, Owned::I32(vec![-7; n]))
            .with("a name of more than thirty-two bytes, too", 2, Owned::U32(vec![9; 2 * n]))
    };
    for (version, name) in [(Version::Older, "b.las"), (Version::Newer, "b.laz")] {
        let (bytes, lines) = write(cloud(), &settings(version), name).unwrap();
        let found = read(bytes).unwrap();
        assert!(found.warnings.is_empty());
        for (name, components) in [("normal", 3), ("radius", 1), ("tangent_u", 3), ("intensity", 1)]
        {
            let (_, column) = found.clouds[0].header.column(name).unwrap();
            assert_eq!((column.components as usize, column.element.name()), (components, "f32"));
            let expected: Vec<f64> = floats(components).into_iter().map(f64::from).collect();
            assert_eq!(super::column(&found, name), expected, "{name}");
        }
        assert_eq!(column(&found, "classification")[..2], [-5.0, -4.0]);
        assert_eq!(column(&found, "a name of more than thirty-two b")[0], -7.0);
        assert_eq!(column(&found, "a name of more than thirty-two")[..2], [9.0, 9.0]);
        let said = |text: &str| lines.iter().filter(|line| line.contains(text)).count();
        assert_eq!((said("kept as extra bytes"), said("too long")), (2, 2), "{lines:?}");
        assert_eq!(column(&found, "return_number"), [1.0; 20]);
        assert_eq!(column(&found, "n_returns"), [1.0; 20]);
    }
}

#[test]
fn whole_numbers_of_any_type_go_into_their_field_and_later_ones_are_clamped() {
    let mut classes: Vec<f32> = (0..20).map(|i| (i % 8) as f32).collect();
    let angles = (0..20).map(|i| i as f32 - 10.0).collect();
    (classes[15], classes[16], classes[17]) = (99.0, 2.5, f32::NAN);
    let cloud = Cloud::at(line(20))
        .with("classification", 1, Owned::F32(classes))
        .with("intensity", 1, Owned::U32((0..20).collect()))
        .with("scan_angle", 1, Owned::F32(angles))
        .with("gps_time", 1, Owned::F32(vec![2.5; 20]));
    let (bytes, lines) = write(cloud, &settings(Version::Older), "c.laz").unwrap();
    let found = read(bytes).unwrap();
    assert_eq!(found.clouds[0].header.format, "LAZ 1.2, point format 1");
    assert_eq!(column(&found, "classification")[14..18], [6.0, 31.0, 3.0, 0.0]);
    assert_eq!(column(&found, "intensity")[19], 19.0);
    assert_eq!(column(&found, "scan_angle")[0], -10.0);
    assert_eq!(column(&found, "gps_time"), [2.5; 20]);
    let expected = [
        "1 points have no `classification`: 0 is written",
        "`classification`: 2 values are no whole numbers from 0 to 31 and are rounded or clamped",
    ];
    assert_eq!(lines, expected);
}

#[test]
fn colours_of_all_types_become_sixteen_bits() {
    let cloud =
        |values: Owned, components: u32| Cloud::at(line(1)).with("color", components, values);
    let colors = |cloud: Cloud| {
        let (bytes, lines) = write(cloud, &Settings::default(), "d.las").unwrap();
        (read(bytes).unwrap(), lines)
    };
    let (found, lines) = colors(cloud(Owned::U8(vec![0, 128, 255]), 3));
    assert_eq!(column(&found, "color"), [0.0, 32_896.0, 65_535.0]);
    assert_eq!(lines, ["`color` is written with 16 bits a channel, as LAS has it"]);
    assert!(!has(&found, "alpha"));
    let (found, lines) = colors(cloud(Owned::U16(vec![7, 8, 9, 10]), 4));
    assert_eq!(
        (column(&found, "color"), column(&found, "alpha")),
        (&[7.0, 8.0, 9.0][..], &[10.0][..])
    );
    assert!(lines.is_empty());
    let (found, lines) = colors(cloud(Owned::F32(vec![-1.0, 0.214_041, 2.0]), 3));
    let color = column(&found, "color");
    assert!((color[1] - 32_767.5).abs() < 2.0, "{color:?}");
    assert_eq!((color[0], color[2]), (0.0, 65_535.0));
    assert!(lines[0].contains("2 values are not from 0 to 1"), "{lines:?}");
}

#[test]
fn coordinate_systems_and_comments_come_back() {
    let wkt = r#"PROJCS["x",UNIT["metre",1]]"#;
    for (system, unit, expected) in
        [(wkt, 1.0, wkt), ("EPSG:2225", 1200.0 / 3937.0, "EPSG:2225"), ("somewhere", 1.0, "")]
    {
        let mut cloud = Cloud::at(line(2));
        cloud.header.coordinate_system = system.to_owned();
        cloud.header.metres_per_unit = unit;
        cloud.header.comments = vec!["software: other".to_owned(), "a meadow".to_owned()];
        cloud.header.up = UpAxis::Y;
        cloud.header.has_faces = true;
        let (bytes, lines) = write(cloud, &Settings::default(), "e.laz").unwrap();
        let header = read(bytes).unwrap().clouds.remove(0).header;
        assert_eq!(header.coordinate_system, expected);
        assert_eq!(header.metres_per_unit, if expected.is_empty() { 0.0 } else { unit });
        assert!(header.comments.contains(&"a meadow".to_owned()));
        assert!(header.comments.iter().filter(|text| text.contains("software: ")).count() == 1);
        assert_eq!(lines.len(), if expected.is_empty() { 3 } else { 2 }, "{lines:?}");
    }
}

#[test]
fn positions_keep_their_steps_and_points_without_a_place_are_left_out() {
    let mut places: Vec<f64> =
        (0..30).flat_map(|i| [5e5 + f64::from(i) * 0.001, 5e6 + 0.0005, 1.0]).collect();
    places[31] = f64::NAN;
    let intensity = (0..30).collect();
    let mut cloud = Cloud::at(places.clone()).with("intensity", 1, Owned::U16(intensity));
    cloud.header.step = Some(DVec3::splat(0.001));
    cloud.header.bounds = Some([DVec3::new(5e5, 5e6, 1.0), DVec3::new(5e5 + 0.03, 5e6 + 1.0, 1.0)]);
    let (bytes, lines) = write(cloud, &Settings::default(), "f.las").unwrap();
    let found = read(bytes).unwrap();
    assert_eq!(found.clouds[0].header.rows, Some(29));
    assert_eq!(column(&found, "intensity")[9..11], [9.0, 11.0]);
    let positions = column(&found, "position");
    for (i, place) in (0..30).filter(|i| *i != 10).zip(positions.chunks(3)) {
        assert!(
            (place[0] - places[3 * i]).abs() < 1e-8 && (place[1] - places[3 * i + 1]).abs() < 1e-8
        );
    }
    assert_eq!(lines, ["1 points without finite coordinates are left out"]);

    let coarse = Settings { scale: 0.1, ..Settings::default() };
    let mut cloud = Cloud::at(places.clone());
    cloud.header.step = Some(DVec3::splat(0.001));
    let (bytes, lines) = write(cloud, &coarse, "f.las").unwrap();
    assert_eq!(read(bytes).unwrap().clouds[0].header.step, Some(DVec3::splat(0.1)));
    let line = "positions are rounded to whole steps of 0.1 (the cloud has steps of 0.001): by at most 0.029 along an axis";
    assert_eq!(lines.iter().filter(|found| *found == line).count(), 1, "{lines:?}");
    // A cloud that does not say how far it reaches.
    let far = Cloud::at((0..10).flat_map(|i| [f64::from(i * i * i) * 1e4; 3]).collect());
    let fine = Settings { scale: 1e-6, ..Settings::default() };
    let line = write(far, &fine, "g.laz").unwrap_err().to_string();
    assert!(line.contains("scale"), "{line}");
}

#[test]
fn clouds_that_cannot_be_written_are_refused() {
    let mut several = Cloud::at(line(3));
    several.n_clouds = 2;
    assert!(write(several, &Settings::default(), "h.las").is_err());
    let mut none = Cloud::at(line(3));
    none.n_clouds = 0;
    assert!(write(none, &Settings::default(), "h.las").is_err());
    let mut unplaced = Cloud::at(line(3));
    unplaced.header.columns[0].name = "place".to_owned();
    assert!(write(unplaced, &Settings::default(), "h.las").is_err());
    for name in ["i.las", "i.laz", "i.copc.laz"] {
        let (bytes, lines) = write(Cloud::at(Vec::new()), &Settings::default(), name).unwrap();
        assert_eq!(read(bytes).unwrap().clouds[0].header.rows, Some(0));
        assert_eq!(lines.len(), usize::from(name.contains("copc")));
    }
}

#[test]
fn columns_beyond_what_a_record_holds_are_left_out_and_named() {
    let mut cloud = Cloud::at(line(2));
    for i in 0..400 {
        cloud = cloud.with(&format!("c{i}"), 1, Owned::U8(vec![i as u8; 2]));
    }
    let (bytes, lines) = write(cloud, &Settings::default(), "j.las").unwrap();
    let found = read(bytes).unwrap();
    assert!(has(&found, "c340") && !has(&found, "c341"));
    assert_eq!(column(&found, "c255"), [255.0; 2]);
    assert_eq!(lines.len(), 59);
    assert!(lines[0].contains("`c341` is left out"), "{}", lines[0]);
}

/// Invariant: the lowest version that holds a cloud is written where nobody says which
#[test]
fn the_lowest_version_that_holds_a_cloud_is_chosen() {
    let plain = || Cloud::at(line(3)).with("intensity", 1, Owned::U16(vec![1, 2, 3]));
    let colored = || plain().with("color", 3, Owned::U16(vec![7; 9]));
    let classes = |most| plain().with("classification", 1, Owned::U8(vec![2, 2, most]));
    let returns = |most| plain().with("n_returns", 1, Owned::U8(vec![1, 2, most]));
    let angles = |last| plain().with("scan_angle", 1, Owned::F32(vec![3.0, -90.0, last]));
    let mut in_wkt = plain();
    in_wkt.header.coordinate_system = r#"PROJCS["x",UNIT["metre",1]]"#.to_owned();
    let mut many = plain();
    many.header.rows = Some(u64::from(u32::MAX) + 1);
    for (cloud, expected) in [
        (plain(), "LAS 1.2, point format 0"),
        (plain().with("gps_time", 1, Owned::F64(vec![0.5; 3])), "LAS 1.2, point format 1"),
        (colored(), "LAS 1.2, point format 2"),
        (colored().with("gps_time", 1, Owned::F64(vec![0.5; 3])), "LAS 1.2, point format 3"),
        (classes(31), "LAS 1.2, point format 0"),
        (classes(32), "LAS 1.4, point format 6"),
        (returns(7), "LAS 1.2, point format 0"),
        (returns(8), "LAS 1.4, point format 6"),
        (angles(-17.0), "LAS 1.2, point format 0"),
        (angles(f32::NAN), "LAS 1.2, point format 0"),
        (angles(-16.998), "LAS 1.4, point format 6"),
        (angles(128.0), "LAS 1.4, point format 6"),
        (plain().with("scanner_channel", 1, Owned::U8(vec![0; 3])), "LAS 1.4, point format 6"),
        (colored().with("nir", 1, Owned::U16(vec![7; 3])), "LAS 1.4, point format 8"),
        (in_wkt, "LAS 1.4, point format 6"),
        (many, "LAS 1.4, point format 6"),
    ] {
        let (bytes, _) = write(cloud, &settings(Version::Auto), "k.las").unwrap();
        assert_eq!(read(bytes).unwrap().clouds[0].header.format, expected);
    }
}

#[test]
fn times_of_a_scan_go_into_the_field_of_times() {
    let times = || Owned::F64(vec![0.5, 1.5, 2.5]);
    let (bytes, lines) =
        write(Cloud::at(line(3)).with("time_stamp", 1, times()), &Settings::default(), "l.laz")
            .unwrap();
    let found = read(bytes).unwrap();
    assert_eq!(column(&found, "gps_time"), [0.5, 1.5, 2.5]);
    assert!(lines.len() == 1 && lines[0].contains("read as `gps_time`"), "{lines:?}");
    let both = Cloud::at(line(3)).with("time_stamp", 1, times()).with("gps_time", 1, times());
    let (bytes, lines) = write(both, &Settings::default(), "l.laz").unwrap();
    let found = read(bytes).unwrap();
    assert!(has(&found, "time_stamp") && has(&found, "gps_time") && lines.is_empty(), "{lines:?}");
}

/// Invariant: whole degrees stay whole, wherever they come from, and what is missing is said to be
/// Cost: milliseconds
#[test]
fn scan_angles_of_whole_degrees_stay_what_they_are() {
    let n = 70;
    let angles: Vec<f32> = (0..n).map(|i| i as f32 - 35.0).collect();
    for name in ["m.las", "m.laz"] {
        let cloud = Cloud::at(line(n)).with("scan_angle", 1, Owned::F32(angles.clone()));
        let (bytes, lines) = write(cloud, &Settings::default(), name).unwrap();
        let found = read(bytes).unwrap();
        let expected: Vec<f64> = angles.iter().copied().map(f64::from).collect();
        assert_eq!(column(&found, "scan_angle"), expected);
        assert!(lines.is_empty(), "{lines:?}");
    }
    let mut some = angles;
    (some[3], some[50]) = (f32::NAN, f32::NAN);
    let cloud = Cloud::at(line(n)).with("scan_angle", 1, Owned::F32(some));
    let (_, lines) = write(cloud, &Settings::default(), "m.las").unwrap();
    assert_eq!(lines, ["2 points have no `scan_angle`: 0 is written"]);
}

/// Invariant: where positions are moved, a line says by how much
/// Cost: milliseconds
#[test]
fn positions_between_steps_are_said_to_be_rounded() {
    let third = |n: u32| (0..3 * n).map(|i| f64::from(i) / 3.0).collect();
    let (bytes, lines) = write(Cloud::at(third(30)), &Settings::default(), "n.las").unwrap();
    let found = read(bytes).unwrap();
    let shift =
        column(&found, "position").iter().zip(0..).map(|(x, i)| (x - f64::from(i) / 3.0).abs());
    let shift = shift.fold(0.0, f64::max);
    let step = found.clouds[0].header.step.unwrap().x;
    assert!(shift > step / 4.0 && shift <= step / 2.0 * 1.001, "{shift} {step}");
    assert_eq!(lines.len(), 1, "{lines:?}");
    let rest = lines[0]
        .strip_prefix(&format!("positions are rounded to whole steps of {step}: by at most "));
    let said: f64 =
        rest.unwrap_or_else(|| panic!("{lines:?}")).split(' ').next().unwrap().parse().unwrap();
    assert!((said / shift - 1.0).abs() < 0.06, "{said} {shift}");
    let (_, lines) = write(Cloud::at(line(30)), &Settings::default(), "n.las").unwrap();
    assert!(lines.is_empty(), "{lines:?}");
}

/// Invariant: a cloud whose z does not point up comes back with the axis that does
/// Cost: milliseconds
#[test]
fn the_axis_that_points_up_comes_back() {
    for (up, n_lines) in [(UpAxis::Z, 0), (UpAxis::X, 1), (UpAxis::Y, 1), (UpAxis::Unknown, 1)] {
        for name in ["o.las", "o.laz"] {
            let mut cloud = Cloud::at(line(9));
            cloud.header.up = up;
            let (bytes, lines) = write(cloud, &Settings::default(), name).unwrap();
            let found = read(bytes).unwrap();
            assert_eq!(found.clouds[0].header.up, up);
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
            let said = lines.iter().filter(|line| line.contains("programs read LAS with z up"));
            assert_eq!((lines.len(), said.count()), (n_lines, n_lines), "{lines:?}");
        }
    }
}

/// Invariant: what stood where is not lost without a line
/// Cost: milliseconds
#[test]
fn places_of_scanners_are_said_to_be_left_out() {
    let mut cloud = Cloud::at(line(9));
    cloud.header.scanner = Some(DVec3::ONE);
    let (_, lines) = write(cloud, &Settings::default(), "p.las").unwrap();
    assert_eq!(lines, ["LAS has no place for the place of the scanner"]);
}

/// Invariant: what a LAS header has beside points comes back, and records that are not read are named
/// Cost: milliseconds
#[test]
fn the_numbers_of_a_header_come_back_and_other_records_are_named() {
    let mut made = Handmade::new(2, 1).with_walk(20, 3);
    for i in 0..6 {
        made.records.push(("Mapper", 100 + i, vec![7; 30]));
    }
    let mut bytes = made.las();
    bytes[4..6].copy_from_slice(&513u16.to_le_bytes());
    bytes[8..24].copy_from_slice(&std::array::from_fn::<u8, 16, _>(|i| 200 + i as u8));
    bytes[26..58].copy_from_slice(format!("{:\0<32}", "RIEGL").as_bytes());
    let before = read(bytes).unwrap();
    let comments = &before.clouds[0].header.comments;
    for said in ["file source id: 513", "record not read: `Mapper` 105, 30 bytes"] {
        assert!(comments.iter().any(|comment| comment == said), "{comments:?}");
    }
    let (bytes, lines) = write(cloud_of(&before), &Settings::default(), "h.las").unwrap();
    assert_eq!((&bytes[4..6], &bytes[26..33]), (&[1, 2][..], &b"RIEGL\0\0"[..]));
    assert_eq!(bytes[8..24], std::array::from_fn::<u8, 16, _>(|i| 200 + i as u8));
    let line = "records of the file that was read are left out: `Mapper` 100, 30 bytes; `Mapper` 101, 30 bytes; \
                `Mapper` 102, 30 bytes; `Mapper` 103, 30 bytes; 2 more";
    assert!(lines.iter().any(|said| said == line), "{lines:?}");
    let again = read(bytes).unwrap().clouds[0].header.comments.clone();
    let are_ours =
        |comment: &&String| !comment.contains("not read") && !comment.contains("software");
    assert_eq!(
        again.iter().filter(are_ours).collect::<Vec<_>>(),
        comments.iter().filter(are_ours).collect::<Vec<_>>()
    );
}

/// Invariant: where a coordinate system in WKT makes the version one whose angles are coarser, a line says so
/// Cost: milliseconds
#[test]
fn the_version_that_a_system_needs_is_said() {
    let wkt = "PROJCS[\"a\",UNIT[\"metre\",1]]";
    for (system, has_angles, n_lines) in [(wkt, true, 1), (wkt, false, 0), ("EPSG:2992", true, 0)] {
        let mut cloud = Cloud::at(line(9));
        if has_angles {
            cloud = cloud.with("scan_angle", 1, Owned::F32(vec![3.0; 9]));
        }
        cloud.header.coordinate_system = system.to_owned();
        let (_, lines) = write(cloud, &Settings::default(), "w.las").unwrap();
        let said = lines.iter().filter(|line| line.contains("since the coordinate system is WKT"));
        assert_eq!(said.count(), n_lines, "{lines:?}");
    }
}

/// Invariant: a file says when its points were taken where that is known, as far as it is
/// Cost: milliseconds
#[test]
fn days_and_years_come_back_and_nothing_is_made_up() {
    for (time, expected, n_lines) in [
        ("", "", 0),
        ("2018", "2018", 0),
        ("2018-03-05", "2018-03-05", 0),
        ("2018-03-05 00:00:00 UTC", "2018-03-05", 0),
        ("2018-03-05 10:00:00 UTC", "2018-03-05", 1),
        ("in spring", "", 1),
    ] {
        let mut cloud = Cloud::at(line(9));
        (cloud.header.time, cloud.header.up) = (time.to_owned(), UpAxis::Z);
        let (bytes, lines) = write(cloud, &Settings::default(), "t.las").unwrap();
        assert_eq!(read(bytes).unwrap().clouds[0].header.time, expected);
        assert_eq!(lines.len(), n_lines, "{time}: {lines:?}");
    }
}

/// Invariant: the `GeoTIFF` keys of a system without a code come back, beside WKT and alone
/// Cost: milliseconds
#[test]
fn keys_of_systems_without_a_code_come_back() {
    let directory: Vec<u8> = [1u16, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32767]
        .into_iter()
        .flat_map(u16::to_le_bytes)
        .collect();
    let wkt = b"PROJCS[\"a\",UNIT[\"metre\",1]]\0".to_vec();
    for has_wkt in [false, true] {
        let mut made = Handmade::new(2, 1).with_walk(20, 3);
        made.records.push(("LASF_Projection", 34735, directory.clone()));
        made.records.push(("LASF_Projection", 34737, b"mine|\0".to_vec()));
        if has_wkt {
            made.records.push(("LASF_Projection", 2112, wkt.clone()));
        }
        let before = read(made.las()).unwrap();
        let (bytes, lines) = write(cloud_of(&before), &Settings::default(), "k.las").unwrap();
        assert!(lines.is_empty(), "{lines:?}");
        let has = |part: &[u8]| bytes.windows(part.len()).any(|bytes| bytes == part);
        assert!(has(&directory) && has(b"mine|") && has(&wkt) == has_wkt);
        let after = read(bytes.clone()).unwrap();
        let system = |found: &Collected| found.clouds[0].header.coordinate_system.clone();
        assert_eq!(system(&after), system(&before));
        let (_, lines) = write(cloud_of(&before), &settings(Version::Newer), "k.las").unwrap();
        let said = lines.iter().filter(|line| line.contains("GeoTIFF keys")).count();
        assert_eq!(said, usize::from(!has_wkt), "{lines:?}");
    }
}
