//! Formats that misbehave while they read, one test per way: a line says what was wrong, formats beside them go on,
//! and clouds that were there before stay. Costs 6 s, most of it waiting for those that hang.

use crate::formats::stage::{Files, SILENCE, fixture, reading};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};
use surfelshop_cloud::convert::{Selection, convert};
use surfelshop_cloud::{
    Cloud, Loaded, ReadError, ReadFault, ReadOptions, WriteOptions, inspect, read,
};
use surfelshop_runtime::formats::PluginFormats;

/// Far beyond any pause of a busy machine, far below for ever.
const LONG: Duration = Duration::from_secs(60);

/// Twelve bytes are a point of the fixture's good format.
const THREE_POINTS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// A fixture with a good file that was read before anything went wrong.
struct Stage {
    files: Files,
    formats: PluginFormats,
    before: Cloud,
}

impl Stage {
    fn new() -> Self {
        let (files, formats) = (Files::new(), fixture());
        let bytes: Vec<u8> = THREE_POINTS.iter().flat_map(|value| value.to_le_bytes()).collect();
        let path = files.put("good.triplets", &bytes);
        let before = read(path, &reading(&formats)).unwrap().cloud;
        Self { files, formats, before }
    }

    /// Reads a file of one byte, or of these, with the format that the ending names.
    fn read_bytes(&self, ending: &str, bytes: &[u8]) -> Result<Loaded, ReadError> {
        let path = self.files.put(&format!("bad.{ending}"), bytes);
        let started = Instant::now();
        let loaded = read(path, &reading(&self.formats));
        assert!(started.elapsed() < LONG, "it took {:?}", started.elapsed());
        self.assert_nothing_else_happened();
        loaded
    }

    fn read(&self, ending: &str) -> Result<Loaded, ReadError> {
        self.read_bytes(ending, &[0])
    }

    /// The cloud of before is as it was, and its file is read again.
    fn assert_nothing_else_happened(&self) {
        let again = read(self.files.at("good.triplets"), &reading(&self.formats)).unwrap();
        for cloud in [&self.before, &again.cloud] {
            let positions: Vec<f32> = cloud.positions().iter().flat_map(|p| p.to_array()).collect();
            assert_eq!(positions, THREE_POINTS);
        }
    }

    /// Expects one line with the file's name and all these words.
    #[track_caller]
    fn fails(&self, ending: &str, words: &[&str]) {
        self.says(self.read(ending), ending, words);
    }

    #[track_caller]
    fn says(&self, ended: Result<Loaded, ReadError>, ending: &str, words: &[&str]) {
        let line = match ended {
            Err(error) => error.to_string(),
            Ok(loaded) => panic!("it was read: {:?}", loaded.summary),
        };
        assert!(!line.contains('\n'), "more than one line: {line}");
        for word in [&[&*format!("bad.{ending}: ")], words].concat() {
            assert!(line.contains(word), "`{word}` is missing in: {line}");
        }
    }
}

/// Invariant: a format that panics, hangs or reads in circles costs one line, and nothing else
#[test]
fn panics_are_lines() {
    let stage = Stage::new();
    let format = "the format `org.surfelshop.test.formats/panics-in-read`";
    stage.fails("panics-in-read", &[format, "read goes wrong", "reads.rs"]);
    stage.fails("panics-in-loop", &["panics-in-loop", "part 33 of the loop goes wrong"]);
    // It is asked again as if nothing had been.
    stage.fails("panics-in-read", &["read goes wrong"]);
}

#[test]
fn what_gives_no_sign_of_life_is_given_up() {
    let stage = Stage::new();
    for ending in ["hangs-in-read", "hangs-in-loop", "warns-for-ever"] {
        let started = Instant::now();
        stage.fails(ending, &[&format!("formats/{ending}`"), "did not answer within 1 s"]);
        assert!(started.elapsed() >= SILENCE);
    }
}

#[test]
fn what_reads_in_circles_is_given_up() {
    let stage = Stage::new();
    let ended = stage.read_bytes("reads-in-circles", &[7; 1 << 16]);
    let words = ["formats/reads-in-circles`", "of a file of 65536", "it reads in circles"];
    stage.says(ended, "reads-in-circles", &words);
}

/// Who asks gets away from what never ends, whatever signs of life it gives.
#[test]
fn what_never_ends_stops_when_it_is_asked_to() {
    let stage = Stage::new();
    for ending in ["circles-a-byte", "ignores-refusals", "hangs-in-read"] {
        let path = stage.files.put(&format!("bad.{ending}"), &[0]);
        let started = Instant::now();
        let is_enough = |_| match started.elapsed() > Duration::from_millis(200) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let options = ReadOptions { progress: &is_enough, ..reading(&stage.formats) };
        let fault = read(path, &options).unwrap_err().fault;
        assert!(matches!(fault, ReadFault::Cancelled), "{ending}: {fault}");
        assert!(started.elapsed() < LONG, "{ending}");
        stage.assert_nothing_else_happened();
    }
}

#[test]
fn more_points_than_announced_are_refused_and_fewer_are_said() {
    let stage = Stage::new();
    stage.fails("hands-over-more", &["10 points are announced, more came"]);
    // Nor is a file written of them, or looked at for ever.
    let path = stage.files.at("bad.hands-over-more");
    let options = reading(&stage.formats);
    let looked = inspect(&path, &options).unwrap_err().to_string();
    let out = stage.files.at("out.ply");
    let (whole, written) = (Selection::default(), WriteOptions::default());
    let converted = convert(&[path], &out, &whole, false, &options, &written);
    for line in [looked, converted.unwrap_err().to_string()] {
        assert!(line.contains("10 points are announced, more came"), "{line}");
    }
    assert!(!out.exists());
    let loaded = stage.read("hands-over-fewer").unwrap();
    assert_eq!((loaded.cloud.len(), loaded.summary.n_in_file), (4, 4));
    assert_eq!(loaded.summary.warnings, ["10 points are announced, 4 were read"]);
}

/// Invariant: memory is taken for points that come, not for points that are announced
#[test]
fn points_that_are_announced_take_no_memory() {
    let stage = Stage::new();
    let loaded = stage.read("a-billion").unwrap();
    assert!(loaded.cloud.is_empty());
    assert_eq!(loaded.summary.warnings, ["1000000000 points are announced, 0 were read"]);
}

#[test]
fn columns_that_are_not_what_was_said_are_refused() {
    let stage = Stage::new();
    let words = ["column `intensity` of a batch", "expected 10 points of 1", "found 20 values"];
    stage.fails("other-type", &words);
    stage.fails("batch-first", &["a batch came before the header of its cloud"]);
    stage.fails("has-no-position", &["expected a column `position` of f32 or f64, found none"]);
}

#[test]
fn places_that_are_no_numbers_are_left_out_and_counted() {
    let loaded = Stage::new().read("has-no-numbers").unwrap();
    assert_eq!((loaded.cloud.len(), loaded.summary.n_dropped), (20, 20));
    assert!(loaded.cloud.positions().iter().all(|place| place.is_finite()));
}

#[test]
fn a_pose_that_is_no_rotation_is_refused() {
    let stage = Stage::new();
    for (bytes, number) in [(&[0][..], "2"), (&[0, 0], "NaN")] {
        let ended = stage.read_bytes("has-no-rotation", bytes);
        stage.says(ended, "has-no-rotation", &["expected a pose of a rotation", number]);
    }
}

#[test]
fn names_with_control_characters_are_refused_and_written_out() {
    let line = Stage::new().read("steers-terminal").unwrap_err().to_string();
    assert!(!line.contains(char::is_control), "{}", line.escape_debug());
    assert!(line.contains(r"column `inten\u{1b}[31msity\nand more`: expected a name of"), "{line}");
}

#[test]
fn triangles_between_points_that_are_not_there_are_left_out() {
    let loaded = Stage::new().read("faces-nowhere").unwrap();
    assert_eq!(loaded.cloud.faces(), [[0, 1, 2]]);
    let warning = &loaded.summary.warnings[0];
    assert!(warning.starts_with("3 of 4 faces were left out"), "{warning}");
}

#[test]
fn an_error_of_thousands_of_lines_is_one_that_a_person_can_read() {
    let stage = Stage::new();
    stage.fails("says-a-lot", &["bad.says-a-lot: the first line", "the second"]);
    let line = stage.read("says-a-lot").unwrap_err().to_string();
    assert!(line.len() < 20_000, "{} bytes", line.len());
}

#[test]
fn points_of_a_file_that_fails_late_are_dropped() {
    let line = "point 10: expected three numbers, found the end of the file";
    Stage::new().fails("fails-late", &[line]);
}
