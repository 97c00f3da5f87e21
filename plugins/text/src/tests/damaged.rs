//! Files that are damaged: a warning or a line, never a panic, and an end.

use super::*;
use crate::pts::Pts;
use crate::ptx::Ptx;
use std::fmt::Write;

#[test]
fn a_few_lines_that_cannot_be_read_are_counted_in_one_warning() {
    let mut text = "1 2 3\n".repeat(500);
    text.insert_str(6 * 10, "4 5\n");
    text += "4 5 six\n";
    let found = read(&text).unwrap();
    assert_eq!(found.clouds[0].columns[0].len(), 1500);
    let line = "2 of 502 lines cannot be read and are left out; the first is line 11: `4 5`";
    assert_eq!(found.warnings, [line]);
    // One line alone is no reason to refuse a short file, more are.
    assert_eq!(read("1 2 3\n1 2 3\n1 2\n").unwrap().warnings.len(), 1);
    let line = refusal(read(&("1 2 3\n".repeat(150) + "a b c\nd e f\n")));
    assert!(line.contains("found 2 of 152") && line.contains("line 151: `a b c`"), "{line}");
}

#[test]
fn a_damaged_line_does_not_change_what_columns_are_taken_for() {
    let row = |i: usize| format!("{i}.25 {i}.5 0.125 {} 2 3 {}\n", i % 255, i * 7);
    let rows: Vec<String> = (0..60).map(row).collect();
    for header in ["", "x y z r g b intensity\n"] {
        for damaged in 0..rows.len() {
            for word in [0, 6] {
                let mut lines = rows.clone();
                let mut words: Vec<&str> = rows[damaged].split(' ').collect();
                words[word] = "1x3";
                lines[damaged] = words.join(" ").trim_end().to_owned() + "\n";
                let found = read(&(header.to_owned() + &lines.concat())).unwrap();
                let shape = shape(&found.clouds[0]);
                assert!(shape.starts_with("position 3 f64, color 3 u8, "), "{damaged}: {shape}");
                assert_eq!(found.clouds[0].columns[0].len(), 59 * 3);
            }
        }
    }
}

#[test]
fn numbers_that_a_guessed_type_does_not_hold_are_left_out_and_told() {
    // Behind the sample, so that nobody could know.
    let mut text = "x,y,z,class\n".to_owned() + &"1,2,3,4\n".repeat(100_000);
    let place = text.len() / 2 / 8 * 8 + 4096 * 3;
    let place = place + text[place..].find('\n').unwrap() + 1;
    text.insert_str(place, "1,2,3,256\n1,2,3,2.5\n");
    let found = read(&text).unwrap();
    assert_eq!(shape(&found.clouds[0]), "position 3 f64, classification 1 u8");
    assert_eq!(found.clouds[0].columns[1].len(), 100_000);
    assert!(found.warnings[0].contains("2 of 100002 lines"), "{:?}", found.warnings);
    let number = text[..place].lines().count() + 1;
    assert!(found.warnings[0].ends_with(&format!("line {number}: `1,2,3,256`")));
}

#[test]
fn what_is_no_table_is_refused_in_a_line() {
    assert!(refusal(read("")).contains("empty"));
    assert!(refusal(read("\n\n# only a comment\n")).contains("found none"));
    assert!(refusal(read("hello\nworld\n")).contains("`hello`"));
    assert!(refusal(read("1 2\n3 4\n")).contains("three numbers"));
    assert!(refusal(read("1 2 3\0")).contains("binary"));
    let grid = "ncols 4\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4\n5 6 7 8\n";
    assert!(refusal(read(grid)).contains("grid of heights, `ncols 4`"));
    let wide = [0xFF, 0xFE, b'1', 0, b' ', 0];
    let line = refusal(read_with::<Xyz>(&wide, "a.txt", &Settings::default()));
    assert!(line.contains("UTF-16"), "{line}");
    let long = vec![b'1'; 18 << 20];
    let line = refusal(read_with::<Xyz>(&long, "a.txt", &Settings::default()));
    assert!(line.contains("16777216 bytes"), "{line}");
    let long = [b"1 2 3\n".repeat(2000).as_slice(), &long].concat();
    let line = refusal(read_with::<Xyz>(&long, "a.txt", &Settings::default()));
    assert!(line.contains("16777216 bytes"), "{line}");
    // Most of it is no text of numbers: it is given up early.
    let text = "1 2 3\n".repeat(2000) + &"x\n".repeat(100_000);
    assert!(refusal(read(&text)).contains("that are none"));
}

/// Small files of each format.
fn samples() -> Vec<(&'static str, String)> {
    let mut rows = String::new();
    for i in 0..20 {
        let (x, r) = (f64::from(i) * 0.37 - 4.0, i * 5);
        writeln!(rows, "{x:.3} {:.3} {:.3} 0.25 {r} 20 255", x * 2.0, x * x).unwrap();
    }
    let matrix = "1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 30 1\n";
    let scan = format!("4\n5\n10 20 30\n1 0 0\n0 1 0\n0 0 1\n{matrix}{rows}");
    vec![
        ("xyz", format!("x y z intensity r g b\n{rows}")),
        ("csv", format!("x,y,z,i,red,green,blue\n{}", rows.replace(' ', ","))),
        ("txt", rows.replace(' ', ";").replace('.', ",")),
        ("pts", format!("20\n{rows}20\n{rows}")),
        ("ptx", format!("{scan}{scan}")),
    ]
}

fn read_any(ending: &str, bytes: &[u8]) -> Result<Collected> {
    match ending {
        "pts" => read_with::<Pts>(bytes, "a.pts", &()),
        "ptx" => read_with::<Ptx>(bytes, "a.ptx", &()),
        _ => read_with::<Xyz>(bytes, "a.xyz", &Settings::default()),
    }
}

/// Reads damaged bytes: whatever comes of it is sound.
fn survives(ending: &str, bytes: &[u8]) {
    match read_any(ending, bytes) {
        Ok(found) => {
            let lines = found.warnings.iter();
            assert!(lines.clone().all(|line| !line.is_empty() && !line.contains('\n')));
            for cloud in &found.clouds {
                let n_points = cloud.columns[0].len() / 3;
                assert!(n_points <= bytes.len() / 5 + 1);
                assert!(cloud.header.rows.is_none_or(|rows| rows >= n_points as u64));
                assert!(cloud.header.pose.translation.is_finite());
            }
        }
        Err(error) => assert!(!error.message().is_empty() && !error.message().contains('\n')),
    }
}

#[test]
fn files_cut_anywhere_neither_panic_nor_hang() {
    for (ending, text) in samples() {
        let whole = read_any(ending, text.as_bytes()).unwrap();
        assert!(whole.warnings.is_empty(), "{ending}: {:?}", whole.warnings);
        let n_rows: usize = whole.clouds.iter().map(|cloud| cloud.columns[0].len() / 3).sum();
        assert_eq!(n_rows, if ending.starts_with("pt") { 40 } else { 20 }, "{ending}");
        for len in (0..text.len()).step_by(3) {
            survives(ending, &text.as_bytes()[..len]);
        }
    }
}

#[test]
fn flipped_bytes_neither_panic_nor_hang() {
    let mut seeded = Seeded(11);
    for (ending, text) in samples() {
        for _ in 0..150 {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..1 + seeded.below(6) {
                let place = seeded.below(bytes.len());
                bytes[place] = match seeded.below(3) {
                    0 => seeded.next() as u8,
                    1 => b"\n\r ,;.-9e\0#"[seeded.below(11)],
                    _ => bytes[place] ^ (1 << seeded.below(8)),
                };
            }
            survives(ending, &bytes);
        }
    }
}

#[test]
fn lines_moved_and_doubled_neither_panic_nor_hang() {
    let mut seeded = Seeded(12);
    for (ending, text) in samples() {
        for _ in 0..100 {
            let mut lines: Vec<&str> = text.lines().collect();
            for _ in 0..1 + seeded.below(4) {
                let (from, to) = (seeded.below(lines.len()), seeded.below(lines.len()));
                match seeded.below(3) {
                    0 => lines.swap(from, to),
                    1 => lines.insert(to, lines[from]),
                    _ => drop(lines.remove(from)),
                }
            }
            survives(ending, lines.join("\n").as_bytes());
        }
    }
}
