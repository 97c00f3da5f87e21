//! PTS files.

use super::tables::heads;
use super::*;
use crate::pts::Pts;

fn read_pts(text: &str) -> Result<Collected> {
    read_with::<Pts>(text.as_bytes(), "a.pts", &())
}

#[test]
fn a_count_is_followed_by_its_points() {
    let found = read_pts("2\n1 2 3 -2048 255 0 9\n4 5 6 2047 1 2 3\n").unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let cloud = &found.clouds[0];
    assert_eq!(shape(cloud), "position 3 f64, intensity 1 f32, color 3 u8");
    assert_eq!(cloud.header.rows, Some(2));
    assert_eq!(cloud.header.format, "PTS text, columns x,y,z,intensity,r,g,b by their values");
    assert_eq!(cloud.header.comments, Vec::<String>::new());
    assert_eq!(cloud.columns[0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(cloud.columns[1], [-2048.0, 2047.0]);
    assert_eq!(cloud.columns[2], [255.0, 0.0, 9.0, 1.0, 2.0, 3.0]);
    for (row, expected) in [
        ("1 2 3", "position 3 f64"),
        ("1 2 3 0.5", "position 3 f64, intensity 1 f32"),
        ("1 2 3 255 0 7", "position 3 f64, color 3 u8"),
    ] {
        assert_eq!(shape(&read_pts(&format!("1\n{row}\n")).unwrap().clouds[0]), expected);
    }
}

#[test]
fn several_counts_are_several_clouds_which_may_differ() {
    let text = "2\n1 2 3\n4 5 6\n3 \n1 2 3 0.5\n4 5 6 0.25\n7 8 9 1\n0\n1\n1 1 1\n";
    let found = read_pts(text).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    let rows: Vec<_> = found.clouds.iter().map(|cloud| cloud.header.rows).collect();
    assert_eq!(rows, [Some(2), Some(3), Some(0), Some(1)]);
    assert_eq!(shape(&found.clouds[1]), "position 3 f64, intensity 1 f32");
    assert_eq!(found.clouds[1].columns[1], [0.5, 0.25, 1.0]);
    assert_eq!(found.clouds[3].columns[0], [1.0; 3]);
    let heads = heads::<Pts>(text.as_bytes(), &());
    let rows: Vec<_> = heads.iter().map(|header| header.rows).collect();
    assert_eq!(rows, [Some(2), Some(3), Some(0), Some(1)]);
}

#[test]
fn large_clouds_one_behind_the_other_are_told_apart() {
    let mut text = String::new();
    let counts = [8_000usize, 1, 15_000, 20];
    for (number, &count) in counts.iter().enumerate() {
        text += &format!("{count}\n");
        for i in 0..count {
            text += &format!("{number} {i}.5 {}\n", "7".repeat(1 + i % 9));
        }
    }
    let found = read_pts(&text).unwrap();
    assert_eq!(found.warnings, Vec::<String>::new());
    for (number, (cloud, &count)) in found.clouds.iter().zip(&counts).enumerate() {
        assert_eq!(cloud.columns[0].len(), 3 * count);
        for (i, point) in cloud.columns[0].chunks_exact(3).enumerate() {
            assert_eq!(point[..2], [number as f64, i as f64 + 0.5]);
        }
    }
    assert_eq!(found.clouds.len(), 4);
    assert_eq!(heads::<Pts>(text.as_bytes(), &()).len(), 4);
}

#[test]
fn a_count_that_is_wrong_or_missing_is_told() {
    let found = read_pts("1 2 3\n4 5 6\n").unwrap();
    assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (None, 6));
    // No file of this length has so many lines; memory is not taken for them.
    let found = read_pts("999999999999999999999\n1 2 3\n4 5 6\n").unwrap();
    assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (None, 6));
    assert_eq!(found.warnings, ["18446744073709551615 points are announced, 2 were read"]);
    let found = read_pts("1\n1 2 3\n4 5 6\n").unwrap();
    assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (Some(1), 3));
    assert_eq!(found.warnings, ["the file announces 1 points and has 1 more, which are left out"]);
    // Zero is what some programs write before they know.
    let found = read_pts("0\n1 2 3\n4 5 6\n").unwrap();
    assert_eq!((found.clouds[0].header.rows, found.clouds[0].columns[0].len()), (None, 6));
    assert_eq!(read_pts("0\n").unwrap().clouds[0].header.rows, Some(0));
}

#[test]
fn files_of_very_many_clouds_end() {
    let text = "1\n1 2 3\n".repeat(300);
    assert_eq!(read_pts(&text).unwrap().clouds.len(), 300);
    let text = "99999\n1 2 3\n".repeat(300);
    assert_eq!(read_pts(&text).unwrap().clouds.len(), 300);
    let text = "5\n".repeat(100_000);
    assert!(refusal(read_pts(&text)).contains("three numbers"));
    assert!(refusal(read_pts(&"0\n".repeat(70_000))).contains("at most 65536 clouds"));
}
