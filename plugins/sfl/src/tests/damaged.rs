//! Files that end early, or in which bytes are others.

use super::clouds::{Numbers, QuietHost, TestCloud, discs, read, write};
use super::files::{bytes_of, file_of, resolution, set};
use crate::Sfl;
use crate::read::Buffer;
use crate::settings::Settings;
use surfelshop_api::columns::{TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudSink, Collected, FileSource, Pose};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::job::{CANCELLED, JobHost};
use surfelshop_api::{Format, HostInfo, Job, Result};

/// Good files of every kind.
fn good() -> Vec<Vec<u8>> {
    let vectors = |len: usize| Buffer::F32((0..3 * len).map(|i| i as f32).collect());
    let ellipses = TestCloud::new(&[[1.0, 2.0, 3.0]; 9])
        .with(TANGENT_U, 3, vectors(9))
        .with(TANGENT_V, 3, vectors(9))
        .with("shininess", 1, Buffer::U8(vec![5; 9]));
    let mut posed = discs(5);
    posed.header.pose =
        Pose { rotation: DQuat::from_rotation_y(0.4), translation: DVec3::new(1e6, 2.0, 3.0) };
    let records = bytes_of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let scaled = [2.0, 0.0, 0.0, 1.0, 0.0, 3.0, 0.0, 1.0, 0.0, 0.0, -4.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let by_hand = set(0, 12, &[1, 0], &[(0, 0)])
        .floats(0x0161, &scaled)
        .floats(0x0118, &[0.0; 6])
        .words(0x0140, &[2])
        .child(resolution(2, &records))
        .child(resolution(u32::MAX, &records));
    vec![write(&[discs(20)]).0, write(&[ellipses, posed]).0, file_of(vec![by_hand])]
}

/// Reads a file, however damaged it is: clouds within its bytes, or one line.
fn check(bytes: &[u8], what: &str) -> bool {
    match read(bytes) {
        Ok(found) => {
            let rows: u64 = found.clouds.iter().map(|cloud| cloud.header.rows.unwrap()).sum();
            assert!(rows * 12 <= bytes.len() as u64, "{what}: {rows} surfels");
            for cloud in &found.clouds {
                let pose = cloud.header.pose;
                assert!(pose.rotation.is_normalized() && pose.translation.is_finite(), "{what}");
                let values = cloud.columns[0].len() as u64;
                assert_eq!(values, 3 * cloud.header.rows.unwrap(), "{what}");
            }
            true
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{what}: {line}");
            false
        }
    }
}

#[test]
fn files_that_end_early_are_read_as_far_as_they_go_or_refused_in_a_line() {
    for bytes in good() {
        assert!(check(&bytes, "whole"));
        let outcomes: Vec<bool> =
            (0..bytes.len()).map(|len| check(&bytes[..len], &format!("{len} bytes"))).collect();
        assert!(outcomes[bytes.len() - 1], "what only closes lists is not needed");
        assert!(!outcomes[100]);
    }
    let bytes = &good()[0];
    let found = read(&bytes[..bytes.len() - 48 - 40]).unwrap();
    assert!(found.clouds[0].header.rows.is_some_and(|rows| rows == 18), "{:?}", found.warnings);
    assert!(found.warnings.iter().any(|line| line.contains("cut short")), "{:?}", found.warnings);
}

#[test]
fn files_with_other_bytes_neither_panic_nor_hang() {
    let mut numbers = Numbers(3);
    for (kind, bytes) in good().into_iter().enumerate() {
        let mut n_read = 0;
        for seed in 0..4000 {
            let mut damaged = bytes.clone();
            for _ in 0..=numbers.below(4) {
                let place = numbers.below(damaged.len());
                damaged[place] = match numbers.below(3) {
                    0 => numbers.next() as u8,
                    1 => 0xff,
                    _ => damaged[place] ^ 1 << numbers.below(8),
                };
            }
            n_read += usize::from(check(&damaged, &format!("file {kind}, seed {seed}")));
        }
        assert!((400..4000).contains(&n_read), "file {kind}: {n_read} of 4000 are read");
    }
}

#[test]
fn sizes_that_are_announced_are_checked_before_memory_is_taken() {
    let records = bytes_of(&[1.0, 2.0, 3.0]);
    let one = |n: u32| set(1, 12, &[1], &[(0, 0)]).child(resolution(n, &records));
    // Counts of 2^32 - 2 surfels, of which one is there.
    let mut bytes = file_of(vec![one(u32::MAX - 1)]);
    let data = bytes.windows(4).position(|w| w == [0x01, 0x71, 0, 10]).unwrap();
    bytes[data + 4..data + 8].fill(0xff);
    let found = read(&bytes).unwrap();
    assert!(found.clouds[0].columns[0].len() < bytes.len() / 4);
    assert!(found.warnings.iter().any(|line| line.contains("cut short")), "{:?}", found.warnings);
    let line = |made| read(&file_of(vec![made])).unwrap_err().to_string();
    assert!(
        line(one(1).without(0x0151).words(0x0151, &[u32::MAX])).contains("expected surfels of")
    );
    assert!(line(one(1).without(0x0151).words(0x0151, &[0])).contains("expected surfels of"));
    assert!(line(one(1).without(0x0152).with(0x0152, 4, u32::MAX, vec![0; 8])).contains("at most"));
    assert!(line(one(1).without(0x0153)).contains("numbers of properties"));
    assert!(line(one(1).words(0x0140, &[u32::MAX])).contains("found number 4294967294"));
}

#[test]
fn other_files_are_refused_by_their_first_bytes() {
    let bytes = &good()[0];
    let line_of = |place: usize, byte: u8| {
        let mut other = bytes.clone();
        other[place] = byte;
        read(&other).unwrap_err().to_string()
    };
    assert!(line_of(0, b'g').contains("expected `GFLF` at byte 0, found `gFLF`"));
    assert!(line_of(8, b'X').contains("expected `SFLF` at byte 8"));
    assert!(line_of(6, 1).contains("newer"), "{}", line_of(6, 1));
    assert!(line_of(14, 3).contains("found 3"), "{}", line_of(14, 3));
    assert!(read(b"GFLF").unwrap_err().to_string().contains("cut short"));
    let mut younger = bytes.clone();
    younger[7] = 9;
    assert_eq!(read(&younger).unwrap(), read(bytes).unwrap());
}

/// A host whose user wants to stop.
struct StoppingHost;

impl JobHost for StoppingHost {
    fn progress(&self, fraction: f64, message: &str) {
        QuietHost.progress(fraction, message);
    }

    fn cancelled(&self) -> bool {
        true
    }

    fn stage(&self, header: &surfelshop_api::tool::EditHeader, values: &[&[u8]]) -> Result<()> {
        QuietHost.stage(header, values)
    }
}

#[test]
fn reading_stops_when_it_is_asked_to() {
    let file = FileSource::of_bytes(good().remove(0), "test.sfl");
    let mut collected = Collected::default();
    let mut sink = CloudSink::new(&mut collected, None);
    let mut format = Sfl::new(&HostInfo::default()).unwrap();
    let outcome = format.read(&file, &Settings::default(), &mut sink, &Job::new(&StoppingHost));
    assert_eq!(outcome.unwrap_err().to_string(), CANCELLED);
}
