//! PTX files.

use super::tables::heads;
use super::*;
use crate::ptx::Ptx;
use surfelshop_api::format::UpAxis;
use surfelshop_api::glam::{DQuat, DVec3};

fn read_ptx(text: &str) -> Result<Collected> {
    read_with::<Ptx>(text.as_bytes(), "a.ptx", &())
}

/// A scan of these rows, turned by a quarter round z and moved.
fn scan(columns: usize, rows: usize, lines: &str) -> String {
    let place = "100.5 200 5";
    let axes = "0 1 0\n-1 0 0\n0 0 1";
    let matrix = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n100.5 200 5 1";
    format!("{columns}\n{rows}\n{place}\n{axes}\n{matrix}\n{lines}")
}

#[test]
fn scans_have_poses_names_and_the_scanner_at_zero() {
    let first =
        scan(2, 2, "1 0 0 0.5 255 0 0\n0 1 0 0.25 0 255 0\n0 0 1 1 0 0 255\n-1 -1 0 0 9 9 9\n");
    let second = scan(1, 3, "1 0 0 0.5\n2 0 0 0.5\n3 1 0 0.5\n");
    let found = read_ptx(&(first + &second)).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let [a, b] = found.clouds.as_slice() else { panic!("{}", found.clouds.len()) };
    assert_eq!(shape(a), "position 3 f64, intensity 1 f32, color 3 u8");
    assert_eq!(shape(b), "position 3 f64, intensity 1 f32");
    assert_eq!((a.header.name.as_str(), b.header.name.as_str()), ("scan 1", "scan 2"));
    assert_eq!((a.header.rows, b.header.rows), (Some(4), Some(3)));
    assert_eq!((a.header.scanner, a.header.up), (Some(DVec3::ZERO), UpAxis::Z));
    assert_eq!((a.header.grid, b.header.grid), (Some([2, 2]), None));
    // The cloud's own x is the common y.
    let pose = a.header.pose;
    assert_eq!(pose.translation, DVec3::new(100.5, 200.0, 5.0));
    assert!((pose.rotation * DVec3::X - DVec3::Y).length() < 1e-12);
    assert!((pose.rotation * DVec3::Y + DVec3::X).length() < 1e-12);
    assert_eq!(a.columns[0][..6], [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert_eq!(heads::<Ptx>(scan(1, 1, "1 2 3 0\n").repeat(3).as_bytes(), &()).len(), 3);
}

#[test]
fn places_of_a_line_without_a_return_are_left_out_and_counted_once() {
    let lines = "0 0 0 0.5\n1 0 0 0.5\n0.000000 -0.0 0 0.500000\n2 1 0 0.25\n";
    let found = read_ptx(&scan(1, 4, lines).repeat(2)).unwrap();
    assert_eq!(found.clouds.len(), 2);
    for cloud in &found.clouds {
        assert_eq!(cloud.columns[0], [1.0, 0.0, 0.0, 2.0, 1.0, 0.0]);
        assert_eq!(cloud.columns[1], [0.5, 0.25]);
        assert_eq!(cloud.header.rows, None);
    }
    let line = "nothing came back from 4 places of the grids, which are left out";
    assert_eq!(found.warnings, [line]);
}

#[test]
fn grids_keep_places_without_a_return() {
    // Three columns of two rows are three rows of ours.
    let lines = "0 0 0 0.5\n1 0 0 0.5\n3 0 0 0.5\n0 -0.0 0 0.5\n2 1 0 0.25\n5 5 5 1\n";
    let found = read_ptx(&scan(3, 2, lines)).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let cloud = &found.clouds[0];
    assert_eq!((cloud.header.grid, cloud.header.rows), (Some([2, 3]), Some(6)));
    let is_none: Vec<bool> =
        cloud.columns[0].chunks(3).map(|p| p.iter().all(|c| c.is_nan())).collect();
    assert_eq!(is_none, [true, false, false, true, false, false]);
    assert_eq!(cloud.columns[1].len(), 6);
    // A grid that the file has no room for is none.
    let short = read_ptx(&scan(3, 2000, lines)).unwrap();
    assert_eq!((short.clouds[0].header.grid, short.clouds[0].columns[0].len()), (None, 12));
}

#[test]
fn headers_of_scans_behind_one_whose_lines_grow_short_are_found() {
    let long = "-123.456789 234.567891 -345.678912 0.123456\n".repeat(6000);
    let first = scan(12_000, 1, &(long + &"0 0 0 0.5\n".repeat(6000)));
    let text = first + &scan(3, 1, "1 2 3 0.5\n4 5 6 0.5\n7 8 9 0.5\n");
    let heads = heads::<Ptx>(text.as_bytes(), &());
    let names: Vec<&str> = heads.iter().map(|header| header.name.as_str()).collect();
    assert_eq!(names, ["scan 1", "scan 2"]);
    assert_eq!(read_ptx(&text).unwrap().clouds.len(), 2);
}

#[test]
fn a_matrix_that_is_no_rotation_moves_the_points() {
    let points = "1 0 0 0.5\n0 1 0 0.5\n0 0 0 0.5\n0 0 2 0.5\n";
    let scaled = "4\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n2 0 0 0\n0 2 0 0\n0 0 2 0\n10 20 30 1\n";
    let found = read_ptx(&format!("{scaled}{points}")).unwrap();
    let cloud = &found.clouds[0];
    assert_eq!(cloud.columns[0], [12.0, 20.0, 30.0, 10.0, 22.0, 30.0, 10.0, 20.0, 34.0]);
    assert_eq!(cloud.header.pose.rotation, DQuat::IDENTITY);
    assert_eq!(cloud.header.pose.translation, DVec3::ZERO);
    assert_eq!(cloud.header.scanner, Some(DVec3::new(10.0, 20.0, 30.0)));
    assert!(found.warnings[0].contains("no rotation"), "{:?}", found.warnings);
    // A mirror is none, either.
    let mirror = scaled.replace("2 0 0 0", "-1 0 0 0").replace("0 2 0 0", "0 1 0 0");
    let mirror = mirror.replace("0 0 2 0", "0 0 1 0");
    let found = read_ptx(&format!("{mirror}{points}")).unwrap();
    assert_eq!(found.clouds[0].columns[0][..3], [9.0, 20.0, 30.0]);
    // Some programs write the matrix for column vectors.
    let turned = "4\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0 10\n1 0 0 20\n0 0 1 30\n0 0 0 1\n";
    let found = read_ptx(&format!("{turned}{points}")).unwrap();
    let pose = found.clouds[0].header.pose;
    assert_eq!(pose.translation, DVec3::new(10.0, 20.0, 30.0));
    assert!((pose.rotation * DVec3::X - DVec3::Y).length() < 1e-12);
    assert!(found.warnings[0].contains("last column"), "{:?}", found.warnings);
}

#[test]
fn a_scanner_that_cannot_stand_at_zero_is_unknown() {
    let far = "637012.24 849028.31 431.66 0.1\n636896.33 849087.7 446.39 0.2\n";
    let found = read_ptx(&scan(2, 1, far)).unwrap();
    assert_eq!(found.clouds[0].header.scanner, None);
}

#[test]
fn announced_grids_that_are_not_there_are_told() {
    let found = read_ptx(&scan(4444, 10_014, "1 0 0 0.5\n2 0 1 0.5\n")).unwrap();
    assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (None, 6));
    assert_eq!(found.warnings, ["scan 1: 44502216 points are announced, 2 were read"]);
    let huge = scan(usize::MAX, usize::MAX, "1 0 0 0.5\n2 0 1 0.5\n");
    assert_eq!(read_ptx(&huge).unwrap().clouds[0].columns[0].len(), 6);
    // Fewer lines than announced, and another scan.
    let short = scan(3, 1, "1 0 0 0.5\n2 0 1 0.5\n");
    let found = read_ptx(&short.repeat(2)).unwrap();
    let lengths: Vec<usize> = found.clouds.iter().map(|cloud| cloud.columns[0].len()).collect();
    assert_eq!(lengths, [6, 6]);
    let line = refusal(read_ptx(&scan(1, 1, "").replace("0 0 1 0\n", "0 0 1\n")));
    assert!(line.starts_with("line 9: expected 4 numbers of the matrix"), "{line}");
    assert!(refusal(read_ptx("3\n2 1\n")).starts_with("line 2: expected the number of rows"));
    assert!(refusal(read_ptx("3\n2\n1 2 3\n")).contains("the end of the file"));
    assert_eq!(read_ptx(&scan(0, 0, "")).unwrap().clouds[0].header.rows, Some(0));
}

#[test]
fn many_scans_are_read_one_behind_the_other() {
    let mut text = String::new();
    let counts = [6_000usize, 3, 9_000, 500];
    for (number, &count) in counts.iter().enumerate() {
        let mut lines = String::new();
        for i in 0..count {
            lines += &format!("{}.5 {number} {i} 0.25 1 2 3\n", i % 77);
        }
        text += &scan(count, 1, &lines);
    }
    let found = read_ptx(&text).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let lengths: Vec<usize> = found.clouds.iter().map(|c| c.columns[0].len() / 3).collect();
    assert_eq!(lengths, counts);
    for (number, cloud) in found.clouds.iter().enumerate() {
        for (i, point) in cloud.columns[0].chunks_exact(3).enumerate() {
            assert_eq!(point, [(i % 77) as f64 + 0.5, number as f64, i as f64]);
        }
    }
    assert_eq!(heads::<Ptx>(text.as_bytes(), &()).len(), 4);
}
