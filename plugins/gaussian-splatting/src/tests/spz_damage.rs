//! Damaged SPZ files end in a line, or are read.

use super::packed::{Packed, gzip};
use super::*;

#[test]
fn damaged_files_do_no_harm() {
    for version in 1..=4 {
        let packed = Packed::noise(version, 1, 2);
        let (cut, _) = damage::<Spz>(&packed.file());
        assert_eq!(cut, 0, "version {version}");
        if version < 4 {
            // Checksums hide the bytes behind them.
            let plain = packed.plain();
            for i in 0..plain.len() {
                assert!(!survives::<Spz>(&gzip(&plain[..i])));
                let mut damaged = plain.clone();
                damaged[i] ^= 0xff;
                // Of the header a change is a refusal, but for the flags and the byte that nobody reads.
                assert_eq!(survives::<Spz>(&gzip(&damaged)), i >= 14, "byte {i} of {version}");
            }
        }
    }
}

#[test]
fn checksums_are_looked_at() {
    let mut file = Packed::noise(3, 1, 40).file();
    let len = file.len();
    file[len - 8] ^= 1;
    assert!(refusal::<Spz>(&file).contains("damaged"));
}

#[test]
fn announced_numbers_take_no_memory() {
    for version in 1..=4 {
        for points in [1 << 20, u32::MAX] {
            let mut packed = Packed::noise(version, 3, 2);
            packed.points = points;
            let line = refusal::<Spz>(&packed.file());
            assert!(line.contains("cannot hold"), "{line}");
        }
        // So few that they could be there.
        let mut packed = Packed::noise(version, 3, 2);
        packed.points = 300;
        let line = refusal::<Spz>(&packed.file());
        assert!(line.contains("found less") || line.contains("in the table"), "{line}");
    }
}

#[test]
fn tables_that_lie_are_refused() {
    let packed = Packed::noise(4, 1, 3);
    let file = packed.file();
    let with = |place: usize, bytes: &[u8]| {
        let mut changed = file.clone();
        changed[place..place + bytes.len()].copy_from_slice(bytes);
        refusal::<Spz>(&changed)
    };
    assert!(with(15, &[5]).contains("expected 6 streams, found 5"));
    assert!(with(15, &[255]).contains("expected 6 streams, found 255"));
    assert!(with(16, &31u32.to_le_bytes()).contains("table of streams"));
    assert!(with(16, &u32::MAX.to_le_bytes()).contains("cut short"));
    for entry in 0..6 {
        let place = 32 + 16 * entry;
        assert!(with(place, &u64::MAX.to_le_bytes()).contains("cut short"));
        assert!(with(place + 8, &u64::MAX.to_le_bytes()).contains("in the table"));
        assert!(with(place, &0u64.to_le_bytes()).contains("damaged"));
    }
    // A stream that goes on behind the last Gaussian, and one that ends before.
    for (len, word) in [(10, "no more"), (8, "damaged")] {
        let mut longer = packed.clone();
        longer.attributes[3].resize(len, 7);
        let mut file = longer.file();
        file[32 + 16 * 3 + 8..][..8].copy_from_slice(&9u64.to_le_bytes());
        assert!(refusal::<Spz>(&file).contains(word));
    }
}

#[test]
fn what_is_no_spz_is_said_to_be_none() {
    for bytes in [&b""[..], b"N", b"NGS", b"PK\x03\x04", b"\x1f"] {
        assert!(refusal::<Spz>(bytes).contains("no .spz file"));
    }
    for bytes in [b"NGSP".to_vec(), vec![0x1f, 0x8b], gzip(b""), gzip(b"NGSP\x02\0\0\0")] {
        assert!(!survives::<Spz>(&bytes));
    }
    assert!(refusal::<Spz>(&gzip(&[7; 100])).contains("NGSP"));
    for (version, known) in [(0, "1 to 3"), (4, "1 to 3"), (u32::MAX, "1 to 3")] {
        let mut packed = Packed::noise(3, 0, 1);
        packed.version = version;
        assert!(refusal::<Spz>(&gzip(&packed.plain())).contains(known));
    }
    let mut file = Packed::noise(4, 0, 1).file();
    file[4] = 5;
    assert!(refusal::<Spz>(&file).contains("found 5"));
    let mut packed = Packed::noise(2, 0, 1);
    packed.bits = 31;
    assert!(refusal::<Spz>(&packed.file()).contains("bits"));
}
