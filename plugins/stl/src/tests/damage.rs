//! Damaged files end in a line, or are read: they never panic, and never take long.

use super::*;
use std::time::{Duration, Instant};

fn try_read(bytes: &[u8]) -> Result<Collected> {
    let start = Instant::now();
    let result = read(bytes);
    assert!(start.elapsed() < Duration::from_secs(10), "a damaged file takes long");
    result
}

fn files() -> [Vec<u8>; 2] {
    [binary("a cube", &cube()), text("a cube", &cube()).into_bytes()]
}

#[test]
fn files_that_are_cut_short_are_refused_or_doubted() {
    for file in files() {
        for len in (0..file.len() - 8).step_by(7) {
            let result = try_read(&file[..len]);
            let doubted = result.map(|found| !found.warnings.is_empty());
            assert!(doubted.unwrap_or(true), "{len} of {}", file.len());
        }
    }
}

#[test]
fn flipped_bytes_do_no_harm() {
    let mut state = 0x1234_5678_9abc_def1u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    for file in files() {
        for _ in 0..2000 {
            let mut damaged = file.clone();
            for _ in 0..1 + random() % 4 {
                damaged[random() as usize % file.len()] = random() as u8;
            }
            if let Err(error) = try_read(&damaged) {
                assert!(!error.to_string().contains('\n') && !error.to_string().is_empty());
            }
        }
    }
}

#[test]
fn a_line_without_end_is_refused() {
    let mut text = b"solid ".to_vec();
    text.resize(9 << 20, b'a');
    assert!(try_read(&text).unwrap_err().to_string().contains("expected lines"));
}
