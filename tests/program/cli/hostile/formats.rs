//! Formats that misbehave, through the program: one line, nothing that steers the terminal, and what stood there
//! before stays. Costs 3 s.

#![cfg(unix)]

use crate::cli::program::{Ended, TestFolder, facing_front};
use std::time::{Duration, Instant};
use surfelshop_tests::stage::build_folder;

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(60);

/// The library of the fixture's formats.
fn library() -> String {
    let library =
        format!("{}formats{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let path = build_folder().join("examples").join(library);
    assert!(path.is_file(), "{} is not built; `cargo verify` builds it", path.display());
    path.to_string_lossy().into_owned()
}

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    desk
}

/// Runs a command with the fixture's formats, under a limit of the shell.
fn run_within(desk: &TestFolder, limit: &str, arguments: &str) -> Ended {
    let library = library();
    let given = arguments.split(' ').chain(["--trust", "--plugin", &library]);
    let started = Instant::now();
    let ended = desk.run_within(limit, &given.collect::<Vec<_>>());
    assert!(started.elapsed() < LONG, "{arguments} took {:?}", started.elapsed());
    ended
}

fn run(desk: &TestFolder, arguments: &str) -> Ended {
    run_within(desk, "true", arguments)
}

/// Invariant: a file runs no code of a format that nobody said yes to
#[test]
fn a_format_that_nobody_said_yes_to_reads_nothing() {
    let desk = desk();
    desk.put("a.triplets", "twelve bytes");
    for command in ["info a.triplets", "convert a.triplets b.ply", "render a.triplets -o a.png"] {
        let arguments: Vec<&str> = command.split(' ').collect();
        let library = library();
        let ended = desk.run_with(&[&arguments[..], &["--plugin", &library]].concat());
        ended.failed(&["new here"]);
    }
    assert_eq!(desk.files(), ["a.triplets", "one.ply"]);
    assert!(run(&desk, "info a.triplets").done().stdout.contains("points    1"));
}

#[test]
fn what_formats_say_does_not_steer_the_terminal() {
    let desk = desk();
    for ending in ["says-a-lot", "steers-terminal", "panics-in-read", "fails-late"] {
        let name = format!("bad.{ending}");
        desk.put(&name, "x");
        for command in [format!("info {name} --full"), format!("convert {name} out.ply")] {
            let ended = run(&desk, &command);
            ended.failed(&[&name]);
            let steers = |c: char| c.is_control() && c != '\n';
            assert!(!ended.stderr.contains(steers), "{}", ended.stderr.escape_debug());
        }
    }
    let ended = run(&desk, "convert one.ply new.says-much-of-it").done();
    let steers = |c: char| c.is_control() && c != '\n';
    assert!(!ended.stderr.contains(steers), "{}", ended.stderr.escape_debug());
    assert!(ended.stderr.lines().all(|line| line.starts_with("surfelshop: warning: column")));
}

/// Invariant: points without end are one line, long before they have taken all memory
#[test]
fn points_without_end_are_one_line() {
    let desk = desk();
    desk.put("bad.never-ends", "x");
    let ended = run_within(&desk, "ulimit -v 2000000", "info bad.never-ends --full");
    ended.failed(&["bad.never-ends", "points are too many for this machine", "are needed"]);
}

#[test]
fn a_file_without_end_is_one_line_and_leaves_the_old_one() {
    let desk = desk();
    desk.put("old.writes-no-end", "what stood there before");
    // In blocks of 512 bytes, more than the copy of a library.
    let line = "convert one.ply old.writes-no-end";
    let ended = run_within(&desk, "trap '' XFSZ; ulimit -f 65536", line);
    ended.failed(&["old.writes-no-end"]);
    let old = std::fs::read_to_string(desk.at("old.writes-no-end")).unwrap();
    assert_eq!(old, "what stood there before");
    assert_eq!(desk.files(), ["old.writes-no-end", "one.ply"]);
}
