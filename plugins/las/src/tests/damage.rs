//! Damaged files: they are read as far as they go, or refused in a line, and never take long.

use super::handmade::{Handmade, walk};
use super::{Random, column, read};
use crate::extra::descriptor;
use laz::LazVlrBuilder;
use std::time::{Duration, Instant};

/// Files of every kind, of so many points.
fn files(n: usize) -> Vec<Vec<u8>> {
    let mut old = Handmade::new(2, 3).with_walk(n, 6);
    old.records.push(("LASF_Spec", 4, [descriptor("a", "", 3), descriptor("b", "", 9)].concat()));
    old.records.push((
        "LASF_Projection",
        34735,
        vec![1, 0, 1, 0, 0, 0, 1, 0, 0, 12, 0, 0, 1, 0, 7, 7],
    ));
    let mut new = Handmade::new(4, 8).with_walk(n, 3);
    new.records.push(("LASF_Spec", 4, descriptor("c", "", 21).to_vec()));
    new.later.push(("LASF_Projection", 2112, br#"PROJCS["a",UNIT["metre",1]]"#.to_vec()));
    vec![
        old.las(),
        new.las(),
        old.usual_laz(&[n / 3]),
        new.usual_laz(&[n / 3]),
        new.usual_laz(&[n / 10, n / 2, n]),
        Handmade::new(1, 1).with_walk(n, 0).laz_run(
            LazVlrBuilder::default().with_point_format(1, 0).unwrap().build().items().clone(),
        ),
    ]
}

/// Reads a file, which must not take long; whether points were found.
fn survives(file: Vec<u8>, what: &str) -> bool {
    let started = Instant::now();
    let result = read(file);
    let took = started.elapsed();
    assert!(took < Duration::from_secs(60), "{what} took {took:?}");
    match result {
        Ok(found) => {
            let cloud = &found.clouds[0];
            let announced = cloud.header.rows.unwrap_or(u64::MAX);
            assert!(cloud.columns[0].len() as u64 / 3 <= announced, "{what}");
            !cloud.columns[0].is_empty()
        }
        Err(line) => {
            let line = line.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{what}: {line}");
            false
        }
    }
}

#[test]
fn files_may_end_anywhere() {
    for (i, file) in files(40).iter().enumerate() {
        let mut n_read = 0;
        for len in (0..file.len()).step_by(7) {
            n_read +=
                usize::from(survives(file[..len].to_vec(), &format!("{len} bytes of file {i}")));
        }
        assert!(n_read > 5, "of file {i} nothing was read where it is cut short");
    }
}

#[test]
fn bytes_may_be_anything() {
    let mut random = Random(5);
    for (i, file) in files(100).iter().enumerate() {
        for round in 0..150 {
            let mut damaged = file.clone();
            for _ in 0..=random.below(4) {
                // Half of the damage goes to headers and records.
                let most = if random.below(2) == 0 { 900.min(file.len()) } else { file.len() };
                damaged[random.below(most as u64) as usize] = random.next() as u8;
            }
            survives(damaged, &format!("round {round} of file {i}"));
        }
    }
}

#[test]
fn stretches_may_be_all_alike() {
    let mut random = Random(6);
    for (i, file) in files(100).iter().enumerate() {
        for round in 0..30 {
            let mut damaged = file.clone();
            let start = random.below(file.len() as u64) as usize;
            let end = (start + random.below(3000) as usize).min(file.len());
            damaged[start..end].fill([0, 0xff][round % 2]);
            survives(damaged, &format!("round {round} of file {i}"));
        }
    }
}

/// The decoder of times in `laz` 0.13 calls itself for each change of sequence, which such bytes are full of, until
/// the stack is full.
#[test]
fn times_that_change_their_sequence_for_ever_end() {
    for (format, minor) in [(1u8, 2u8), (6, 4)] {
        let made = Handmade { announced: Some(50_000), ..Handmade::new(minor, format) };
        let made = Handmade { points: walk(format, 1, 0), ..made };
        let mut file = made.usual_laz(&[50_000]);
        let start = u32::from_le_bytes(file[96..100].try_into().unwrap()) as usize;
        file[start..start + 8].fill(0xff);
        file.truncate(start + 8 + made.record_len());
        let n_bytes = 200_000u32;
        if format == 6 {
            file.extend(50_000u32.to_le_bytes());
            file.extend(n_bytes.to_le_bytes().repeat(9));
        }
        file.resize(file.len() + 9 * n_bytes as usize, 0xff);
        let found = read(file).unwrap();
        assert!(found.warnings.iter().any(|line| line.contains("times of pulses")), "{found:?}");
    }
}

#[test]
fn numbers_that_lie_answer_at_once() {
    let made = Handmade::new(4, 6).with_walk(20, 0);
    for (at, bytes) in [
        (100, u32::MAX.to_le_bytes().to_vec()),
        (243, u32::MAX.to_le_bytes().to_vec()),
        (247, u64::MAX.to_le_bytes().to_vec()),
        (235, [u64::MAX.to_le_bytes().as_slice(), &u32::MAX.to_le_bytes()].concat()),
    ] {
        for file in [made.las(), made.usual_laz(&[8])] {
            let mut file = file;
            file[at..at + bytes.len()].copy_from_slice(&bytes);
            let started = Instant::now();
            let found = read(file);
            assert!(started.elapsed() < Duration::from_secs(5), "byte {at}");
            assert!(found.is_ok_and(|found| !found.warnings.is_empty()), "byte {at}");
        }
    }
    // Empty records that fill the file.
    let mut many = Handmade::new(2, 0).with_walk(3, 0);
    many.records = vec![("x", 1, Vec::new()); 70_000];
    let mut file = many.las();
    file[100..104].copy_from_slice(&u32::MAX.to_le_bytes());
    let started = Instant::now();
    let found = read(file).unwrap();
    assert!(started.elapsed() < Duration::from_secs(5));
    assert!(found.warnings[0].contains("65536 fit"), "{:?}", found.warnings);
    assert_eq!(column(&found, "intensity").len(), 3);
}

#[test]
fn chunks_around_a_damaged_one_are_read() {
    for (format, minor) in [(3u8, 2u8), (7, 4)] {
        let made = Handmade::new(minor, format).with_walk(1000, 0);
        let mut file = made.usual_laz(&[100]);
        let start = u32::from_le_bytes(file[96..100].try_into().unwrap()) as usize;
        let table = u64::from_le_bytes(file[start..start + 8].try_into().unwrap()) as usize;
        let middle = start + 8 + (table - start) * 45 / 100;
        file[middle..middle + 60].fill(0xff);
        let found = read(file).unwrap();
        let whole = read(made.las()).unwrap();
        let (some, all) = (column(&found, "position"), column(&whole, "position"));
        assert!(some.len() >= 3 * 800 && some[..1200] == all[..1200]);
        assert_eq!(some[some.len() - 1200..], all[all.len() - 1200..]);
        let missing = found.warnings.iter().any(|line| line.contains("of 1000 points were read"));
        assert_eq!(missing, some.len() < 3000, "{:?}", found.warnings);
    }
}

/// Invariant: a file that is none is shown as far as it can be read
/// Cost: milliseconds
#[test]
fn the_beginning_of_another_file_is_shown() {
    let line = |bytes: &[u8]| read(bytes.to_vec()).unwrap_err().to_string();
    assert_eq!(
        line(b"hello this is text, and more of it\n1 2 3\n"),
        "expected a file that begins with LASF, found `hello this is text,`; if it is a table of points, read it with `--format xyz`"
    );
    assert_eq!(line(b""), "expected a file that begins with LASF, found an empty file");
    assert_eq!(line(b"PK\x03\x04\0"), "expected a file that begins with LASF, found `PK`");
    assert_eq!(line(b"\0\0"), "expected a file that begins with LASF, found another beginning");
}
