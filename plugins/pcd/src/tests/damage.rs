//! Damaged files end in a line, or are read: they never panic, and never take long.

use super::*;
use std::time::{Duration, Instant};

fn files() -> Vec<Vec<u8>> {
    let cloud = || {
        let mut cloud = round_trips::cloud_of(40, |i| i as f64 * 0.25);
        cloud.header.grid = Some([8, 5]);
        cloud.header.rows = Some(40);
        cloud
    };
    [Encoding::Binary, Encoding::Ascii, Encoding::BinaryCompressed]
        .map(|encoding| write(cloud(), encoding).unwrap().0)
        .to_vec()
}

fn try_read(bytes: &[u8]) -> Result<Collected> {
    let start = Instant::now();
    let result = read(bytes);
    assert!(start.elapsed() < Duration::from_secs(10), "a damaged file takes long");
    if let Err(error) = &result {
        assert!(!error.to_string().contains('\n') && !error.to_string().is_empty());
    }
    result
}

#[test]
fn files_that_are_cut_short_are_refused() {
    for file in files() {
        // The last number of a text is one without its last digits, too.
        for len in (0..file.len() - 12).step_by(7) {
            assert!(try_read(&file[..len]).is_err(), "{len} of {}", file.len());
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
        let header = file.windows(5).position(|word| word == b"DATA ").unwrap() + 30;
        for round in 0..600 {
            let mut damaged = file.clone();
            // Half of them in the header, which says how everything else is read.
            let range = if round % 2 == 0 { header } else { file.len() };
            for _ in 0..1 + random() % 4 {
                damaged[random() as usize % range] = random() as u8;
            }
            drop(try_read(&damaged));
        }
    }
}

#[test]
fn announced_sizes_take_no_memory() {
    let header = |rest: &str| {
        format!(
            "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4000000000\nHEIGHT 1\n{rest}"
        )
    };
    for data in ["binary", "ascii"] {
        let file = file(&header(&format!("DATA {data}\n")), &[b'1'; 100]);
        let line = try_read(&file).map(|_| ()).unwrap_err().to_string();
        assert!(line.contains("cut short"), "{line}");
    }
    let small = header("DATA binary_compressed\n").replace("4000000000", "300000000");
    let sizes = [8u32.to_le_bytes(), 3_600_000_000u32.to_le_bytes()].concat();
    let lying = file(&small, &[sizes, vec![0; 8]].concat());
    let line = try_read(&lying).map(|_| ()).unwrap_err().to_string();
    assert!(line.contains("cannot hold"), "{line}");
    let many = file(
        "VERSION .7\nFIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4000000000\nWIDTH 1\nDATA binary\n",
        b"abc",
    );
    assert!(try_read(&many).map(|_| ()).unwrap_err().to_string().contains("cut short"));
}

#[test]
fn a_line_without_end_is_refused() {
    let mut text =
        b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nDATA ascii\n"
            .to_vec();
    text.resize(text.len() + (9 << 20), b'1');
    let line = try_read(&text).map(|_| ()).unwrap_err().to_string();
    assert!(line.contains("expected lines"), "{line}");
}
