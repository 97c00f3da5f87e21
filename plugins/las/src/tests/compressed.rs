//! Compressed files, made by the crate `laz`, against the same files without compression.

use super::handmade::Handmade;
use super::{column, read, read_columns};
use laz::las::{
    Point0, Point1, Point2, Point3, Point4, Point5, Point6, Point7, Point8, Point9, Point10,
};
use laz::{LazItem, LazItemRecordBuilder as Items};
use surfelshop_api::format::Collected;

/// The compressed fields of a format in a version of the compression.
fn items(format: u8, version: u8, n_extra: u16) -> Vec<LazItem> {
    match (version, format) {
        (1, 0) => Items::version_1_of::<Point0>(n_extra),
        (1, 1) => Items::version_1_of::<Point1>(n_extra),
        (1, 2) => Items::version_1_of::<Point2>(n_extra),
        (1, 3) => Items::version_1_of::<Point3>(n_extra),
        (1, 4) => Items::version_1_of::<Point4>(n_extra),
        (1, _) => Items::version_1_of::<Point5>(n_extra),
        (2, 0) => Items::version_2_of::<Point0>(n_extra),
        (2, 1) => Items::version_2_of::<Point1>(n_extra),
        (2, 2) => Items::version_2_of::<Point2>(n_extra),
        (2, 3) => Items::version_2_of::<Point3>(n_extra),
        (2, 4) => Items::version_2_of::<Point4>(n_extra),
        (2, _) => Items::version_2_of::<Point5>(n_extra),
        (3, 6) => Items::version_3_of::<Point6>(n_extra),
        (3, 7) => Items::version_3_of::<Point7>(n_extra),
        (3, 8) => Items::version_3_of::<Point8>(n_extra),
        (3, 9) => Items::version_3_of::<Point9>(n_extra),
        (3, _) => Items::version_3_of::<Point10>(n_extra),
        (_, 6) => Items::version_4_of::<Point6>(n_extra),
        (_, 7) => Items::version_4_of::<Point7>(n_extra),
        (_, 8) => Items::version_4_of::<Point8>(n_extra),
        (_, 9) => Items::version_4_of::<Point9>(n_extra),
        (_, _) => Items::version_4_of::<Point10>(n_extra),
    }
}

/// Whether two readings found the same values.
fn assert_same(plain: &Collected, packed: &Collected, what: &str) {
    let (plain, packed) = (&plain.clouds[0], &packed.clouds[0]);
    assert_eq!(plain.header.rows, packed.header.rows, "{what}");
    assert_eq!(plain.header.columns, packed.header.columns, "{what}");
    for ((one, other), column) in
        plain.columns.iter().zip(&packed.columns).zip(&plain.header.columns)
    {
        assert_eq!(one.len(), other.len(), "{} of {what}", column.name);
        let differ =
            one.iter().zip(other).position(|(one, other)| one.to_bits() != other.to_bits());
        assert_eq!(differ, None, "{} of {what}", column.name);
    }
}

#[test]
fn every_format_and_version_is_decompressed() {
    for format in 0..=10u8 {
        for version in if format < 6 { [1, 2] } else { [3, 4] } {
            for n_extra in [0u16, 5] {
                let minor = if format < 6 { 3 } else { 4 };
                let made = Handmade::new(minor, format).with_walk(1500, usize::from(n_extra));
                let what = format!("format {format}, version {version}, {n_extra} extra bytes");
                let items = items(format, version, n_extra);
                // Files of the first version are of the oldest kind.
                let packed =
                    read(if version == 1 { made.laz_run(items) } else { made.laz(items, &[400]) });
                let packed = packed.unwrap_or_else(|line| panic!("{what}: {line}"));
                let plain = read(made.las()).unwrap();
                assert_same(&plain, &packed, &what);
                assert_eq!(plain.warnings, packed.warnings, "{what}");
                let name = &packed.clouds[0].header.format;
                assert_eq!(name, &format!("LAZ 1.{minor}, point format {format}"));
            }
        }
    }
}

#[test]
fn fields_that_are_not_wanted_are_passed_over_and_the_others_are_right() {
    let made = Handmade::new(4, 8).with_walk(2000, 3);
    let names =
        ["gps_time", "color", "nir", "extra_bytes", "intensity", "class_flags", "scan_flags"];
    for name in names.into_iter().chain(["classification", "scan_angle", "user_data", "n_returns"])
    {
        let wanted = [name.to_owned()];
        let plain = read_columns(made.las(), Some(&wanted)).unwrap();
        let packed = read_columns(made.usual_laz(&[700]), Some(&wanted)).unwrap();
        assert_same(&plain, &packed, name);
    }
}

#[test]
fn chunks_may_differ_in_size_and_the_table_may_be_told_at_the_end() {
    for (format, minor) in [(3u8, 2u8), (7, 4)] {
        let made = Handmade::new(minor, format).with_walk(1200, 0);
        let plain = read(made.las()).unwrap();
        let varied = made.usual_laz(&[1, 500, 7, 600, 92]);
        assert_same(&plain, &read(varied).unwrap(), "chunks of many sizes");
        let mut open = made.usual_laz(&[500]);
        let start = u32::from_le_bytes(open[96..100].try_into().unwrap()) as usize;
        let place: [u8; 8] = open[start..start + 8].try_into().unwrap();
        open[start..start + 8].copy_from_slice(&u64::MAX.to_le_bytes());
        open.extend(place);
        let found = read(open).unwrap();
        assert_same(&plain, &found, "a table that is told at the end");
        assert!(found.warnings.is_empty());
    }
}

#[test]
fn points_are_found_without_a_table() {
    for (format, minor) in [(3u8, 2u8), (7, 4)] {
        let made = Handmade::new(minor, format).with_walk(1200, 2);
        let plain = read(made.las()).unwrap();
        let mut file = made.usual_laz(&[500]);
        let start = u32::from_le_bytes(file[96..100].try_into().unwrap()) as usize;
        let table = u64::from_le_bytes(file[start..start + 8].try_into().unwrap()) as usize;
        for place in [u64::MAX, 0, table as u64 + 3, 1 << 60] {
            let mut file = file.clone();
            file.truncate(table + 4);
            file[start..start + 8].copy_from_slice(&place.to_le_bytes());
            let found = read(file).unwrap();
            assert_same(&plain, &found, "points without a table");
            assert!(found.warnings.iter().any(|line| line.contains("table of chunks is missing")));
        }
        if minor == 4 {
            // Cut within the second chunk, the table gone: what is missing is counted.
            let mut cut = file.clone();
            cut.truncate(usize::midpoint(start + 8, table));
            let found = read(cut).unwrap();
            let line = "500 of 1200 points are in chunks that are whole";
            assert!(found.warnings.iter().any(|told| told.contains(line)), "{:?}", found.warnings);
        }
        // Of a table that announces too much, nothing is believed.
        file[table + 4..table + 8].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_same(&plain, &read(file).unwrap(), "a table of too many chunks");
    }
    let made = Handmade::new(2, 1).with_walk(300, 0);
    let mut varied = made.usual_laz(&[100, 200]);
    let start = u32::from_le_bytes(varied[96..100].try_into().unwrap()) as usize;
    varied[start..start + 8].copy_from_slice(&(1u64 << 60).to_le_bytes());
    let line = read(varied).unwrap_err().to_string();
    assert!(line.contains("expected a table of chunks"), "{line}");
}

#[test]
fn the_oldest_kind_is_one_run() {
    for version in [1, 2] {
        let made = Handmade::new(0, 3).with_walk(70_000, 0);
        let file = made.laz_run(items(3, version, 0));
        assert_same(&read(made.las()).unwrap(), &read(file).unwrap(), "one run");
    }
}

#[test]
fn chunks_of_many_points_are_handed_over_bit_by_bit() {
    let made = Handmade::new(4, 6).with_walk(150_000, 0);
    let wanted = ["intensity".to_owned()];
    let plain = read_columns(made.las(), Some(&wanted)).unwrap();
    let packed = read_columns(made.usual_laz(&[140_000]), Some(&wanted)).unwrap();
    assert_same(&plain, &packed, "a chunk of 140,000 points and one of 10,000");
}

#[test]
fn numbers_of_compressed_points_are_those_of_the_chunks() {
    for (format, minor) in [(1u8, 2u8), (6, 4)] {
        let made = Handmade::new(minor, format).with_walk(1100, 0);
        let plain = read(made.las()).unwrap();
        let is_layered = format == 6;
        for (announced, chunks) in
            [(0u64, vec![400]), (500, vec![400]), (900, vec![400, 700]), (0, vec![400, 700])]
        {
            let file = Handmade { announced: Some(announced), ..made.clone() }.usual_laz(&chunks);
            let found = read(file).unwrap();
            assert!(
                found.warnings[0].contains(&format!("announces {announced} points")),
                "{found:?}"
            );
            let intensity = column(&found, "intensity");
            let right = &column(&plain, "intensity")[..1100];
            // Where nobody says how many points the last chunk has, it is decoded until its bytes end.
            assert!(intensity.len() >= 1100 && intensity[..1100] == *right);
            assert!(intensity.len() == 1100 || (!is_layered && chunks.len() == 1));
        }
        let more = Handmade { announced: Some(5000), ..made.clone() }.usual_laz(&[400]);
        let found = read(more).unwrap();
        assert!(found.warnings[0].contains("announces 5000 points, the chunks have 1200"));
        assert!(column(&found, "intensity").len() >= 1100);
    }
}

#[test]
fn copc_files_say_so() {
    let mut made = Handmade::new(4, 7).with_walk(300, 0);
    made.records.push(("copc", 1, vec![0; 160]));
    let found = read(made.usual_laz(&[100, 150, 50])).unwrap();
    assert_eq!(found.clouds[0].header.format, "COPC 1.0, point format 7");
    assert_same(&read(made.las()).unwrap(), &found, "a COPC file");
}
