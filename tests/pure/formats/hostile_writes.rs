//! Formats that misbehave while they write: what stood there before still does, and nothing is left behind.
//! Costs 2 s.

use crate::formats::stage::{Files, fixture, writing};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use surfelshop_cloud::{WriteError, WriteOptions, write};
use surfelshop_tests::clouds;

const OLD: &[u8] = b"what stood there before";

/// Invariant: a format that fails while it writes leaves the old file, and no other
#[test]
fn a_format_that_fails_leaves_the_old_file() {
    let (files, formats) = (Files::new(), fixture());
    let cloud = clouds::sphere(100, 1.0).cloud();
    for (ending, words) in [
        ("panics-in-write", ["formats/panics-in-write`", "write goes wrong"]),
        ("hangs-in-write", ["formats/hangs-in-write`", "did not answer within 1 s"]),
        ("fails-in-write", ["old.fails-in-write: ", "the ink is dry"]),
    ] {
        let name = format!("old.{ending}");
        let path = files.put(&name, OLD);
        let line = write(&path, &cloud, &writing(&formats)).unwrap_err().to_string();
        assert!(!line.contains('\n'), "{line}");
        for word in words {
            assert!(line.contains(word), "`{word}` is missing in: {line}");
        }
        assert_eq!(std::fs::read(&path).unwrap(), OLD);
        assert_eq!(files.names(), [name]);
        std::fs::remove_file(path).unwrap();
    }
    // The others go on.
    write(files.at("good.triplets"), &cloud, &writing(&formats)).unwrap();
    assert_eq!(std::fs::read(files.at("good.triplets")).unwrap().len(), 100 * 12);
}

#[test]
fn what_writes_without_end_stops_when_it_is_asked_to() {
    let (files, formats) = (Files::new(), fixture());
    let path = files.put("old.writes-no-end", OLD);
    let started = Instant::now();
    let is_enough = |_| match started.elapsed() > Duration::from_millis(100) {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    };
    let options = WriteOptions { progress: &is_enough, ..writing(&formats) };
    let error = write(&path, &clouds::sphere(100, 1.0).cloud(), &options).unwrap_err();
    assert!(matches!(error, WriteError::Cancelled { .. }), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), OLD);
    assert_eq!(files.names(), ["old.writes-no-end"]);
}
